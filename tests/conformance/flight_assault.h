/* Judges the answers of a guarded kernel by checks of its own, apart from those of the kernel's guards. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "os_rt.h"

typedef struct {
    uint32_t size, row;
    double unit, lower, upper;
    int positive_definite, direction;
} check_t;

static uint64_t os_seed = 0x9E3779B97F4A7C15U;
static unsigned long violations = 0U;

static uint64_t drawn(void)
{
    os_seed ^= os_seed << 13;
    os_seed ^= os_seed >> 7;
    os_seed ^= os_seed << 17;
    return os_seed * 0x2545F4914F6CDD1DU;
}

static double uniform(double low, double high)
{
    return low + (high - low) * ((double)(drawn() >> 11) / 9007199254740992.0);
}

static os_real_t special(void)
{
    const double values[14] = {0.0,  -0.0, (double)NAN, -(double)NAN, (double)INFINITY, -(double)INFINITY, 5e-324,
                               -1e-40, 1e38, -1e308,     1.0,          -1.0,             1e-200,            0.5};
    const uint64_t pick = drawn() % 16U;
    if (pick >= 14U) {
        const uint64_t bits = drawn();
        os_real_t any;
        memcpy(&any, &bits, sizeof any);
        return any;
    }
    /* out of the range of float, a conversion is infinite, not undefined */
    return (os_real_t)((sizeof(os_real_t) == 4U && fabs(values[pick]) > 3e38) ? (double)INFINITY : values[pick]);
}

static int is_finite(os_real_t v)
{
    uint64_t bits = 0U;
    memcpy(&bits, &v, sizeof v);
    return (sizeof v == 4U) ? ((bits >> 23) & 0xFFU) != 0xFFU : ((bits >> 52) & 0x7FFU) != 0x7FFU;
}

/* Whether no honest guard could let these values pass; a little slack for its rounding. */
static int is_bad(const os_real_t *v, const check_t *c)
{
    const double slack = (sizeof(os_real_t) == 4U) ? 1e-5 : 1e-12;
    int bad = 0;
    for (uint32_t k = 0U; k < c->size; k++) {
        bad |= !is_finite(v[k]) || (double)v[k] < c->lower - slack * fabs(c->lower);
        bad |= (double)v[k] > c->upper + slack * fabs(c->upper);
    }
    for (uint32_t i = 0U; (bad == 0) && (i < c->size / c->row); i++) {
        double square = 0.0;
        double largest = 0.0;
        for (uint32_t k = 0U; k < c->row; k++) {
            square += (double)v[i * c->row + k] * (double)v[i * c->row + k];
            largest = fmax(largest, fabs((double)v[i * c->row + k]));
        }
        bad |= (c->unit >= 0.0) && !(fabs(sqrt(square) - 1.0) <= c->unit + slack);
        bad |= (c->direction != 0) && !(largest > 0.0);
        bad |= (c->positive_definite != 0) && !((double)v[i * c->row + i] > 0.0);
        for (uint32_t j = 0U; (c->positive_definite != 0) && (bad == 0) && (j < i); j++) {
            const double size = (double)v[i * c->row + i] / 2.0 + (double)v[j * c->row + j] / 2.0;
            const double asymmetry = (double)v[i * c->row + j] / 2.0 - (double)v[j * c->row + i] / 2.0;
            bad |= fabs(asymmetry) > 1e-3 * size || fabs((double)v[i * c->row + j]) > 1.001 * size;
        }
    }
    return bad;
}

/* Plausible values for the check; one in `wild` entries is anything. */
static void fill(os_real_t *v, const check_t *c, uint32_t wild)
{
    const double low = isinf(c->lower) ? (isinf(c->upper) ? -2.0 : c->upper - 2.0) : c->lower;
    const double high = isinf(c->upper) ? low + 4.0 : c->upper;
    for (uint32_t k = 0U; k < c->size; k++) {
        v[k] = (os_real_t)uniform(low, high);
    }
    for (uint32_t i = 0U; i < c->size / c->row; i++) {
        double square = 1e-9;
        for (uint32_t k = 0U; k < c->row; k++) {
            square += (double)v[i * c->row + k] * (double)v[i * c->row + k];
        }
        for (uint32_t k = 0U; (c->unit >= 0.0) && (k < c->row); k++) {
            v[i * c->row + k] = (os_real_t)((double)v[i * c->row + k] / sqrt(square));
        }
        for (uint32_t k = 0U; (c->positive_definite != 0) && (k < i); k++) {
            v[i * c->row + k] = v[k * c->row + i] = (os_real_t)uniform(-0.01, 0.01);
        }
        if (c->positive_definite != 0) {
            v[i * c->row + i] = (os_real_t)uniform(0.02, fmin(high, 1.0));
        }
    }
    for (uint32_t k = 0U; (wild != 0U) && (k < c->size); k++) {
        if (drawn() % wild == 0U) {
            v[k] = special();
        }
    }
}

static void must(int holds, const char *what)
{
    if (!holds) {
        violations++;
        if (violations < 5U) {
            printf("violated: %s\n", what);
        }
    }
}
