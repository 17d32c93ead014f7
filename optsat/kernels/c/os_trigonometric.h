/* os_trigonometric.h: sine and cosine together, the same bits on every machine, error below 1 unit in the last
   place. */
#ifndef OS_TRIGONOMETRIC_H
#define OS_TRIGONOMETRIC_H

#include "os_angle.h"

#define OS_TWO_OVER_PI ((os_real_t)0x1.45f306dc9c883p-1)
/* pi / 2 as a sum; the number of quarter turns times each of the first three is exact. */
#ifdef OS_REAL_IS_FLOAT
#define OS_LARGEST_REDUCED ((os_real_t)800.0)
#define OS_HALF_PI_1 ((os_real_t)0x1.921cp+0)
#define OS_HALF_PI_2 ((os_real_t)0x1.daap-15)
#define OS_HALF_PI_3 ((os_real_t)0x1.10b4p-30)
#define OS_HALF_PI_4 ((os_real_t)0x1.84698ap-48)
#else
#define OS_LARGEST_REDUCED ((os_real_t)1e5)
#define OS_HALF_PI_1 ((os_real_t)0x1.921fb5444p+0)
#define OS_HALF_PI_2 ((os_real_t)0x1.68c234c4cp-39)
#define OS_HALF_PI_3 ((os_real_t)0x1.98a2e037p-77)
#define OS_HALF_PI_4 ((os_real_t)0x1.cd129024e088ap-115)
#endif

typedef struct {
    os_real_t sine;
    os_real_t cosine;
} os_sine_cosine_t;

/* Less whole quarter turns, for |x| up to OS_LARGEST_REDUCED (Cody and Waite, with what each difference loses). */
static inline os_angle_t os_reduced(os_real_t x)
{
    const os_real_t shifted = (x * OS_TWO_OVER_PI) + OS_ROUNDING;
    const os_real_t n = shifted - OS_ROUNDING;
    const os_real_t a = x - (n * OS_HALF_PI_1);
    const os_real_t u = n * OS_HALF_PI_2;
    const os_real_t b = a - u;
    const os_real_t b_part = b - a;
    const os_real_t b_lost = (a - (b - b_part)) - (u + b_part);
    const os_real_t v = n * OS_HALF_PI_3;
    const os_real_t c = b - v;
    const os_real_t c_part = c - b;
    const os_real_t c_lost = (b - (c - c_part)) - (v + c_part);
    const os_real_t rest = (b_lost + c_lost) - (n * OS_HALF_PI_4);
    os_angle_t angle;
    angle.quarters = os_bits(shifted);
    angle.high = c + rest;
    angle.low = rest - (angle.high - c);
    return angle;
}

/* (sin r - r) / r^3 of z = r^2, |r| up to pi / 4. */
static inline os_real_t os_sine_polynomial(os_real_t z)
{
#ifdef OS_REAL_IS_FLOAT
    os_real_t p = (((os_real_t)-0x1.994cfap-13) * z) + ((os_real_t)0x1.11075cp-7);
    p = (p * z) + ((os_real_t)-0x1.555546p-3);
#else
    os_real_t p = (((os_real_t)0x1.5d92462c77cbcp-33) * z) + ((os_real_t)-0x1.ae5e63cbcac75p-26);
    p = (p * z) + ((os_real_t)0x1.71de3574b8f8fp-19);
    p = (p * z) + ((os_real_t)-0x1.a01a019c0e4c2p-13);
    p = (p * z) + ((os_real_t)0x1.111111110f861p-7);
    p = (p * z) + ((os_real_t)-0x1.5555555555549p-3);
#endif
    return p;
}

/* (cos r - 1 + r^2 / 2) / r^4 of z = r^2, |r| up to pi / 4. */
static inline os_real_t os_cosine_polynomial(os_real_t z)
{
#ifdef OS_REAL_IS_FLOAT
    os_real_t p = (((os_real_t)0x1.99ea06p-16) * z) + ((os_real_t)-0x1.6c0c2ep-10);
    p = (p * z) + ((os_real_t)0x1.55554ap-5);
#else
    os_real_t p = (((os_real_t)-0x1.8fa3979dd317cp-37) * z) + ((os_real_t)0x1.1ee9d5cdbea96p-29);
    p = (p * z) + ((os_real_t)-0x1.27e4f7e80a429p-22);
    p = (p * z) + ((os_real_t)0x1.a01a019c80a29p-16);
    p = (p * z) + ((os_real_t)-0x1.6c16c16c14f6dp-10);
    p = (p * z) + ((os_real_t)0x1.555555555554bp-5);
#endif
    return p;
}

static inline os_sine_cosine_t os_sine_cosine(os_real_t x)
{
    os_angle_t angle = os_reduced(x);
    const os_real_t size = os_fabs(x);
    const bool large = os_not(size <= OS_LARGEST_REDUCED);
    if (os_any(large)) {
        angle = os_reduced_where(large, x, angle);
    }
    const os_real_t r = angle.high;
    const os_real_t z = r * r;
    const os_real_t half = z * ((os_real_t)0.5);
    const os_real_t cube = z * r;
    const os_real_t sine = r + ((cube * os_sine_polynomial(z)) + (angle.low * (((os_real_t)1.0) - half)));
    const os_real_t most = ((os_real_t)1.0) - half;
    const os_real_t lost = (((os_real_t)1.0) - most) - half;
    const os_real_t cosine = most + (lost + (((z * z) * os_cosine_polynomial(z)) - (r * angle.low)));
    const bool odd = (angle.quarters & ((os_bits_t)1U)) != ((os_bits_t)0U);
    const os_bits_t sine_sign = (angle.quarters & ((os_bits_t)2U)) << (OS_SIGN_BIT - 1U);
    const os_bits_t cosine_sign = ((angle.quarters + ((os_bits_t)1U)) & ((os_bits_t)2U)) << (OS_SIGN_BIT - 1U);
    os_sine_cosine_t found;
    const os_real_t signed_sine = os_from_bits(os_bits(os_select(odd, cosine, sine)) ^ sine_sign);
    found.sine = os_select(size <= ((os_real_t)0.0), x, signed_sine);
    found.cosine = os_from_bits(os_bits(os_select(odd, sine, cosine)) ^ cosine_sign);
    return found;
}

#endif
