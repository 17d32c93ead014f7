/* Probabilities after the samples, none below the floor; returns the log density of the samples. */
static os_real_t KERNEL_find_posterior(KERNEL_work_t *work)
{
    os_real_t before = (os_real_t)0;
    os_real_t sum = (os_real_t)0;
    os_real_t top = -OS_REAL_MAX;
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        os_real_t argument = os_fmax(work->probability[j], KERNEL_FLOOR);
        os_real_t log_predicted = (os_real_t)0;
        KERNEL_log_leaf(&argument, &log_predicted);
        before += work->probability[j];
        work->log_probability[j] += log_predicted;
    }
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        top = os_fmax(top, work->log_probability[j]);
    }
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        os_real_t less = work->log_probability[j] - top;
        KERNEL_exp_leaf(&less, &work->probability[j]);
    }
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        sum += work->probability[j];
    }
    os_real_t kept = (os_real_t)0;
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        work->probability[j] = os_fmax(work->probability[j] / sum, KERNEL_FLOOR);
        kept += work->probability[j];
    }
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        work->probability[j] /= kept;
    }
    os_real_t ratio = sum / before;
    os_real_t log_ratio = (os_real_t)0;
    KERNEL_log_leaf(&ratio, &log_ratio);
    return top + log_ratio;
}

/* Sum of a row times probabilities: a sum for each lane, and then over the lanes. */
static os_real_t KERNEL_expect(const KERNEL_work_t *work, const os_real_t *row)
{
    os_real_t part[KERNEL_LANES];
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        part[l] = (os_real_t)0;
    }
    for (int32_t first = 0; first < KERNEL_MODES; first += KERNEL_LANES) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            part[l] += work->probability[first + l] * row[first + l];
        }
    }
    os_real_t sum = (os_real_t)0;
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        sum += part[l];
    }
    return sum;
}

/* One Gaussian with the mean and covariance of all modes together; the modes' means from then on about that mean. */
static void KERNEL_merge(KERNEL_work_t *work)
{
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        const os_real_t mean = KERNEL_expect(work, work->mean[e]);
        work->merged_mean[e] = mean;
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            work->mean[e][j] -= mean;
        }
    }
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        for (int32_t f = 0; f <= e; ++f) {
            os_real_t part[KERNEL_LANES];
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                part[l] = (os_real_t)0;
            }
            for (int32_t first = 0; first < KERNEL_MODES; first += KERNEL_LANES) {
                for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                    const os_real_t spread = work->mean[e][first + l] * work->mean[f][first + l];
                    part[l] += work->probability[first + l] * (work->covariance[KERNEL_at(e, f)][first + l] + spread);
                }
            }
            os_real_t sum = (os_real_t)0;
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                sum += part[l];
            }
            work->merged_covariance[KERNEL_at(e, f)] = sum;
        }
    }
}

/* Probability of each fault; of each actuated axis, mean and variance of its deviation given that it has failed. */
static void KERNEL_find_deviations(KERNEL_work_t *work)
{
    for (int32_t b = 0; b < KERNEL_BITS; ++b) {
        os_real_t sum = (os_real_t)0;
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            sum += KERNEL_has_bit(j, b) ? work->probability[j] : (os_real_t)0;
        }
        work->failing[b] = sum;
    }
    for (int32_t a = 0; a < KERNEL_ACTUATED; ++a) {
        const int32_t e = KERNEL_FIRST_ACTUATED + a;
        const int32_t bit = KERNEL_BIT_OF_ACTUATED[a];
        os_real_t mean = (os_real_t)0;
        os_real_t spread = (os_real_t)0;
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            const os_real_t part = KERNEL_has_bit(j, bit) ? work->probability[j] : (os_real_t)0;
            mean += part * work->mean[e][j];
        }
        mean /= work->failing[bit];
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            const os_real_t part = KERNEL_has_bit(j, bit) ? work->probability[j] : (os_real_t)0;
            const os_real_t apart = work->mean[e][j] - mean;
            spread += part * (work->covariance[KERNEL_at(e, e)][j] + (apart * apart));
        }
        work->deviation[a] = mean;
        work->deviation_variance[a] = spread / work->failing[bit];
    }
}

/* The reference goes to the mean of all modes; deviations of failed axes become those of the reference's own kind. */
static void KERNEL_move_reference(KERNEL_work_t *work)
{
    for (int32_t k = 0; k < KERNEL_REFERENCE; ++k) {
        work->pair[k] = work->argument[k];
    }
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        work->pair[KERNEL_REFERENCE + e] = work->merged_mean[e];
    }
    KERNEL_shift_leaf(work->pair, work->argument);
    for (int32_t a = 0; a < KERNEL_ACTUATED; ++a) {
        work->deviation[a] += work->argument[(KERNEL_REFERENCE - KERNEL_ACTUATED) + a];
    }
}

static void KERNEL_load(const os_real_t *x, KERNEL_work_t *work)
{
    const os_real_t *mean = &x[KERNEL_MODES];
    const os_real_t *covariance = &mean[KERNEL_STATES * KERNEL_MODES];
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        work->probability[j] = x[j];
    }
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            work->mean[e][j] = mean[(e * KERNEL_MODES) + j];
        }
    }
    for (int32_t k = 0; k < KERNEL_PACKED; ++k) {
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            work->covariance[k][j] = covariance[(k * KERNEL_MODES) + j];
        }
    }
}

static void KERNEL_store(const KERNEL_work_t *work, os_real_t evidence, os_real_t *y)
{
    int32_t at = 0;
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        y[at] = work->probability[j];
        at += 1;
    }
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            y[at + j] = work->mean[e][j];
        }
        at += KERNEL_MODES;
    }
    for (int32_t k = 0; k < KERNEL_PACKED; ++k) {
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            y[at + j] = work->covariance[k][j];
        }
        at += KERNEL_MODES;
    }
    for (int32_t k = 0; k < KERNEL_REFERENCE; ++k) {
        y[at] = work->argument[k];
        at += 1;
    }
    for (int32_t k = 0; k < KERNEL_CARRIED; ++k) {
        y[at] = work->observed[(KERNEL_OBSERVED - KERNEL_CARRIED) + k];
        at += 1;
    }
    for (int32_t b = 0; b < KERNEL_BITS; ++b) {
        y[at] = work->failing[b];
        at += 1;
    }
    for (int32_t a = 0; a < KERNEL_ACTUATED; ++a) {
        y[at] = work->deviation[a];
        y[at + KERNEL_ACTUATED] = work->deviation_variance[a];
        at += 1;
    }
    at += KERNEL_ACTUATED;
    for (int32_t k = 0; k < (KERNEL_STATES * KERNEL_STATES); ++k) {
        y[at] = work->merged_covariance[KERNEL_at(k / KERNEL_STATES, k % KERNEL_STATES)];
        at += 1;
    }
    y[at] = evidence;
}
