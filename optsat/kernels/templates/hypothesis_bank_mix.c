/* Where entry (i, j) of a symmetric matrix stands in its lower triangle by rows. */
static int32_t KERNEL_at(int32_t i, int32_t j)
{
    return (i >= j) ? (((i * (i + 1)) / 2) + j) : (((j * (j + 1)) / 2) + i);
}

/* Whether fault `bit` is there in a mode. */
static bool KERNEL_has_bit(int32_t mode, int32_t bit)
{
    return (((uint32_t)mode >> (uint32_t)bit) & 1U) != 0U;
}

/* A step of the command moves what a failed axis deviates by, by a part of the step that nobody knows. */
static void KERNEL_step_command(KERNEL_work_t *work, const os_real_t *jump, const os_real_t *spread)
{
    for (int32_t a = 0; a < KERNEL_ACTUATED; ++a) {
        const int32_t e = KERNEL_FIRST_ACTUATED + a;
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            const bool is_failed = KERNEL_has_bit(j, KERNEL_BIT_OF_ACTUATED[a]);
            work->mean[e][j] -= is_failed ? jump[a] : (os_real_t)0;
            work->covariance[KERNEL_at(e, e)][j] += is_failed ? spread[a] : (os_real_t)0;
        }
    }
}

/* Healthy and failed halves of a row, side by side again: after all bits every mode stands where it stood. */
static void KERNEL_interleave(const os_real_t *healthy, const os_real_t *failed, os_real_t *row)
{
    for (int32_t p = 0; p < KERNEL_HALF; ++p) {
        row[2 * p] = healthy[p];
        row[(2 * p) + 1] = failed[p];
    }
}

/* Mix the modes that differ in the top bit, which becomes the lowest: p and p + HALF go to 2 p and 2 p + 1.
   Where the bit is that of actuated states, an axis that recovers has no deviation left from its command, and one that
   fails a wide one. */
static void KERNEL_mix_bit(KERNEL_work_t *work, int32_t bit, const os_real_t *chain, const os_real_t *rest)
{
    const os_real_t fail = chain[2 * bit];
    const os_real_t recover = chain[(2 * bit) + 1];
    os_real_t healthy[KERNEL_HALF];
    os_real_t failed[KERNEL_HALF];
    for (int32_t p = 0; p < KERNEL_HALF; ++p) {
        const os_real_t low = work->probability[p];
        const os_real_t high = work->probability[p + KERNEL_HALF];
        const os_real_t back = recover * high;
        const os_real_t out = fail * low;
        healthy[p] = (low - out) + back;
        failed[p] = (high - back) + out;
        work->share_back[p] = (healthy[p] > (os_real_t)0) ? (back / healthy[p]) : (os_real_t)0;
        work->share_out[p] = (failed[p] > (os_real_t)0) ? (out / failed[p]) : (os_real_t)0;
    }
    KERNEL_interleave(healthy, failed, work->probability);
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        const int32_t a = e - KERNEL_FIRST_ACTUATED;
        const bool is_reset = (a >= 0) && (KERNEL_BIT_OF_ACTUATED[(a >= 0) ? a : 0] == bit);
        for (int32_t p = 0; p < KERNEL_HALF; ++p) {
            const os_real_t low = work->mean[e][p];
            const os_real_t high = work->mean[e][p + KERNEL_HALF];
            work->distance[e][p] = high - low;
            healthy[p] = low + (work->share_back[p] * (high - low));
            failed[p] = high - (work->share_out[p] * (high - low));
        }
        for (int32_t p = 0; is_reset && (p < KERNEL_HALF); ++p) {
            healthy[p] = rest[a];
        }
        KERNEL_interleave(healthy, failed, work->mean[e]);
    }
    for (int32_t p = 0; p < KERNEL_HALF; ++p) {
        work->spread_back[p] = work->share_back[p] * ((os_real_t)1 - work->share_back[p]);
        work->spread_out[p] = work->share_out[p] * ((os_real_t)1 - work->share_out[p]);
    }
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        const int32_t a = e - KERNEL_FIRST_ACTUATED;
        for (int32_t f = 0; f <= e; ++f) {
            const int32_t b = f - KERNEL_FIRST_ACTUATED;
            const bool reset_e = (a >= 0) && (KERNEL_BIT_OF_ACTUATED[(a >= 0) ? a : 0] == bit);
            const bool reset_f = (b >= 0) && (KERNEL_BIT_OF_ACTUATED[(b >= 0) ? b : 0] == bit);
            os_real_t *row = work->covariance[KERNEL_at(e, f)];
            const os_real_t prior = (reset_e && (e == f)) ? KERNEL_PRIOR_VARIANCE[a] : (os_real_t)0;
            for (int32_t p = 0; p < KERNEL_HALF; ++p) {
                const os_real_t low = work->covariance[KERNEL_at(e, f)][p];
                const os_real_t high = work->covariance[KERNEL_at(e, f)][p + KERNEL_HALF];
                const os_real_t square = work->distance[e][p] * work->distance[f][p];
                healthy[p] = (low + (work->share_back[p] * (high - low))) + (work->spread_back[p] * square);
                failed[p] =
                    (high + (work->share_out[p] * ((low + prior) - high))) + (work->spread_out[p] * square);
            }
            for (int32_t p = 0; (reset_e || reset_f) && (p < KERNEL_HALF); ++p) {
                healthy[p] = (os_real_t)0;
            }
            KERNEL_interleave(healthy, failed, row);
        }
    }
}
