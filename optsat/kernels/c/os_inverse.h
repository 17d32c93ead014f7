/* os_inverse.h: the angles of given sine, cosine and tangent, the same bits on every machine, error below 1 unit in the
   last place. */
#ifndef OS_INVERSE_H
#define OS_INVERSE_H

#include "os_bits.h"

#ifdef OS_REAL_IS_FLOAT
#define OS_ATAN_HALF_HIGH ((os_real_t)0x1.dac67p-2)
#define OS_ATAN_HALF_LOW ((os_real_t)0x1.586ed4p-28)
#define OS_PI_HIGH ((os_real_t)0x1.921fb6p+1)
#define OS_PI_LOW ((os_real_t)-0x1.777a5cp-24)
#define OS_SMALL_SIDE ((os_real_t)0x1p-60)
#define OS_LARGE_SIDE ((os_real_t)0x1p120)
#define OS_ENLARGE ((os_real_t)0x1p100)
#define OS_REDUCE ((os_real_t)0x1p-20)
#else
#define OS_ATAN_HALF_HIGH ((os_real_t)0x1.dac670561bb4fp-2)
#define OS_ATAN_HALF_LOW ((os_real_t)0x1.a2b7f222f65e2p-56)
#define OS_PI_HIGH ((os_real_t)0x1.921fb54442d18p+1)
#define OS_PI_LOW ((os_real_t)0x1.1a62633145c07p-53)
#define OS_SMALL_SIDE ((os_real_t)0x1p-500)
#define OS_LARGE_SIDE ((os_real_t)0x1p1000)
#define OS_ENLARGE ((os_real_t)0x1p560)
#define OS_REDUCE ((os_real_t)0x1p-100)
#endif

/* (atan a - a) / a^3 of z = a^2, |a| up to 7/16. */
static inline os_real_t os_arctangent_polynomial(os_real_t z)
{
#ifdef OS_REAL_IS_FLOAT
    os_real_t p = (((os_real_t)-0x1.dd1cdcp-5) * z) + ((os_real_t)0x1.adcd4p-4);
    p = (p * z) + ((os_real_t)-0x1.236e1p-3);
    p = (p * z) + ((os_real_t)0x1.998dep-3);
    p = (p * z) + ((os_real_t)-0x1.555542p-2);
#else
    os_real_t p = (((os_real_t)0x1.c0b1f8cebbebdp-7) * z) + ((os_real_t)-0x1.057685df103ccp-5);
    p = (p * z) + ((os_real_t)0x1.6b2726b812a0bp-5);
    p = (p * z) + ((os_real_t)-0x1.a9fe0652aafap-5);
    p = (p * z) + ((os_real_t)0x1.e13319751bb03p-5);
    p = (p * z) + ((os_real_t)-0x1.11090ded886bfp-4);
    p = (p * z) + ((os_real_t)0x1.3b132ff40f38ap-4);
    p = (p * z) + ((os_real_t)-0x1.745d11d03d0f2p-4);
    p = (p * z) + ((os_real_t)0x1.c71c71a16b0b3p-4);
    p = (p * z) + ((os_real_t)-0x1.2492492445df5p-3);
    p = (p * z) + ((os_real_t)0x1.9999999998fep-3);
    p = (p * z) + ((os_real_t)-0x1.5555555555552p-2);
#endif
    return p;
}

/* (asin a - a) / a^3 of z = a^2, |a| up to 1/2. */
static inline os_real_t os_arcsine_polynomial(os_real_t z)
{
#ifdef OS_REAL_IS_FLOAT
    os_real_t p = (((os_real_t)0x1.33bb5p-5) * z) + ((os_real_t)0x1.d7f3b2p-7);
    p = (p * z) + ((os_real_t)0x1.04a63cp-5);
    p = (p * z) + ((os_real_t)0x1.6cac4p-5);
    p = (p * z) + ((os_real_t)0x1.33388ep-4);
    p = (p * z) + ((os_real_t)0x1.55554cp-3);
#else
    os_real_t p = (((os_real_t)0x1.0bb05ae4fa31ep-5) * z) + ((os_real_t)-0x1.59546dea6bfb7p-6);
    p = (p * z) + ((os_real_t)0x1.6492a42f7a9a8p-6);
    p = (p * z) + ((os_real_t)0x1.e2bea79a9d69cp-9);
    p = (p * z) + ((os_real_t)0x1.6173f25398f57p-7);
    p = (p * z) + ((os_real_t)0x1.757b7a5d51c54p-7);
    p = (p * z) + ((os_real_t)0x1.ca20cdfd8d3e9p-7);
    p = (p * z) + ((os_real_t)0x1.1c49e2bcd11abp-6);
    p = (p * z) + ((os_real_t)0x1.6e8bdfa64b849p-6);
    p = (p * z) + ((os_real_t)0x1.f1c71a8dc559ep-6);
    p = (p * z) + ((os_real_t)0x1.6db6db722602cp-5);
    p = (p * z) + ((os_real_t)0x1.333333332df8p-4);
    p = (p * z) + ((os_real_t)0x1.5555555555578p-3);
#endif
    return p;
}

/* num - den * ratio, where ratio is num / den rounded. */
static inline os_real_t os_remainder_of_division(os_real_t num, os_real_t den, os_real_t ratio)
{
    const os_real_t d = os_from_bits(os_bits(den) & OS_HALF_MASK);
    const os_real_t d_rest = den - d;
    const os_real_t q = os_from_bits(os_bits(ratio) & OS_HALF_MASK);
    const os_real_t q_rest = ratio - q;
    return (((num - (q * d)) - (q * d_rest)) - (q_rest * d)) - (q_rest * d_rest);
}

/* Angle of the point (x, y) from the x axis. */
static inline os_real_t os_atan2(os_real_t y, os_real_t x)
{
    const os_real_t zero = os_constant((os_real_t)0.0);
    const os_real_t half = os_constant((os_real_t)0.5);
    const os_real_t one = os_constant((os_real_t)1.0);
    const os_real_t y_size = os_fabs(y);
    const os_real_t x_size = os_fabs(x);
    const bool steep = y_size > x_size;
    os_real_t large = os_select(steep, y_size, x_size);
    os_real_t small = os_select(steep, x_size, y_size);
    /* of two infinite sides, or of two zeros, the ratio is that of 1 to 1, or of 0 to 1 */
    const bool infinite = large > OS_REAL_MAX;
    const os_real_t unit = os_select(small > OS_REAL_MAX, one, zero);
    small = os_select(infinite, unit, small);
    large = os_select(os_either(infinite, large <= ((os_real_t)0.0)), one, large);
    const os_real_t reduced = os_select(large > OS_LARGE_SIDE, os_constant(OS_REDUCE), one);
    const os_real_t scale = os_select(large < OS_SMALL_SIDE, os_constant(OS_ENLARGE), reduced);
    large = large * scale;
    small = small * scale;
    /* atan(small / large) = atan c + atan((small - c large) / (large + c small)) with c = 0, 1/2 or 1 */
    const bool direct = small < (((os_real_t)0.4375) * large);
    const bool near_one = small > (((os_real_t)0.6875) * large);
    const os_real_t c = os_select(direct, zero, os_select(near_one, one, half));
    const os_real_t num = small - (c * large);
    const os_real_t den = large + (c * small);
    const os_real_t a = num / den;
    const os_real_t exact = os_remainder_of_division(num, den, a) / den;
    /* where the ratio is tiny its last bit is right anyway, and the products may have been denormal */
    const os_real_t lost = os_select(small > (((os_real_t)0x1p-30) * large), exact, zero);
    const os_real_t z = a * a;
    const os_real_t rest = ((z * a) * os_arctangent_polynomial(z)) + lost;
    /* the whole: 0, pi / 2 or pi, plus or minus atan c and what was found */
    const bool left = (os_bits(x) >> OS_SIGN_BIT) != ((os_bits_t)0U);
    const bool minus = os_either(os_both(steep, os_not(left)), os_both(left, os_not(steep)));
    const os_real_t c_high = os_select(direct, zero,
        os_select(near_one, os_constant(((os_real_t)0.25) * OS_PI_HIGH), os_constant(OS_ATAN_HALF_HIGH)));
    const os_real_t c_low = os_select(direct, zero,
        os_select(near_one, os_constant(((os_real_t)0.25) * OS_PI_LOW), os_constant(OS_ATAN_HALF_LOW)));
    const os_real_t turn = os_select(steep, half, os_select(left, one, zero));
    const os_real_t sign = os_select(minus, -one, one);
    const os_real_t base = turn * OS_PI_HIGH;
    const os_real_t signed_c = sign * c_high;
    const os_real_t start = base + signed_c;
    const os_real_t start_low = (signed_c - (start - base)) + ((turn * OS_PI_LOW) + (sign * c_low));
    const os_real_t signed_a = sign * a;
    const os_real_t sum = start + signed_a;
    const os_real_t sum_low = signed_a - (sum - start);
    const os_real_t angle = sum + (sum_low + (start_low + (sign * rest)));
    const os_bits_t y_sign = (os_bits(y) >> OS_SIGN_BIT) << OS_SIGN_BIT;
    const os_real_t found = os_from_bits(os_bits(angle) | y_sign);
    return os_select(os_either(os_is_nan(x), os_is_nan(y)), x + y, found);
}

static inline os_real_t os_atan(os_real_t x)
{
    return os_atan2(x, os_constant((os_real_t)1.0));
}

/* asin s = root + (root_low + rest), where s is a size up to 1/2, or else the half-angle root of (1 - size) / 2. */
typedef struct {
    os_real_t root;
    os_real_t root_low;
    os_real_t rest;
} os_arc_t;

static inline os_arc_t os_arc(os_real_t size, bool large)
{
    const os_real_t half = ((os_real_t)0.5) * (((os_real_t)1.0) - size);
    const os_real_t z = os_select(large, half, size * size);
    const os_real_t s = os_select(large, os_sqrt(half), size);
    const os_real_t f = os_from_bits(os_bits(s) & OS_HALF_MASK);
    const os_real_t lost = (half - (f * f)) / ((s + f) + OS_REAL_MIN);
    os_arc_t arc;
    arc.root = os_select(large, f, size);
    arc.root_low = os_select(large, lost, os_constant((os_real_t)0.0));
    arc.rest = (s * z) * os_arcsine_polynomial(z);
    return arc;
}

static inline os_real_t os_asin(os_real_t x)
{
    const os_real_t size = os_fabs(x);
    const bool large = os_not(size < ((os_real_t)0.5));
    const os_arc_t arc = os_arc(size, large);
    const os_real_t twice = ((os_real_t)2.0) * arc.root;
    const os_real_t quarter = os_constant(((os_real_t)0.5) * OS_PI_HIGH);
    const os_real_t most = quarter - twice;
    const os_real_t more = (quarter - most) - twice;
    const os_real_t less = (((os_real_t)0.5) * OS_PI_LOW) - (((os_real_t)2.0) * (arc.root_low + arc.rest));
    const os_real_t angle = os_select(large, most + (more + less), size + arc.rest);
    const os_bits_t sign = (os_bits(x) >> OS_SIGN_BIT) << OS_SIGN_BIT;
    return os_from_bits(os_bits(angle) | sign);
}

static inline os_real_t os_acos(os_real_t x)
{
    const os_real_t size = os_fabs(x);
    const bool large = os_not(size < ((os_real_t)0.5));
    const bool negative = x < ((os_real_t)0.0);
    const os_arc_t arc = os_arc(size, large);
    const os_real_t rest = arc.root_low + arc.rest;
    /* 2 arc, pi - 2 arc, or pi / 2 - arc with the sign of x */
    const os_real_t one = os_constant((os_real_t)1.0);
    const os_real_t large_turn = os_select(negative, one, os_constant((os_real_t)0.0));
    const os_real_t turn = os_select(large, large_turn, os_constant((os_real_t)0.5));
    const os_real_t large_factor = os_select(negative, os_constant((os_real_t)-2.0), os_constant((os_real_t)2.0));
    const os_real_t factor = os_select(large, large_factor, os_select(negative, one, -one));
    const os_real_t base = turn * OS_PI_HIGH;
    const os_real_t part = factor * arc.root;
    const os_real_t most = base + part;
    const os_real_t more = part - (most - base);
    return most + (more + ((turn * OS_PI_LOW) + (factor * rest)));
}

#endif
