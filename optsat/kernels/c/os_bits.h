/* os_bits.h: the bits of a real number, and choices without a branch. Functions of one sample that are written with
   these have a form for several samples at once, made of the same text. */
#ifndef OS_BITS_H
#define OS_BITS_H

#include "os_rt.h"

#ifdef OS_REAL_IS_FLOAT
typedef uint32_t os_bits_t;
#define OS_FRACTION_BITS 23U
#define OS_SIGN_BIT 31U
#define OS_BIAS ((os_bits_t)127U)
/* Added to a number, it rounds it to a whole one; the last bits of the sum are that number. */
#define OS_ROUNDING ((os_real_t)0x1.8p23)
#define OS_ROUNDING_BITS ((os_bits_t)0x4B400000U)
#define OS_FRACTION_MASK ((os_bits_t)0x007FFFFFU)
/* Keeps so many leading bits that a product of two such numbers is exact. */
#define OS_HALF_MASK ((os_bits_t)0xFFFFF000U)
#else
typedef uint64_t os_bits_t;
#define OS_FRACTION_BITS 52U
#define OS_SIGN_BIT 63U
#define OS_BIAS ((os_bits_t)1023U)
#define OS_ROUNDING ((os_real_t)0x1.8p52)
#define OS_ROUNDING_BITS ((os_bits_t)0x4338000000000000U)
#define OS_FRACTION_MASK ((os_bits_t)0x000FFFFFFFFFFFFFU)
#define OS_HALF_MASK ((os_bits_t)0xFFFFFFFFF8000000U)
#endif

typedef union {
    os_real_t real;
    os_bits_t bits;
} os_real_bits_t;

static inline os_bits_t os_bits(os_real_t a)
{
    os_real_bits_t both;
    both.real = a;
    return both.bits;
}

static inline os_real_t os_from_bits(os_bits_t bits)
{
    os_real_bits_t both;
    both.bits = bits;
    return both.real;
}

static inline os_real_t os_select(bool p, os_real_t a, os_real_t b)
{
    return p ? a : b;
}

static inline bool os_not(bool p)
{
    return !p;
}

static inline bool os_both(bool p, bool q)
{
    return p && q;
}

static inline bool os_either(bool p, bool q)
{
    return p || q;
}

/* Whether it is true of one sample at least. */
static inline bool os_any(bool p)
{
    return p;
}

static inline bool os_is_nan(os_real_t a)
{
    return isnan(a);
}

/* A constant, as many times as there are samples. */
static inline os_real_t os_constant(os_real_t a)
{
    return a;
}

#endif
