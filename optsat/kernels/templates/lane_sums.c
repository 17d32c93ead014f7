/* Sums that any number of lanes forms alike: KERNEL_LANES accumulators, added in a fixed order (rows are padded). */
static os_real_t KERNEL_dot(const os_real_t *a, const os_real_t *b)
{
    os_real_t sum[KERNEL_LANES];
    for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
        sum[lane] = (os_real_t)0;
    }
    for (int32_t begin = 0; begin < KERNEL_PADDED; begin += KERNEL_LANES) {
        for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
            sum[lane] += a[begin + lane] * b[begin + lane];
        }
    }
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}
