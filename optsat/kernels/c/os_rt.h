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

static inline bool os_all_finite(const os_real_t *x, int32_t n)
{
    bool finite = true;
    for (int32_t i = 0; i < n; ++i) {
        finite = finite && (os_fabs(x[i]) <= OS_REAL_MAX);
    }
    return finite;
}

#endif
