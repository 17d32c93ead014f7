/* os_angle.h: what is left of an angle of any size after quarter turns, by whole-number arithmetic (Payne and Hanek,
   1983). For the few angles that are too large for the reduction in os_trigonometric.h. */
#ifndef OS_ANGLE_H
#define OS_ANGLE_H

#include "os_bits.h"

#define OS_HALF_PI_HIGH ((os_real_t)0x1.921fb54442d18p+0)
#ifdef OS_REAL_IS_FLOAT
#define OS_HALF_PI_LOW ((os_real_t)-0x1.777a5cp-25)
#define OS_ANGLE_WORDS 6
#define OS_LARGEST_EXPONENT 254
#else
#define OS_HALF_PI_LOW ((os_real_t)0x1.1a62633145c07p-54)
#define OS_ANGLE_WORDS 9
#define OS_LARGEST_EXPONENT 2046
#endif

#if defined(__GNUC__)
#define OS_SELDOM __attribute__((noinline, cold, unused))
#else
#define OS_SELDOM
#endif

/* An angle less whole quarter turns: at most an eighth of a turn, as the sum of two numbers. */
typedef struct {
    os_bits_t quarters;
    os_real_t high;
    os_real_t low;
} os_angle_t;

/* The first bits of 2 / pi behind the point, 32 to a word. */
static inline uint32_t os_word_of_two_over_pi(int32_t i)
{
#ifdef OS_REAL_IS_FLOAT
    static const uint32_t words[8] = {
        0xA2F9836EU, 0x4E441529U, 0xFC2757D1U, 0xF534DDC0U, 0xDB629599U, 0x3C439041U, 0xFE5163ABU, 0xDEBBC561U
    };
#else
    static const uint32_t words[39] = {
        0xA2F9836EU, 0x4E441529U, 0xFC2757D1U, 0xF534DDC0U, 0xDB629599U, 0x3C439041U, 0xFE5163ABU, 0xDEBBC561U,
        0xB7246E3AU, 0x424DD2E0U, 0x06492EEAU, 0x09D1921CU, 0xFE1DEB1CU, 0xB129A73EU, 0xE88235F5U, 0x2EBB4484U,
        0xE99C7026U, 0xB45F7E41U, 0x3991D639U, 0x835339F4U, 0x9C845F8BU, 0xBDF9283BU, 0x1FF897FFU, 0xDE05980FU,
        0xEF2F118BU, 0x5A0A6D1FU, 0x6D367ECFU, 0x27CB09B7U, 0x4F463F66U, 0x9E5FEA2DU, 0x7527BAC7U, 0xEBE5F17BU,
        0x3D0739F7U, 0x8A5292EAU, 0x6BFB5FB1U, 0x1F8D5D08U, 0x56033046U, 0xFC7B6BABU, 0xF0CFBC20U
    };
#endif
    return words[i];
}

/* The fraction 0.d1 d2 ... in words from the last to the first, times pi / 2, as the sum of two numbers. */
static inline os_angle_t os_quarter_turns_to_angle(const uint32_t *words, int32_t n)
{
    const os_real_t digit = (os_real_t)0x1p-16;
    os_real_t high = (os_real_t)0.0;
    os_real_t low = (os_real_t)0.0;
    for (int32_t k = 0; k < (2 * (OS_ANGLE_WORDS + 2)); ++k) {
        if (k < (2 * n)) {
            const uint32_t word = words[k / 2];
            const uint32_t half = ((k % 2) == 0) ? (word & 0xFFFFU) : (word >> 16);
            const os_real_t next = (os_real_t)half;
            const os_real_t sum = next + high;
            low = (low + (high - (sum - next))) * digit;
            high = sum * digit;
        }
    }
    const os_real_t head = os_from_bits(os_bits(high) & OS_HALF_MASK);
    const os_real_t tail = high - head;
    const os_real_t pi_head = os_from_bits(os_bits(OS_HALF_PI_HIGH) & OS_HALF_MASK);
    const os_real_t pi_tail = OS_HALF_PI_HIGH - pi_head;
    const os_real_t product = high * OS_HALF_PI_HIGH;
    const os_real_t rest = (((head * pi_head) - product) + ((head * pi_tail) + (tail * pi_head))) + (tail * pi_tail);
    const os_real_t more = rest + ((high * OS_HALF_PI_LOW) + (low * OS_HALF_PI_HIGH));
    os_angle_t angle;
    angle.quarters = 0U;
    angle.high = product + more;
    angle.low = more - (angle.high - product);
    return angle;
}

/* Of any finite x of at least 1/4; NaN of the others. */
static OS_SELDOM os_angle_t os_reduced_exactly(os_real_t x)
{
    const os_bits_t bits = os_bits(x);
    const os_bits_t biased = (bits >> OS_FRACTION_BITS) & ((2U * OS_BIAS) + 1U);
    const os_bits_t fraction = bits & OS_FRACTION_MASK;
    /* x = mantissa * 2^(32 whole + part) */
    const int32_t exponent = (int32_t)biased;
    const int32_t power = exponent - (int32_t)OS_BIAS - (int32_t)OS_FRACTION_BITS + 128;
    const int32_t whole = (power / 32) - 4;
    const uint32_t part = (uint32_t)power % 32U;
    const uint64_t mantissa = ((uint64_t)fraction + (uint64_t)OS_FRACTION_MASK) + 1U;
    const uint64_t lower = (mantissa & 0xFFFFFFFFU) << part;
    const uint64_t upper = ((mantissa >> 32) << part) + (lower >> 32);
    const uint32_t factor[3] = {
        (uint32_t)(lower & 0xFFFFFFFFU), (uint32_t)(upper & 0xFFFFFFFFU), (uint32_t)(upper >> 32)
    };
    /* words of 2 / pi before this one give whole turns */
    const int32_t first = (whole > 1) ? (whole - 1) : 0;
    uint32_t product[OS_ANGLE_WORDS + 3];
    os_angle_t angle = { 0U, x - x, (os_real_t)0.0 };
    product[0] = 0U;
    product[1] = 0U;
    product[2] = 0U;
    if (exponent <= OS_LARGEST_EXPONENT) {
        for (int32_t i = 0; i < OS_ANGLE_WORDS; ++i) {
            const uint64_t word = os_word_of_two_over_pi((first + OS_ANGLE_WORDS) - 1 - i);
            uint64_t carry = 0U;
            for (int32_t j = 0; j < 3; ++j) {
                const uint64_t sum = (uint64_t)product[i + j] + (word * factor[j]) + carry;
                product[i + j] = (uint32_t)(sum & 0xFFFFFFFFU);
                carry = sum >> 32;
            }
            product[i + 3] = (uint32_t)carry;
        }
        /* so many words stand behind the point */
        const int32_t n = (OS_ANGLE_WORDS + first) - whole;
        const uint32_t half = product[n - 1] >> 31;
        const bool below = half == 1U;
        if (below) {
            uint32_t borrow = 1U;
            for (int32_t i = 0; i < (OS_ANGLE_WORDS + 2); ++i) {
                if (i < n) {
                    product[i] = ~product[i] + borrow;
                    borrow = (product[i] == 0U) ? borrow : 0U;
                }
            }
        }
        angle = os_quarter_turns_to_angle(product, n);
        const bool negative = (bits >> OS_SIGN_BIT) != 0U;
        const os_bits_t quarters = (os_bits_t)product[n] + (os_bits_t)half;
        angle.quarters = negative ? (0U - quarters) : quarters;
        if (below != negative) {
            angle.high = -angle.high;
            angle.low = -angle.low;
        }
    }
    return angle;
}

/* The angle of x where it is large, else the one that was found already. */
static inline os_angle_t os_reduced_where(bool large, os_real_t x, os_angle_t found)
{
    return large ? os_reduced_exactly(x) : found;
}

#endif
