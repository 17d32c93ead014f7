/* os_rt.h: what every generated file stands on: the real type, the status, and the exact functions. */
#ifndef OS_RT_H
#define OS_RT_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math: NaN, signed zeros and the order of operations are part of the results"
#endif

#if defined(FLT_EVAL_METHOD) && (FLT_EVAL_METHOD != 0)
#error "compile for an arithmetic without excess digits, such as -mfpmath=sse: they would change the results"
#endif

#ifdef OS_REAL_IS_FLOAT
typedef float os_real_t;
#define OS_EPSILON FLT_EPSILON
#define OS_REAL_MAX FLT_MAX
#define OS_REAL_MIN FLT_MIN
#else
typedef double os_real_t;
#define OS_EPSILON DBL_EPSILON
#define OS_REAL_MAX DBL_MAX
#define OS_REAL_MIN DBL_MIN
#endif

/* The values are fixed for ever. */
typedef enum {
    OS_OK = 0,
    OS_E_NULL = 1,
    OS_E_NOT_FINITE = 2,
    OS_E_NOT_UNIT = 3,
    OS_E_RANGE = 4,
    OS_E_OUTPUT = 5,
    OS_E_NOT_CONVERGED = 6,
    OS_E_STATE = 7
} os_status_t;

/* Functions of the mathematical library: their last bits belong to the machine. */
#ifdef OS_REAL_IS_FLOAT
#define os_libm_exp expf
#define os_libm_log logf
#define os_libm_expm1 expm1f
#define os_libm_log1p log1pf
#define os_libm_erf erff
#define os_libm_sin sinf
#define os_libm_cos cosf
#define os_libm_tan tanf
#define os_libm_asin asinf
#define os_libm_acos acosf
#define os_libm_atan atanf
#define os_libm_sinh sinhf
#define os_libm_cosh coshf
#define os_libm_tanh tanhf
#define os_libm_asinh asinhf
#define os_libm_acosh acoshf
#define os_libm_atanh atanhf
#define os_libm_pow powf
#define os_libm_atan2 atan2f
#define os_libm_hypot hypotf
#define os_libm_fmod fmodf
#define os_libm_remainder remainderf
#else
#define os_libm_exp exp
#define os_libm_log log
#define os_libm_expm1 expm1
#define os_libm_log1p log1p
#define os_libm_erf erf
#define os_libm_sin sin
#define os_libm_cos cos
#define os_libm_tan tan
#define os_libm_asin asin
#define os_libm_acos acos
#define os_libm_atan atan
#define os_libm_sinh sinh
#define os_libm_cosh cosh
#define os_libm_tanh tanh
#define os_libm_asinh asinh
#define os_libm_acosh acosh
#define os_libm_atanh atanh
#define os_libm_pow pow
#define os_libm_atan2 atan2
#define os_libm_hypot hypot
#define os_libm_fmod fmod
#define os_libm_remainder remainder
#endif

static inline os_real_t os_sqrt(os_real_t a)
{
#ifdef OS_REAL_IS_FLOAT
    return sqrtf(a);
#else
    return sqrt(a);
#endif
}

static inline os_real_t os_fabs(os_real_t a)
{
#ifdef OS_REAL_IS_FLOAT
    return fabsf(a);
#else
    return fabs(a);
#endif
}

/* A NaN loses, a tie returns the first operand. */
static inline os_real_t os_fmax(os_real_t a, os_real_t b)
{
    return (isnan(b) || (a >= b)) ? a : b;
}

static inline os_real_t os_fmin(os_real_t a, os_real_t b)
{
    return (isnan(b) || (a <= b)) ? a : b;
}

static inline os_real_t os_floor(os_real_t a)
{
#ifdef OS_REAL_IS_FLOAT
    return floorf(a);
#else
    return floor(a);
#endif
}

static inline os_real_t os_ceil(os_real_t a)
{
#ifdef OS_REAL_IS_FLOAT
    return ceilf(a);
#else
    return ceil(a);
#endif
}

/* The sign of a NaN differs between machines, so none is taken of it. */
static inline os_real_t os_copysign(os_real_t a, os_real_t b)
{
#ifdef OS_REAL_IS_FLOAT
    return isnan(b) ? fabsf(a) : copysignf(a, b);
#else
    return isnan(b) ? fabs(a) : copysign(a, b);
#endif
}

/* 1, -1, or the argument itself where it is NaN, +0 or -0. */
static inline os_real_t os_sign(os_real_t a)
{
    return (a > (os_real_t)0.0) ? (os_real_t)1.0 : ((a < (os_real_t)0.0) ? (os_real_t)-1.0 : a);
}

/* a == b, which compilers warn of. */
static inline bool os_equal(os_real_t a, os_real_t b)
{
    return (a <= b) && (a >= b);
}

/* Anything but +0 and -0 is true, NaN too. */
static inline bool os_truth(os_real_t a)
{
    return !((a <= (os_real_t)0.0) && (a >= (os_real_t)0.0));
}

static inline bool os_all_finite(const os_real_t *x, int32_t n)
{
    int32_t bad = 0;
    for (int32_t i = 0; i < n; ++i) {
        bad += (os_fabs(x[i]) <= OS_REAL_MAX) ? 0 : 1;
    }
    return bad == 0;
}

#endif
