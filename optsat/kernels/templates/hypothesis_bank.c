/* Hypothesis bank: every joint hypothesis of independent faults with a Gaussian of its own, about one reference. */

/*@sizes*/

/*@leaf predict: REFERENCE + CARRIED + INPUTS -> REFERENCE + F_NONZEROS + STATES + 2 * BITS + 3 * ACTUATED */

/*@leaf observe: REFERENCE + CARRIED + INPUTS -> 2 * CHANNELS + 2 * MEASURED + H_NONZEROS + CARRIED */

/*@leaf shift: REFERENCE + STATES -> REFERENCE */

/*@leaf exp: 1 -> 1 */

/*@leaf log: 1 -> 1 */

/*@tables*/

typedef struct {
    os_real_t probability[KERNEL_MODES];
    os_real_t mean[KERNEL_STATES][KERNEL_MODES];
    os_real_t covariance[KERNEL_PACKED][KERNEL_MODES];
    os_real_t log_probability[KERNEL_MODES];
    os_real_t share_back[KERNEL_HALF];
    os_real_t share_out[KERNEL_HALF];
    os_real_t spread_back[KERNEL_HALF];
    os_real_t spread_out[KERNEL_HALF];
    os_real_t distance[KERNEL_STATES][KERNEL_HALF];
    os_real_t lane_mean[KERNEL_STATES][KERNEL_LANES];
    os_real_t lane_covariance[KERNEL_PACKED][KERNEL_LANES];
    os_real_t lane_log[KERNEL_LANES];
    os_real_t is_failed[KERNEL_BITS][KERNEL_LANES];
    os_real_t moved[KERNEL_STATES][KERNEL_LANES];
    os_real_t product[KERNEL_STATES][KERNEL_STATES][KERNEL_LANES];
    os_real_t projected[KERNEL_STATES][KERNEL_LANES];
    os_real_t variance[KERNEL_LANES];
    os_real_t residual[KERNEL_LANES];
    os_real_t joint[KERNEL_WIDEST][KERNEL_WIDEST][KERNEL_LANES];
    os_real_t joint_residual[KERNEL_WIDEST][KERNEL_LANES];
    os_real_t determinant[KERNEL_LANES];
    os_real_t square[KERNEL_LANES];
    os_real_t factor[KERNEL_LANES];
    os_real_t log_failed[KERNEL_LANES];
    os_real_t used[KERNEL_LANES];
    os_real_t weight[KERNEL_LANES];
    os_real_t gain[KERNEL_LANES];
    os_real_t is_definite[KERNEL_LANES];
    os_real_t predicted[KERNEL_PREDICTED];
    os_real_t observed[KERNEL_OBSERVED];
    os_real_t argument[KERNEL_REFERENCE + KERNEL_CARRIED + KERNEL_INPUTS];
    os_real_t pair[KERNEL_REFERENCE + KERNEL_STATES];
    os_real_t merged_mean[KERNEL_STATES];
    os_real_t merged_covariance[KERNEL_PACKED];
    os_real_t failing[KERNEL_BITS];
    os_real_t deviation[KERNEL_ACTUATED + 1];
    os_real_t deviation_variance[KERNEL_ACTUATED + 1];
} KERNEL_work_t;

/*@include hypothesis_bank_mix*/

/*@include hypothesis_bank_update*/

/*@include hypothesis_bank_merge*/

/* Numbers that may be probabilities of modes, in any sum, and variances of the states that are not negative. */
static bool KERNEL_is_state(const KERNEL_work_t *work)
{
    os_real_t sum = (os_real_t)0;
    bool good = true;
    for (int32_t j = 0; j < KERNEL_MODES; ++j) {
        good = good && (work->probability[j] >= (os_real_t)0);
        sum += work->probability[j];
    }
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        for (int32_t j = 0; j < KERNEL_MODES; ++j) {
            good = good && (work->covariance[KERNEL_at(e, e)][j] >= (os_real_t)0);
        }
    }
    return good && (sum > (os_real_t)0);
}

/* From one sample to the next: command, faults that come and go, motion. `from` is reference, carried and inputs. */
static void KERNEL_predict(KERNEL_work_t *work, const os_real_t *from)
{
    KERNEL_predict_leaf(from, work->predicted);
    const os_real_t *chain = &work->predicted[KERNEL_REFERENCE + KERNEL_F_NONZEROS + KERNEL_STATES];
    const os_real_t *jump = &chain[2 * KERNEL_BITS];
    KERNEL_step_command(work, jump, &jump[KERNEL_ACTUATED]);
    for (int32_t b = KERNEL_BITS - 1; b >= 0; --b) {
        KERNEL_mix_bit(work, b, chain, &jump[2 * KERNEL_ACTUATED]);
    }
    for (int32_t k = 0; k < (KERNEL_REFERENCE + KERNEL_CARRIED + KERNEL_INPUTS); ++k) {
        work->argument[k] = (k < KERNEL_REFERENCE) ? work->predicted[k] : from[k];
    }
}

/* Motion of the modes' Gaussians, and the samples of all channels; whether every predicted variance was positive. */
static bool KERNEL_update(KERNEL_work_t *work)
{
    const os_real_t *F = &work->predicted[KERNEL_REFERENCE];
    const os_real_t *kind = work->observed;
    const os_real_t *without_state = &kind[KERNEL_CHANNELS];
    const os_real_t *seen = &without_state[KERNEL_CHANNELS];
    bool good = true;
    for (int32_t first = 0; first < KERNEL_MODES; first += KERNEL_LANES) {
        KERNEL_take_lanes(work, first);
        KERNEL_predict_lanes(work, F, &F[KERNEL_F_NONZEROS]);
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->lane_log[l] = (os_real_t)0;
            work->is_definite[l] = (os_real_t)1;
        }
        for (int32_t c = 0; c < KERNEL_CHANNELS; ++c) {
            const int32_t bit = KERNEL_BIT_OF_CHANNEL[c];
            if (kind[c] > (os_real_t)1.5) {
                for (int32_t l = 0; (bit >= 0) && (l < KERNEL_LANES); ++l) {
                    work->lane_log[l] += KERNEL_INVALID * ((os_real_t)1 - work->is_failed[(bit >= 0) ? bit : 0][l]);
                }
            } else if (kind[c] > (os_real_t)0.5) {
                KERNEL_measure(work, &seen[2 * KERNEL_MEASURED], seen, c, without_state[c]);
            } else {
                /* missing: nothing is learnt */
            }
        }
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            good = good && (work->is_definite[l] > (os_real_t)0);
        }
        KERNEL_give_lanes(work, first);
    }
    return good;
}

/* x: probability (MODES), mean (STATES, MODES), covariance (PACKED, MODES), reference, carried, inputs;
   y: all but the inputs after the step; probability of each fault (BITS), deviation and its variance where the axis has
      failed (ACTUATED each), covariance of all modes together (STATES, STATES), log evidence */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t *from = &x[KERNEL_MODES * (1 + KERNEL_STATES + KERNEL_PACKED)];
    const bool finite = os_all_finite(
        x, (KERNEL_MODES * (1 + KERNEL_STATES + KERNEL_PACKED)) + KERNEL_REFERENCE + KERNEL_CARRIED + KERNEL_INPUTS);
    KERNEL_load(x, work);
    os_status_t status = KERNEL_is_state(work) ? OS_OK : OS_E_STATE;
    status = finite ? status : OS_E_NOT_FINITE;
    os_real_t evidence = (os_real_t)0;
    if (status == OS_OK) {
        KERNEL_predict(work, from);
        KERNEL_observe_leaf(work->argument, work->observed);
        status = KERNEL_update(work) ? OS_OK : OS_E_STATE;
    }
    if (status == OS_OK) {
        evidence = KERNEL_find_posterior(work);
        KERNEL_merge(work);
        KERNEL_find_deviations(work);
        KERNEL_move_reference(work);
    }
    if (status == OS_OK) {
        KERNEL_store(work, evidence, y);
        status = os_all_finite(y, KERNEL_RESULTS) ? OS_OK : OS_E_OUTPUT;
    }
    for (int32_t k = 0; (status != OS_OK) && (k < KERNEL_RESULTS); ++k) {
        y[k] = (os_real_t)NAN;
    }
    return status;
}
