/* Search: how far to go along a step, and what to try when the step itself is too long. */

/* Keep the point with the least violation of what must hold, and among those that hold it the least gamma. */
static void KERNEL_remember(KERNEL_work_t *work, const KERNEL_point_t *point)
{
    os_real_t attained = -OS_REAL_MAX;
    os_real_t violation = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        if (work->width[i] > (os_real_t)0) {
            attained = os_fmax(point->row[i] / work->width[i], attained);
        } else {
            violation = os_fmax(point->row[i], violation);
        }
    }
    violation = (violation > work->tolerance) ? violation : (os_real_t)0;
    const bool feasible = (violation <= (os_real_t)0) && (work->best_violation <= (os_real_t)0);
    if ((violation < work->best_violation) || (feasible && (attained < work->best_gamma))) {
        work->best_violation = violation;
        work->best_gamma = attained;
        for (int32_t j = 0; j < KERNEL_N; ++j) {
            work->best_x[j] = point->x[j];
        }
    }
}

/* Go along the step into `trial`; false where a bound is crossed or a row is not finite there. */
static bool KERNEL_try(KERNEL_work_t *work, const KERNEL_step_t *step, os_real_t length, os_real_t mu)
{
    KERNEL_point_t *trial = &work->trial;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        trial->x[j] = work->now.x[j] + (length * step->v[j]);
    }
    trial->gamma = work->now.gamma + (length * step->v[KERNEL_N]);
    bool usable = KERNEL_measure_gaps(work, trial);
    if (usable) {
        usable = KERNEL_evaluate(work, trial);
    }
    if (usable) {
        /* a slack that can fit its row does: below mu / penalty the merit would rather have the misfit */
        for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
            const os_real_t along = work->now.slack[i] + (length * step->slack[i]);
            const os_real_t fitting = (work->width[i] * trial->gamma) - trial->row[i];
            trial->slack[i] = (fitting > os_fmin(along, mu / work->penalty)) ? fitting : along;
        }
        KERNEL_measure(work, trial);
    }
    return usable;
}

static void KERNEL_accept(KERNEL_work_t *work, const KERNEL_step_t *step, os_real_t dual)
{
    work->now = work->trial;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->multiplier[p] += dual * step->multiplier[p];
    }
    KERNEL_remember(work, &work->now);
}

/* The step corrected for the curvature of the rows that the first trial met. */
static void KERNEL_second_order(KERNEL_work_t *work, os_real_t length, os_real_t mu)
{
    const KERNEL_step_t *step = &work->step;
    os_real_t misfit[KERNEL_ROWS];
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t along = work->now.slack[i] + (length * step->slack[i]);
        const os_real_t met = (work->trial.row[i] - (work->width[i] * work->trial.gamma)) + along;
        misfit[i] = (length * work->row_residual[i]) + met;
    }
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->change[p] = work->product[p] - mu;
    }
    KERNEL_direction(work, misfit, work->change, &work->second);
}

static bool KERNEL_descends(const KERNEL_work_t *work, os_real_t mu, os_real_t merit, os_real_t expected)
{
    return KERNEL_merit(work, &work->trial, mu) <= (merit + ((os_real_t)1e-4 * expected));
}

/* Armijo's rule on the merit, with one correction of second order and at most 12 halvings. */
static bool KERNEL_search(KERNEL_work_t *work, os_real_t mu)
{
    const KERNEL_step_t *step = &work->step;
    const os_real_t share = os_fmax((os_real_t)0.99, (os_real_t)1 - mu);
    os_real_t length = KERNEL_length(work->now.slack, step->slack, share);
    const os_real_t dual = KERNEL_length(work->multiplier, step->multiplier, share);
    os_real_t largest = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        largest = os_fmax(os_fabs(work->multiplier[i] + step->multiplier[i]), largest);
    }
    if (work->penalty < ((os_real_t)1.1 * largest)) {
        work->penalty = (os_real_t)1.5 * largest;
    }
    const os_real_t merit = KERNEL_merit(work, &work->now, mu);
    const os_real_t slope = KERNEL_slope(work, step, mu);
    /* below its own rounding, no decrease of the merit can be seen */
    const os_real_t rounding = ((os_real_t)10 * OS_EPSILON) * os_fabs(merit);
    bool accepted = false;
    if (slope <= rounding) {
        for (int32_t k = 0; (k <= 12) && !accepted; ++k) {
            const bool usable = KERNEL_try(work, step, length, mu);
            accepted = usable && KERNEL_descends(work, mu, merit + rounding, length * slope);
            if (accepted) {
                KERNEL_accept(work, step, dual);
            } else if ((k == 0) && usable && (work->trial.misfit >= work->now.misfit)) {
                KERNEL_second_order(work, length, mu);
                const os_real_t second = KERNEL_length(work->now.slack, work->second.slack, share);
                accepted = KERNEL_try(work, &work->second, second, mu) &&
                           KERNEL_descends(work, mu, merit + rounding, second * slope);
                if (accepted) {
                    KERNEL_accept(work, &work->second,
                                  KERNEL_length(work->multiplier, work->second.multiplier, share));
                }
            } else {
                /* the halved step is next */
            }
            length *= (os_real_t)0.5;
        }
    }
    return accepted;
}
