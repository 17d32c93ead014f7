/* Iterate: predictor and corrector as long as they do well, then a barrier that falls only when the problem at the
   present one is solved. */

/* Mehrotra: the step to the boundary says how far the barrier can fall, and corrects for what it leaves out. */
static os_real_t KERNEL_predict(KERNEL_work_t *work, os_real_t mu, os_real_t least)
{
    KERNEL_step_t *step = &work->step;
    KERNEL_direction(work, work->row_residual, work->product, step);
    const os_real_t primal = KERNEL_length(work->now.slack, step->slack, (os_real_t)1);
    const os_real_t dual = KERNEL_length(work->multiplier, step->multiplier, (os_real_t)1);
    os_real_t left = (os_real_t)0;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        const os_real_t slack = work->now.slack[p] + (primal * step->slack[p]);
        left += slack * (work->multiplier[p] + (dual * step->multiplier[p]));
    }
    const os_real_t ratio = os_fmin(os_fmax(left / work->gap, (os_real_t)0), (os_real_t)1);
    /* far ahead of the residuals, the products would lose their balance and the steps their length */
    const os_real_t residual = os_fmax(work->dual_error, work->row_error);
    const os_real_t share = os_fmin((os_real_t)1e-4, (os_real_t)1e-2 * residual);
    const os_real_t balance = os_fmin(share * residual, (os_real_t)10 * mu);
    const os_real_t target = os_fmax(((ratio * ratio) * ratio) * mu, os_fmax(least, balance));
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->change[p] = (work->product[p] - target) + (step->slack[p] * step->multiplier[p]);
    }
    KERNEL_direction(work, work->row_residual, work->change, step);
    return target;
}

static os_real_t KERNEL_lower_barrier(const KERNEL_work_t *work, os_real_t barrier, os_real_t least)
{
    os_real_t error = os_fmax(work->dual_error, work->row_error);
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        error = work->present[p] ? os_fmax(os_fabs(work->product[p] - barrier), error) : error;
    }
    os_real_t lowered = barrier;
    for (int32_t k = 0; (k < 4) && (error <= ((os_real_t)10 * lowered)) && (lowered > least); ++k) {
        lowered = os_fmax(os_fmin((os_real_t)0.2 * lowered, lowered * os_sqrt(lowered)), least);
    }
    return lowered;
}

/* Begin again from the present point with multipliers that suit a larger barrier, and more damping. */
static void KERNEL_recentre(KERNEL_work_t *work, os_real_t mu)
{
    const os_real_t barrier = os_fmax(mu, (os_real_t)1e-6) * (os_real_t)10;
    os_real_t sum = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t fitting = (work->width[i] * work->now.gamma) - work->now.row[i];
        work->now.slack[i] = os_fmax(work->now.slack[i], fitting);
        sum += work->width[i] * (barrier / work->now.slack[i]);
    }
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->multiplier[p] = work->present[p] ? ((barrier / work->now.slack[p]) / sum) : (os_real_t)0;
    }
    KERNEL_measure(work, &work->now);
    work->damping = os_fmax((os_real_t)1e-4, work->damping) * (os_real_t)100;
    work->penalty = (os_real_t)1;
}

/* Ends at a point whose derivatives stand in `derivative`. */
static void KERNEL_iterate(KERNEL_work_t *work)
{
    int32_t failures = 0;
    os_real_t barrier = (os_real_t)0;
    bool going = true;
    for (int32_t k = 0; (k <= KERNEL_STEPS) && going; ++k) {
        KERNEL_residuals(work);
        going = (k < KERNEL_STEPS) && !(work->error <= (work->tolerance * (os_real_t)0.25));
        if (going) {
            going = KERNEL_prepare(work) && (work->penalty < ((os_real_t)1 / OS_EPSILON));
        }
        if (going) {
            const os_real_t mu = work->gap / work->count;
            const os_real_t scale = (os_real_t)1 + os_fabs(work->now.gamma);
            const os_real_t least = (((os_real_t)0.0125 * work->tolerance) * scale) / work->count;
            bool found = false;
            os_real_t target;
            if (k < KERNEL_ADAPTIVE_STEPS) {
                target = KERNEL_predict(work, mu, least);
                found = KERNEL_search(work, target);
            } else {
                barrier = KERNEL_lower_barrier(work, (k == KERNEL_ADAPTIVE_STEPS) ? mu : barrier, least);
                target = barrier;
            }
            if (!found) {
                for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
                    work->change[p] = work->product[p] - target;
                }
                KERNEL_direction(work, work->row_residual, work->change, &work->step);
                found = KERNEL_search(work, target);
            }
            if (!found) {
                ++failures;
                going = (failures <= 3) && (work->error > work->tolerance);
                if (going) {
                    KERNEL_recentre(work, mu);
                }
            }
            work->iterations += (os_real_t)1;
        }
    }
}
