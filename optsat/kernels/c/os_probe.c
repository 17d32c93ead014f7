/* os_probe: a digest of what a compiler makes of arithmetic. Kernels are not compiled by one that answers otherwise than
   the arithmetic of IEEE 754 does, operation by operation, denormal numbers, signed zeros and NaN included. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#define OS_PROBE_SAMPLES 4096

static uint64_t os_mixed(uint64_t digest, uint64_t word)
{
    return (digest ^ word) * UINT64_C(0x100000001B3);
}

/* Any NaN stands for every NaN. */
static uint64_t os_mixed_double(uint64_t digest, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return os_mixed(digest, isnan(value) ? UINT64_C(0x7FF8000000000000) : bits);
}

static uint64_t os_mixed_float(uint64_t digest, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return os_mixed(digest, isnan(value) ? UINT64_C(0x7FC00000) : (uint64_t)bits);
}

/* Knuth's generator; every bit pattern is a number, and one in four is near 1 so that operations seldom overflow. */
static uint64_t os_next(uint64_t *state)
{
    *state = (*state * UINT64_C(6364136223846793005)) + UINT64_C(1442695040888963407);
    return *state;
}

static double os_drawn_double(uint64_t *state)
{
    uint64_t bits = os_next(state);
    if (((bits >> 20) & 3U) != 0U) {
        bits = (bits & UINT64_C(0x801FFFFFFFFFFFFF)) | UINT64_C(0x3FE0000000000000);
    }
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static float os_drawn_float(uint64_t *state)
{
    const uint64_t drawn = os_next(state);
    uint32_t bits = (uint32_t)(drawn >> 32);
    if (((drawn >> 20) & 3U) != 0U) {
        bits = (bits & UINT32_C(0x80FFFFFF)) | UINT32_C(0x3F000000);
    }
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* No product is used twice: a compiler that fuses products with sums would leave it alone. */
#define OS_PROBE(NAME, REAL, ROOT, DRAWN, MIXED)                          \
    static uint64_t NAME(uint64_t digest)                                 \
    {                                                                     \
        uint64_t state = 1U;                                              \
        REAL sum = (REAL)0;                                               \
        for (int32_t i = 0; i < OS_PROBE_SAMPLES; ++i) {                  \
            const REAL a = DRAWN(&state);                                 \
            const REAL b = DRAWN(&state);                                 \
            const REAL c = DRAWN(&state);                                 \
            digest = MIXED(digest, (a * b) + c);                          \
            digest = MIXED(digest, a - (c * b));                          \
            digest = MIXED(digest, (a + b) - a);                          \
            digest = MIXED(digest, (a / c) + (b / c));                    \
            digest = MIXED(digest, (a * (REAL)0) + (c - c));              \
            digest = MIXED(digest, (REAL)0 - a);                          \
            digest = MIXED(digest, -(b + (REAL)0));                       \
            digest = MIXED(digest, ROOT(a));                              \
            digest = MIXED(digest, (a >= b) ? a : b);                     \
            digest = MIXED(digest, ((a < b) && !(b <= c)) ? (REAL)1 : c); \
            sum += a - (b * b);                                           \
            sum = (isnan(sum) || isinf(sum)) ? (REAL)0 : sum;             \
            digest = MIXED(digest, sum);                                  \
        }                                                                 \
        return digest;                                                    \
    }

OS_PROBE(os_probe_double, double, sqrt, os_drawn_double, os_mixed_double)
OS_PROBE(os_probe_float, float, sqrtf, os_drawn_float, os_mixed_float)

uint64_t os_probe(void);
uint64_t os_probe(void)
{
    return os_probe_float(os_probe_double(UINT64_C(0xCBF29CE484222325)));
}
