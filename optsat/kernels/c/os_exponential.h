/* os_exponential.h: exponential and logarithm, the same bits on every machine, error below 1 unit in the last place. */
#ifndef OS_EXPONENTIAL_H
#define OS_EXPONENTIAL_H

#include "os_bits.h"

#ifdef OS_REAL_IS_FLOAT
#define OS_ONE_OVER_LOG_2 ((os_real_t)0x1.715476p+0)
/* Any exponent times the first part of log 2 is exact. */
#define OS_LOG_2_HIGH ((os_real_t)0x1.62e4p-1)
#define OS_LOG_2_LOW ((os_real_t)0x1.7f7d1cp-20)
#define OS_EXPONENTIAL_OVERFLOWS ((os_real_t)89.0)
#define OS_EXPONENTIAL_VANISHES ((os_real_t)-104.0)
#define OS_ROOT_HALF_BITS ((os_bits_t)0x3F3504F3U)
#else
#define OS_ONE_OVER_LOG_2 ((os_real_t)0x1.71547652b82fep+0)
#define OS_LOG_2_HIGH ((os_real_t)0x1.62e42fefa38p-1)
#define OS_LOG_2_LOW ((os_real_t)0x1.ef35793c7673p-45)
#define OS_EXPONENTIAL_OVERFLOWS ((os_real_t)710.0)
#define OS_EXPONENTIAL_VANISHES ((os_real_t)-746.0)
#define OS_ROOT_HALF_BITS ((os_bits_t)0x3FE6A09E667F3BCDU)
#endif

/* (exp r - 1 - r) / r^2, |r| up to half of log 2. */
static inline os_real_t os_exponential_polynomial(os_real_t r)
{
#ifdef OS_REAL_IS_FLOAT
    os_real_t p = (((os_real_t)0x1.6db528p-10) * r) + ((os_real_t)0x1.123b94p-7);
    p = (p * r) + ((os_real_t)0x1.55545cp-5);
    p = (p * r) + ((os_real_t)0x1.55548ep-3);
    p = (p * r) + ((os_real_t)0x1p-1);
#else
    os_real_t p = (((os_real_t)0x1.1f9ddc94b0432p-29) * r) + ((os_real_t)0x1.af6d0323741bbp-26);
    p = (p * r) + ((os_real_t)0x1.27e4bf3efe0b9p-22);
    p = (p * r) + ((os_real_t)0x1.71ddef752119ep-19);
    p = (p * r) + ((os_real_t)0x1.a01a01b44d5bfp-16);
    p = (p * r) + ((os_real_t)0x1.a01a01b3c7338p-13);
    p = (p * r) + ((os_real_t)0x1.6c16c16c135abp-10);
    p = (p * r) + ((os_real_t)0x1.111111110eb94p-7);
    p = (p * r) + ((os_real_t)0x1.555555555555ep-5);
    p = (p * r) + ((os_real_t)0x1.555555555555cp-3);
    p = (p * r) + ((os_real_t)0x1p-1);
#endif
    return p;
}

/* (log((1 + s) / (1 - s)) / s - 2) / s^2 of z = s^2, |s| up to 3 - sqrt 8. */
static inline os_real_t os_logarithm_polynomial(os_real_t z)
{
#ifdef OS_REAL_IS_FLOAT
    os_real_t p = (((os_real_t)0x1.31e66ep-2) * z) + ((os_real_t)0x1.995e9cp-2);
    p = (p * z) + ((os_real_t)0x1.55557ap-1);
#else
    os_real_t p = (((os_real_t)0x1.2f0d8f548906fp-3) * z) + ((os_real_t)0x1.39a0f517122bdp-3);
    p = (p * z) + ((os_real_t)0x1.7466462a115aap-3);
    p = (p * z) + ((os_real_t)0x1.c71c51e80c67ep-3);
    p = (p * z) + ((os_real_t)0x1.24924942177b2p-2);
    p = (p * z) + ((os_real_t)0x1.999999997fb35p-2);
    p = (p * z) + ((os_real_t)0x1.5555555555593p-1);
#endif
    return p;
}

static inline os_real_t os_exp(os_real_t x)
{
    const os_real_t low = os_select(x < OS_EXPONENTIAL_VANISHES, os_constant(OS_EXPONENTIAL_VANISHES), x);
    const os_real_t a = os_select(x > OS_EXPONENTIAL_OVERFLOWS, os_constant(OS_EXPONENTIAL_OVERFLOWS), low);
    const os_real_t shifted = (a * OS_ONE_OVER_LOG_2) + OS_ROUNDING;
    const os_real_t n = shifted - OS_ROUNDING;
    const os_real_t high = a - (n * OS_LOG_2_HIGH);
    const os_real_t less = n * OS_LOG_2_LOW;
    const os_real_t r = high - less;
    const os_real_t lost = (high - r) - less;
    const os_real_t most = ((os_real_t)1.0) + r;
    const os_real_t more = r - (most - ((os_real_t)1.0));
    const os_real_t y = most + (more + (lost + ((r * r) * os_exponential_polynomial(r))));
    /* 2^n in two steps, so that only the last rounds, also where the result is denormal */
    const os_bits_t sum = (os_bits(shifted) - OS_ROUNDING_BITS) + (((os_bits_t)2U) * OS_BIAS);
    const os_bits_t one = sum >> 1U;
    const os_bits_t other = sum - one;
    return (y * os_from_bits(one << OS_FRACTION_BITS)) * os_from_bits(other << OS_FRACTION_BITS);
}

static inline os_real_t os_log(os_real_t x)
{
    const os_real_t zero = os_constant((os_real_t)0.0);
    const bool denormal = x < OS_REAL_MIN;
    const os_real_t normal = os_select(denormal, x * ((os_real_t)0x1p54), x);
    const os_real_t shift = os_select(denormal, os_constant((os_real_t)54.0), zero);
    /* x = 2^n m with m from sqrt(1/2) to sqrt 2 */
    const os_bits_t moved = (os_bits(normal) - OS_ROOT_HALF_BITS) + (OS_BIAS << OS_FRACTION_BITS);
    const os_real_t m = os_from_bits((moved & OS_FRACTION_MASK) + OS_ROOT_HALF_BITS);
    const os_bits_t biased = (moved >> OS_FRACTION_BITS) - OS_BIAS;
    const os_real_t n = (os_from_bits(biased + OS_ROUNDING_BITS) - OS_ROUNDING) - shift;
    const os_real_t f = m - ((os_real_t)1.0);
    const os_real_t s = f / (((os_real_t)2.0) + f);
    const os_real_t z = s * s;
    const os_real_t half = ((os_real_t)0.5) * (f * f);
    const os_real_t rest = (s * (half + (z * os_logarithm_polynomial(z)))) + (n * OS_LOG_2_LOW);
    const os_real_t finite = (n * OS_LOG_2_HIGH) - ((half - rest) - f);
    const os_real_t edge = os_select(x < zero, os_constant((os_real_t)NAN), -os_constant((os_real_t)INFINITY));
    const os_real_t inside = os_select(x <= zero, edge, finite);
    return os_select(x <= OS_REAL_MAX, inside, x);
}

#endif
