/* os_peak.h: products and sums in lanes that wait for nothing, to measure how many this machine does in a second. */
#ifndef OS_PEAK_H
#define OS_PEAK_H

#include "os_lanes.h"

/* Chains that do not depend on each other, enough to cover the latency of a product and a sum. */
#define OS_PEAK_CHAINS 12

int64_t os_peak(int64_t rounds, os_real_t *out);

/* Returns the operations done, each lane counted. */
int64_t os_peak(int64_t rounds, os_real_t *out)
{
    const os_lanes_real_t factor = os_lanes_constant(out[0]);
    const os_lanes_real_t term = os_lanes_constant(out[1]);
    os_lanes_real_t a[OS_PEAK_CHAINS];
    OS_UNROLLED
    for (int k = 0; k < OS_PEAK_CHAINS; ++k) {
        a[k] = os_lanes_constant((os_real_t)k);
    }
    for (int64_t i = 0; i < rounds; ++i) {
        OS_UNROLLED
        for (int k = 0; k < OS_PEAK_CHAINS; ++k) {
            a[k] = (a[k] * factor) + term;
        }
    }
    OS_UNROLLED
    for (int k = 0; k < OS_PEAK_CHAINS; ++k) {
        out[k] = a[k][0];
    }
    return rounds * 2 * OS_PEAK_CHAINS * OS_WIDTH;
}

#endif
