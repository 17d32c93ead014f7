/* os_guard.h: checks of arguments and results. Each looks at every entry, whatever it finds, and returns how many
 * failed, so that the time of a call does not depend on the data. A NaN fails every check. */
#ifndef OS_GUARD_H
#define OS_GUARD_H

#include "os_rt.h"

#ifdef OS_REAL_IS_FLOAT
#define OS_LARGEST FLT_MAX
#define OS_ASYMMETRY ((os_real_t)0x1p-12)
#else
#define OS_LARGEST DBL_MAX
#define OS_ASYMMETRY ((os_real_t)0x1p-26)
#endif

static inline uint32_t os_failed(bool failed)
{
    uint32_t bad = 0U;
    if (failed) {
        bad = 1U;
    }
    return bad;
}

static inline uint32_t os_not_finite(const os_real_t *v, uint32_t count)
{
    uint32_t bad = 0U;
    for (uint32_t k = 0U; k < count; k++) {
        bad += (os_fabs(v[k]) <= OS_LARGEST) ? 0U : 1U;
    }
    return bad;
}

static inline uint32_t os_out_of_range(const os_real_t *v, uint32_t count, os_real_t lower, os_real_t upper)
{
    uint32_t bad = 0U;
    for (uint32_t k = 0U; k < count; k++) {
        bad += ((v[k] >= lower) && (v[k] <= upper)) ? 0U : 1U;
    }
    return bad;
}

/* Rows whose squared length is outside [least, most]. */
static inline uint32_t os_not_unit(const os_real_t *v, uint32_t rows, uint32_t length, os_real_t least, os_real_t most)
{
    uint32_t bad = 0U;
    for (uint32_t i = 0U; i < rows; i++) {
        os_real_t square = (os_real_t)0.0;
        for (uint32_t k = 0U; k < length; k++) {
            const os_real_t entry = v[(i * length) + k];
            square += entry * entry;
        }
        bad += ((square >= least) && (square <= most)) ? 0U : 1U;
    }
    return bad;
}

/* What every covariance (n, n) fulfils: positive diagonal, symmetry, and no entry larger than its diagonal allows. */
static inline uint32_t os_not_covariance(const os_real_t *P, uint32_t n)
{
    uint32_t bad = 0U;
    for (uint32_t i = 0U; i < n; i++) {
        bad += (P[i * (n + 1U)] > (os_real_t)0.0) ? 0U : 1U;
        for (uint32_t j = 0U; j < i; j++) {
            const os_real_t below = P[(i * n) + j];
            const os_real_t above = P[(j * n) + i];
            /* halves first, so that the sum cannot overflow */
            const os_real_t mean = ((os_real_t)0.5 * P[i * (n + 1U)]) + ((os_real_t)0.5 * P[j * (n + 1U)]);
            const bool symmetric = os_fabs(below - above) <= (OS_ASYMMETRY * mean);
            const bool small = os_fabs(below) <= (mean + (OS_ASYMMETRY * mean));
            bad += (symmetric && small) ? 0U : 1U;
        }
    }
    return bad;
}

/* Scales the first `valid` rows to length 1; the rows after them repeat row 0. Adds to *scaled how many valid rows had a
 * length that differs from 1 by more than the tolerance, and returns how many have no direction. */
static inline uint32_t os_scale_rows(const os_real_t *v, uint32_t rows, uint32_t length, uint32_t valid,
                                     os_real_t tolerance, os_real_t *unit, uint32_t *scaled)
{
    uint32_t bad = 0U;
    for (uint32_t i = 0U; i < rows; i++) {
        const uint32_t source = (i < valid) ? i : 0U;
        const os_real_t *row = &v[source * length];
        os_real_t largest = (os_real_t)0.0;
        os_real_t square = (os_real_t)0.0;
        for (uint32_t k = 0U; k < length; k++) {
            largest = os_fmax(largest, os_fabs(row[k]));
        }
        const bool has_direction = (largest > (os_real_t)0.0) && (largest <= OS_LARGEST);
        const os_real_t divisor = has_direction ? largest : (os_real_t)1.0;
        for (uint32_t k = 0U; k < length; k++) {
            const os_real_t entry = row[k] / divisor;
            unit[(i * length) + k] = entry;
            square += entry * entry;
        }
        const os_real_t norm = has_direction ? os_sqrt(square) : (os_real_t)1.0;
        for (uint32_t k = 0U; k < length; k++) {
            unit[(i * length) + k] /= norm;
        }
        *scaled += ((i < valid) && (os_fabs((norm * divisor) - (os_real_t)1.0) > tolerance)) ? 1U : 0U;
        bad += has_direction ? 0U : 1U;
    }
    return bad;
}

#endif
