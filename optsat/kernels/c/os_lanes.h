/* os_lanes.h: OS_WIDTH samples at once, in the vector extensions of gcc and clang. Each function gives every sample the
   bits that its form for one sample in os_rt.h and os_bits.h gives. */
#ifndef OS_LANES_H
#define OS_LANES_H

#include "os_angle.h"

/* how wide vectors are passed differs between machines; all functions here are inlined, so none is */
#pragma GCC diagnostic ignored "-Wpsabi"

/* gcc keeps short loops below -O3, and vectors that are indexed in a loop in memory */
#if defined(__clang__)
#define OS_UNROLLED
#else
#define OS_UNROLLED _Pragma("GCC unroll 16")
#endif

#define OS_LANE static inline __attribute__((always_inline, unused))
#define OS_LANES_BYTES (OS_WIDTH * sizeof(os_real_t))

typedef os_real_t os_lanes_real_t __attribute__((vector_size(OS_LANES_BYTES)));
typedef os_bits_t os_lanes_bits_t __attribute__((vector_size(OS_LANES_BYTES)));
/* at any address of a number */
typedef os_real_t os_lanes_stored_t __attribute__((vector_size(OS_LANES_BYTES), aligned(sizeof(os_real_t)), may_alias));
/* all bits set where true */
#ifdef OS_REAL_IS_FLOAT
typedef int32_t os_lanes_bool_t __attribute__((vector_size(OS_LANES_BYTES)));
#else
typedef int64_t os_lanes_bool_t __attribute__((vector_size(OS_LANES_BYTES)));
#endif

typedef struct {
    os_lanes_bits_t quarters;
    os_lanes_real_t high;
    os_lanes_real_t low;
} os_lanes_angle_t;

/* element by element: the sum of a number and a vector of zeros would lose the sign of -0 */
OS_LANE os_lanes_real_t os_lanes_constant(os_real_t a)
{
    os_lanes_real_t r;
    OS_UNROLLED
    for (int k = 0; k < OS_WIDTH; ++k) {
        r[k] = a;
    }
    return r;
}

OS_LANE os_lanes_bits_t os_lanes_bits(os_lanes_real_t a)
{
    return (os_lanes_bits_t)a;
}

OS_LANE os_lanes_real_t os_lanes_from_bits(os_lanes_bits_t a)
{
    return (os_lanes_real_t)a;
}

OS_LANE os_lanes_real_t os_lanes_select(os_lanes_bool_t p, os_lanes_real_t a, os_lanes_real_t b)
{
    return (os_lanes_real_t)(((os_lanes_bool_t)a & p) | ((os_lanes_bool_t)b & ~p));
}

OS_LANE os_lanes_real_t os_lanes_or_zero(os_lanes_bool_t p, os_lanes_real_t a)
{
    return (os_lanes_real_t)((os_lanes_bool_t)a & p);
}

OS_LANE os_lanes_bool_t os_lanes_not(os_lanes_bool_t p)
{
    return ~p;
}

OS_LANE os_lanes_bool_t os_lanes_both(os_lanes_bool_t p, os_lanes_bool_t q)
{
    return p & q;
}

OS_LANE os_lanes_bool_t os_lanes_either(os_lanes_bool_t p, os_lanes_bool_t q)
{
    return p | q;
}

OS_LANE bool os_lanes_any(os_lanes_bool_t p)
{
    os_bits_t found = 0U;
    OS_UNROLLED
    for (int k = 0; k < OS_WIDTH; ++k) {
        found |= (os_bits_t)p[k];
    }
    return found != 0U;
}

OS_LANE os_lanes_bool_t os_lanes_is_nan(os_lanes_real_t a)
{
    return (os_lanes_bool_t)(a != a);
}

OS_LANE os_lanes_bool_t os_lanes_truth(os_lanes_real_t a)
{
    return (os_lanes_bool_t)(a != os_lanes_constant((os_real_t)0.0));
}

OS_LANE os_lanes_bool_t os_lanes_equal(os_lanes_real_t a, os_lanes_real_t b)
{
    return (os_lanes_bool_t)(a == b);
}

OS_LANE os_lanes_bits_t os_lanes_sign_bit(os_lanes_real_t a)
{
    return ((os_lanes_bits_t)a >> OS_SIGN_BIT) << OS_SIGN_BIT;
}

OS_LANE os_lanes_real_t os_lanes_fabs(os_lanes_real_t a)
{
    return (os_lanes_real_t)((os_lanes_bits_t)a ^ os_lanes_sign_bit(a));
}

OS_LANE os_lanes_real_t os_lanes_copysign(os_lanes_real_t a, os_lanes_real_t b)
{
    const os_lanes_bits_t sign = os_lanes_sign_bit(b) & ~(os_lanes_bits_t)os_lanes_is_nan(b);
    return (os_lanes_real_t)((os_lanes_bits_t)os_lanes_fabs(a) | sign);
}

OS_LANE os_lanes_real_t os_lanes_sign(os_lanes_real_t a)
{
    const os_lanes_real_t zero = os_lanes_constant((os_real_t)0.0);
    const os_lanes_real_t one = os_lanes_constant((os_real_t)1.0);
    const os_lanes_real_t negative = os_lanes_select((os_lanes_bool_t)(a < zero), -one, a);
    return os_lanes_select((os_lanes_bool_t)(a > zero), one, negative);
}

OS_LANE os_lanes_real_t os_lanes_fmax(os_lanes_real_t a, os_lanes_real_t b)
{
    return os_lanes_select(os_lanes_is_nan(b) | (os_lanes_bool_t)(a >= b), a, b);
}

OS_LANE os_lanes_real_t os_lanes_fmin(os_lanes_real_t a, os_lanes_real_t b)
{
    return os_lanes_select(os_lanes_is_nan(b) | (os_lanes_bool_t)(a <= b), a, b);
}

/* One number of OS_WIDTH samples from the first on, `stride` apart; past the last one, that of the last. */
OS_LANE os_lanes_real_t os_lanes_gathered(const os_real_t *in, int64_t first, int64_t last, int64_t stride)
{
    os_lanes_real_t r;
    OS_UNROLLED
    for (int32_t w = 0; w < OS_WIDTH; ++w) {
        r[w] = in[(((first + w) < last) ? (first + w) : last) * stride];
    }
    return r;
}

/* The same where all samples are there. */
OS_LANE os_lanes_real_t os_lanes_gathered_whole(const os_real_t *in, int64_t first, int64_t stride)
{
    os_lanes_real_t r;
    OS_UNROLLED
    for (int32_t w = 0; w < OS_WIDTH; ++w) {
        r[w] = in[(first + w) * stride];
    }
    return r;
}

/* A function of one sample for each in turn; compilers make single instructions of the exact ones. */
#define OS_EACH_OF_ONE(name, function)                                              \
    OS_LANE os_lanes_real_t os_lanes_##name(os_lanes_real_t a)                      \
    {                                                                               \
        os_lanes_real_t r;                                                          \
        OS_UNROLLED                                                                 \
        for (int k = 0; k < OS_WIDTH; ++k) {                                        \
            r[k] = function(a[k]);                                                  \
        }                                                                           \
        return r;                                                                   \
    }
#define OS_EACH_OF_TWO(name, function)                                              \
    OS_LANE os_lanes_real_t os_lanes_##name(os_lanes_real_t a, os_lanes_real_t b)   \
    {                                                                               \
        os_lanes_real_t r;                                                          \
        OS_UNROLLED                                                                 \
        for (int k = 0; k < OS_WIDTH; ++k) {                                        \
            r[k] = function(a[k], b[k]);                                            \
        }                                                                           \
        return r;                                                                   \
    }

OS_EACH_OF_ONE(sqrt, os_sqrt)
OS_EACH_OF_ONE(floor, os_floor)
OS_EACH_OF_ONE(ceil, os_ceil)
OS_EACH_OF_ONE(libm_exp, os_libm_exp)
OS_EACH_OF_ONE(libm_log, os_libm_log)
OS_EACH_OF_ONE(libm_expm1, os_libm_expm1)
OS_EACH_OF_ONE(libm_log1p, os_libm_log1p)
OS_EACH_OF_ONE(libm_erf, os_libm_erf)
OS_EACH_OF_ONE(libm_sin, os_libm_sin)
OS_EACH_OF_ONE(libm_cos, os_libm_cos)
OS_EACH_OF_ONE(libm_tan, os_libm_tan)
OS_EACH_OF_ONE(libm_asin, os_libm_asin)
OS_EACH_OF_ONE(libm_acos, os_libm_acos)
OS_EACH_OF_ONE(libm_atan, os_libm_atan)
OS_EACH_OF_ONE(libm_sinh, os_libm_sinh)
OS_EACH_OF_ONE(libm_cosh, os_libm_cosh)
OS_EACH_OF_ONE(libm_tanh, os_libm_tanh)
OS_EACH_OF_ONE(libm_asinh, os_libm_asinh)
OS_EACH_OF_ONE(libm_acosh, os_libm_acosh)
OS_EACH_OF_ONE(libm_atanh, os_libm_atanh)
OS_EACH_OF_TWO(libm_pow, os_libm_pow)
OS_EACH_OF_TWO(libm_atan2, os_libm_atan2)
OS_EACH_OF_TWO(libm_hypot, os_libm_hypot)
OS_EACH_OF_TWO(libm_fmod, os_libm_fmod)
OS_EACH_OF_TWO(libm_remainder, os_libm_remainder)

OS_LANE os_lanes_angle_t os_lanes_reduced_where(os_lanes_bool_t large, os_lanes_real_t x, os_lanes_angle_t found)
{
    OS_UNROLLED
    for (int k = 0; k < OS_WIDTH; ++k) {
        if (large[k] != 0) {
            const os_angle_t angle = os_reduced_exactly(x[k]);
            found.quarters[k] = angle.quarters;
            found.high[k] = angle.high;
            found.low[k] = angle.low;
        }
    }
    return found;
}

#endif
