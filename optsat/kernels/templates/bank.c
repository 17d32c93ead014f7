/* Bank: interacting multiple models, one Gaussian filter run from the mixed state of each mode. */

/*@sizes*/

/*@step filter: ARGUMENTS -> RESULTS */

/*@leaf restore: N -> N */

/*@leaf near: N + N -> N */

/*@leaf exp: 1 -> 1 */

/*@leaf log: 1 -> 1 */

typedef struct {
    os_real_t state[KERNEL_MODES][KERNEL_N];
    os_real_t covariance[KERNEL_MODES][KERNEL_N * KERNEL_N];
    os_real_t log_probability[KERNEL_MODES];
    os_real_t log_predicted[KERNEL_MODES];
    os_real_t weight[KERNEL_MODES];
    os_real_t failed[KERNEL_MODES];
    os_real_t mixing[KERNEL_MODES][KERNEL_MODES];
    os_real_t pair[2 * KERNEL_N];
    os_real_t reference[KERNEL_N];
    os_real_t merged[KERNEL_N * (KERNEL_N + 1)];
    os_real_t offset[KERNEL_MODES][KERNEL_N];
    os_real_t mean[KERNEL_N][KERNEL_MODES];
    os_real_t deviation[KERNEL_N][KERNEL_MODES];
    os_real_t spread[KERNEL_N * KERNEL_N][KERNEL_MODES];
    os_real_t argument[KERNEL_ARGUMENTS];
    os_real_t result[KERNEL_RESULTS];
    KERNEL_filter_work_t filter;
} KERNEL_work_t;

static os_real_t KERNEL_exp(os_real_t a)
{
    os_real_t result = (os_real_t)0;
    KERNEL_exp_leaf(&a, &result);
    return result;
}

static os_real_t KERNEL_log(os_real_t a)
{
    os_real_t result = (os_real_t)0;
    KERNEL_log_leaf(&a, &result);
    return result;
}

static int32_t KERNEL_most_probable(const os_real_t *log_probability, int32_t count)
{
    int32_t best = 0;
    for (int32_t i = 1; i < count; ++i) {
        best = (log_probability[i] > log_probability[best]) ? i : best;
    }
    return best;
}

/* Modes in use, or 0 where number or transitions make no bank. */
static int32_t KERNEL_check(const os_real_t *transition, os_real_t number)
{
    int32_t count = ((number >= (os_real_t)1) && (number <= (os_real_t)KERNEL_MODES)) ? (int32_t)number : 0;
    bool good = (os_real_t)count >= number;
    for (int32_t i = 0; i < count; ++i) {
        os_real_t out = (os_real_t)0;
        os_real_t in = (os_real_t)0;
        for (int32_t j = 0; j < count; ++j) {
            good = good && (transition[(i * KERNEL_MODES) + j] >= (os_real_t)0);
            out += transition[(i * KERNEL_MODES) + j];
            in += transition[(j * KERNEL_MODES) + i];
        }
        good = good && (os_fabs(out - (os_real_t)1) <= ((os_real_t)(64 * KERNEL_MODES) * OS_EPSILON));
        good = good && (in > (os_real_t)0);
    }
    return good ? count : 0;
}

/* Normalise the probabilities and bound them below; returns the logarithm of what they summed to. */
static os_real_t KERNEL_normalise(KERNEL_work_t *work, int32_t count)
{
    const os_real_t top = work->log_probability[KERNEL_most_probable(work->log_probability, count)];
    os_real_t sum = (os_real_t)0;
    for (int32_t j = 0; j < count; ++j) {
        sum += KERNEL_exp(os_fmax(work->log_probability[j] - top, KERNEL_FLOOR));
    }
    const os_real_t evidence = top + KERNEL_log(sum);
    for (int32_t j = 0; j < count; ++j) {
        work->log_probability[j] = os_fmax(work->log_probability[j] - evidence, KERNEL_FLOOR);
    }
    return evidence;
}

/* Probability of having come from mode i, of those now in mode j; logarithm of the predicted probability of j. */
static void KERNEL_find_mixing(KERNEL_work_t *work, const os_real_t *transition, int32_t count)
{
    for (int32_t i = 0; i < KERNEL_MODES; ++i) {
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            work->mixing[i][j] = (os_real_t)0;
        }
    }
    const os_real_t overall = work->log_probability[KERNEL_most_probable(work->log_probability, count)];
    for (int32_t i = 0; i < count; ++i) {
        work->weight[i] = KERNEL_exp(work->log_probability[i] - overall);
    }
    for (int32_t j = 0; j < count; ++j) {
        /* relative to the most probable origin of this mode, so that no column underflows */
        os_real_t top = -OS_REAL_MAX;
        for (int32_t i = 0; i < count; ++i) {
            const bool leads = transition[(i * KERNEL_MODES) + j] > (os_real_t)0;
            top = leads ? os_fmax(top, work->log_probability[i]) : top;
        }
        os_real_t sum = (os_real_t)0;
        for (int32_t i = 0; i < count; ++i) {
            const os_real_t share = transition[(i * KERNEL_MODES) + j];
            os_real_t weight = work->weight[i];
            if ((top < overall) && (share > (os_real_t)0)) {
                weight = KERNEL_exp(work->log_probability[i] - top);
            }
            work->mixing[i][j] = share * weight;
            sum += work->mixing[i][j];
        }
        for (int32_t i = 0; i < count; ++i) {
            work->mixing[i][j] /= sum;
        }
        work->log_predicted[j] = top + KERNEL_log(sum);
    }
}

/* States less the reference, each turned to its side. */
static void KERNEL_find_offsets(KERNEL_work_t *work, const os_real_t *reference, int32_t count)
{
    for (int32_t i = 0; i < count; ++i) {
        for (int32_t e = 0; e < KERNEL_N; ++e) {
            work->pair[e] = reference[e];
            work->pair[KERNEL_N + e] = work->state[i][e];
        }
        KERNEL_near_leaf(work->pair, work->offset[i]);
        for (int32_t e = 0; e < KERNEL_N; ++e) {
            work->offset[i][e] -= reference[e];
        }
    }
}

/* Mean and covariance of each column of `mixing`, the lanes being the columns. */
static void KERNEL_mix(KERNEL_work_t *work, int32_t count)
{
    for (int32_t e = 0; e < KERNEL_N; ++e) {
        os_real_t mean[KERNEL_MODES];
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            mean[j] = (os_real_t)0;
        }
        for (int32_t i = 0; i < count; ++i) {
            for (int32_t j = 0; j < KERNEL_MODES; ++j) {
                mean[j] += work->mixing[i][j] * work->offset[i][e];
            }
        }
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            work->mean[e][j] = mean[j];
        }
        for (int32_t f = 0; f <= e; ++f) {
            for (int32_t j = 0; j < KERNEL_MODES; ++j) {
                work->spread[(e * KERNEL_N) + f][j] = (os_real_t)0;
            }
        }
    }
    for (int32_t i = 0; i < count; ++i) {
        for (int32_t e = 0; e < KERNEL_N; ++e) {
            for (int32_t j = 0; j < KERNEL_MODES; ++j) {
                work->deviation[e][j] = work->offset[i][e] - work->mean[e][j];
            }
            for (int32_t f = 0; f <= e; ++f) {
                os_real_t *spread = work->spread[(e * KERNEL_N) + f];
                const os_real_t own = work->covariance[i][(e * KERNEL_N) + f];
                for (int32_t j = 0; j < KERNEL_MODES; ++j) {
                    spread[j] += work->mixing[i][j] * (own + (work->deviation[e][j] * work->deviation[f][j]));
                }
            }
        }
    }
}

/* Column j of what was mixed, as a state and a symmetric covariance in a row. */
static void KERNEL_take(KERNEL_work_t *work, const os_real_t *reference, int32_t j, os_real_t *x, os_real_t *P)
{
    for (int32_t e = 0; e < KERNEL_N; ++e) {
        work->pair[e] = reference[e] + work->mean[e][j];
        for (int32_t f = 0; f <= e; ++f) {
            P[(e * KERNEL_N) + f] = work->spread[(e * KERNEL_N) + f][j];
            P[(f * KERNEL_N) + e] = P[(e * KERNEL_N) + f];
        }
    }
    KERNEL_restore_leaf(work->pair, x);
}

/* Run the filter of mode j; where it fails, the mixed state stays and the mode becomes as improbable as the floor. */
static void KERNEL_run(KERNEL_work_t *work, const os_real_t *x, const os_real_t *reference, int32_t j)
{
    /*@tables*/
    KERNEL_take(work, reference, j, work->argument, &work->argument[KERNEL_N]);
    for (int32_t k = KERNEL_N * (KERNEL_N + 1); k < KERNEL_ARGUMENTS; ++k) {
        work->argument[k] = x[KERNEL_PLACE[k] + (j * KERNEL_STRIDE[k])];
    }
    const os_status_t status = KERNEL_filter_body(work->argument, work->result, &work->filter);
    const bool definite = work->result[KERNEL_DEFINITE] > (os_real_t)0;
    const bool checked = (KERNEL_DEFINITE == KERNEL_LIKELIHOOD) || definite;
    const bool good = (status == OS_OK) && checked && os_all_finite(work->result, KERNEL_RESULTS);
    const os_real_t *found = good ? work->result : work->argument;
    for (int32_t e = 0; e < KERNEL_N; ++e) {
        work->state[j][e] = found[e];
    }
    for (int32_t e = 0; e < (KERNEL_N * KERNEL_N); ++e) {
        work->covariance[j][e] = found[KERNEL_N + e];
    }
    work->failed[j] = good ? (os_real_t)0 : (os_real_t)1;
    work->log_probability[j] = good ? (work->log_predicted[j] + work->result[KERNEL_LIKELIHOOD]) : -OS_REAL_MAX;
}

/* x: states (MODES, N), covariances (MODES, N N), log probabilities (MODES), what the filter takes, transition
      (MODES, MODES), modes in use; y: states, covariances, log probabilities, failed (MODES), mean (N),
      covariance (N, N), log evidence */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t *P = &x[KERNEL_MODES * KERNEL_N];
    const os_real_t *log_probability = &P[KERNEL_MODES * (KERNEL_N * KERNEL_N)];
    const os_real_t *transition = &x[KERNEL_TRANSITION];
    const int32_t count = KERNEL_check(transition, transition[KERNEL_MODES * KERNEL_MODES]);
    os_status_t status = (count > 0) ? OS_OK : OS_E_RANGE;
    os_real_t evidence = (os_real_t)NAN;
    os_real_t all_failed = (os_real_t)1;
    status = os_all_finite(x, KERNEL_TRANSITION + (KERNEL_MODES * KERNEL_MODES) + 1) ? status : OS_E_NOT_FINITE;
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        for (int32_t e = 0; e < KERNEL_N; ++e) {
            work->state[j][e] = x[(j * KERNEL_N) + e];
        }
        for (int32_t e = 0; e < (KERNEL_N * KERNEL_N); ++e) {
            work->covariance[j][e] = P[(j * (KERNEL_N * KERNEL_N)) + e];
        }
        work->log_probability[j] = log_probability[j];
        work->failed[j] = (os_real_t)0;
    }
    if (status == OS_OK) {
        (void)KERNEL_normalise(work, count);
        const int32_t before = KERNEL_most_probable(work->log_probability, count);
        for (int32_t e = 0; e < KERNEL_N; ++e) {
            work->reference[e] = work->state[before][e];
        }
        KERNEL_find_mixing(work, transition, count);
        KERNEL_find_offsets(work, work->reference, count);
        KERNEL_mix(work, count);
        for (int32_t j = 0; j < count; ++j) {
            KERNEL_run(work, x, work->reference, j);
            all_failed *= work->failed[j];
        }
        evidence = KERNEL_normalise(work, count);
        const int32_t after = KERNEL_most_probable(work->log_probability, count);
        for (int32_t e = 0; e < KERNEL_N; ++e) {
            work->reference[e] = work->state[after][e];
        }
        for (int32_t i = 0; i < count; ++i) {
            for (int32_t j = 0; j < KERNEL_MODES; ++j) {
                work->mixing[i][j] = (j == 0) ? KERNEL_exp(work->log_probability[i]) : (os_real_t)0;
            }
        }
        KERNEL_find_offsets(work, work->reference, count);
        KERNEL_mix(work, count);
        KERNEL_take(work, work->reference, 0, work->merged, &work->merged[KERNEL_N]);
        status = os_all_finite(work->merged, KERNEL_N * (KERNEL_N + 1)) ? OS_OK : OS_E_OUTPUT;
        status = (all_failed > (os_real_t)0) ? OS_E_STATE : status;
    }
    const bool good = status == OS_OK;
    os_real_t *out = y;
    for (int32_t k = 0; k < (KERNEL_MODES * KERNEL_N); ++k) {
        out[k] = good ? work->state[k / KERNEL_N][k % KERNEL_N] : (os_real_t)NAN;
    }
    out = &out[KERNEL_MODES * KERNEL_N];
    for (int32_t k = 0; k < (KERNEL_MODES * (KERNEL_N * KERNEL_N)); ++k) {
        out[k] = good ? work->covariance[k / (KERNEL_N * KERNEL_N)][k % (KERNEL_N * KERNEL_N)] : (os_real_t)NAN;
    }
    out = &out[KERNEL_MODES * (KERNEL_N * KERNEL_N)];
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        out[j] = good ? work->log_probability[j] : (os_real_t)NAN;
        out[KERNEL_MODES + j] = work->failed[j];
    }
    out = &out[2 * KERNEL_MODES];
    for (int32_t e = 0; e < (KERNEL_N * (KERNEL_N + 1)); ++e) {
        out[e] = good ? work->merged[e] : (os_real_t)NAN;
    }
    out[KERNEL_N * (KERNEL_N + 1)] = good ? evidence : (os_real_t)NAN;
    return status;
}
