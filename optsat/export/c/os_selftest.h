/* os_selftest.h: compares the answers of a kernel with stored ones; for tests only, no part of flight code. */
#ifndef OS_SELFTEST_H
#define OS_SELFTEST_H

#include <stdio.h>
#include <string.h>

#include "os_rt.h"

#ifdef OS_REAL_IS_FLOAT
#define OS_SPACING ((double)FLT_EPSILON)
typedef uint32_t os_bits_t;
#else
#define OS_SPACING DBL_EPSILON
typedef uint64_t os_bits_t;
#endif

/* worst: largest difference of a result in units in the last place of the largest number that it has in any vector;
 * error: the same as a number; bits: a digest of all results, the same on every computer that gives the same bits. */
typedef struct {
    unsigned long vectors;
    unsigned long accepted;
    unsigned long wrong_status;
    unsigned long numbers;
    unsigned long differing;
    double worst;
    double error;
    uint64_t bits;
} os_tally_t;

static inline void os_tally_start(os_tally_t *tally)
{
    (void)memset(tally, 0, sizeof *tally);
    tally->bits = 0xcbf29ce484222325U;
}

static inline void os_tally_status(os_tally_t *tally, uint32_t got, uint32_t want)
{
    tally->vectors += 1U;
    tally->accepted += (got == 0U) ? 1U : 0U;
    tally->wrong_status += (got == want) ? 0U : 1U;
}

static inline void os_tally_port(os_tally_t *tally, const os_real_t *got, const double *want, uint32_t count,
                                 double largest)
{
    for (uint32_t k = 0U; k < count; k++) {
        const os_real_t rounded = (os_real_t)want[k];
        const double difference = fabs((double)got[k] - want[k]);
        const double units = difference / (OS_SPACING * largest);
        os_bits_t a = 0U;
        os_bits_t b = 0U;
        (void)memcpy(&a, &got[k], sizeof a);
        (void)memcpy(&b, &rounded, sizeof b);
        tally->numbers += 1U;
        tally->differing += (a == b) ? 0U : 1U;
        /* a NaN is the largest difference of all */
        tally->worst = (units <= tally->worst) ? tally->worst : units;
        tally->error = (difference <= tally->error) ? tally->error : difference;
        for (uint32_t byte = 0U; byte < (uint32_t)sizeof a; byte++) {
            tally->bits = (tally->bits ^ (uint64_t)(a & 0xFFU)) * 0x100000001b3U;
            a >>= 8;
        }
    }
}

/* Prints one line, and returns 0 where the kernel answered as stored, within `allowed` units. */
static inline int os_tally_report(const os_tally_t *tally, const char *name, double allowed)
{
    const bool good = (tally->wrong_status == 0U) && (tally->worst <= allowed) && (tally->accepted > 0U);
    (void)printf("%s %s vectors %lu accepted %lu wrong_status %lu numbers %lu differing %lu worst_ulp %.9g error %.9g "
                 "bits %08lx%08lx\n",
                 name, good ? "passed" : "FAILED", tally->vectors, tally->accepted, tally->wrong_status, tally->numbers,
                 tally->differing, tally->worst, tally->error, (unsigned long)(tally->bits >> 32),
                 (unsigned long)(tally->bits & 0xFFFFFFFFU));
    return good ? 0 : 1;
}

#endif
