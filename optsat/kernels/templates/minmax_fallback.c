/* Fallback: from the best point so far, damped Gauss-Newton steps within the bounds on the smoothed maximum
   gamma + sum max(0, row - width gamma)^2 / (2 smoothing), which needs no interior. */
static os_real_t KERNEL_smoothed(const KERNEL_work_t *work, const KERNEL_point_t *point, os_real_t smoothing)
{
    os_real_t sum = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t excess = os_fmax(point->row[i] - (work->width[i] * point->gamma), (os_real_t)0);
        sum += excess * excess;
    }
    return point->gamma + (sum / ((os_real_t)2 * smoothing));
}

/* Its Gauss-Newton matrix and gradient, variables held at the bounds that they press on. */
static void KERNEL_linearise(KERNEL_work_t *work, os_real_t smoothing)
{
    KERNEL_residuals(work);
    os_real_t *matrix = KERNEL_matrix(work);
    os_real_t *gradient = work->second.v;
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        for (int32_t k = 0; k < KERNEL_V; ++k) {
            matrix[(k * KERNEL_PADDED) + j] = (os_real_t)0;
        }
        gradient[j] = (j == KERNEL_N) ? (os_real_t)1 : (os_real_t)0;
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t excess = work->derivative[i] - (work->width[i] * work->now.gamma);
        if (excess > (os_real_t)0) {
            const os_real_t force = excess / smoothing;
            for (int32_t j = 0; j < KERNEL_V; ++j) {
                gradient[j] += force * work->derivative[KERNEL_ROWS + (i * KERNEL_PADDED) + j];
            }
            KERNEL_add_row(work, i, (os_real_t)1 / smoothing);
        }
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const bool low = (work->now.x[j] <= work->lower[j]) && (gradient[j] > (os_real_t)0);
        const bool high = (work->now.x[j] >= work->upper[j]) && (gradient[j] < (os_real_t)0);
        if (low || high || work->fixed[j]) {
            KERNEL_freeze(work, j);
            gradient[j] = (os_real_t)0;
        }
    }
}

static bool KERNEL_descend(KERNEL_work_t *work, os_real_t smoothing, os_real_t damping)
{
    KERNEL_point_t *trial = &work->trial;
    bool improved = KERNEL_factor(work, damping);
    if (improved) {
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            work->step.v[j] = -work->second.v[j];
        }
        KERNEL_solve(work, work->step.v);
        for (int32_t j = 0; j < KERNEL_N; ++j) {
            const os_real_t x = work->now.x[j] + work->step.v[j];
            trial->x[j] = os_fmin(os_fmax(x, work->lower[j]), work->upper[j]);
        }
        trial->gamma = work->now.gamma + work->step.v[KERNEL_N];
        improved = KERNEL_evaluate(work, trial) &&
                   (KERNEL_smoothed(work, trial, smoothing) < KERNEL_smoothed(work, &work->now, smoothing));
    }
    return improved;
}

static void KERNEL_fall_back(KERNEL_work_t *work)
{
    os_real_t smoothing = os_fmax((os_real_t)1e-3, (os_real_t)0.1 * ((os_real_t)1 + os_fabs(work->best_gamma)));
    os_real_t damping = (os_real_t)1;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        work->now.x[j] = work->best_x[j];
    }
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->multiplier[p] = (os_real_t)0;
    }
    work->now.gamma = work->best_gamma;
    (void)KERNEL_evaluate(work, &work->now);
    for (int32_t k = 1; k <= KERNEL_FALLBACK_STEPS; ++k) {
        bool improved = false;
        KERNEL_linearise(work, smoothing);
        for (int32_t attempt = 0; (attempt < 12) && !improved; ++attempt) {
            improved = KERNEL_descend(work, smoothing, damping);
            damping = improved ? os_fmax(damping * (os_real_t)0.25, (os_real_t)1e-10) : (damping * (os_real_t)8);
        }
        if (improved) {
            work->now = work->trial;
            KERNEL_remember(work, &work->now);
        }
        if ((k % 8) == 0) {
            smoothing *= (os_real_t)0.1;
        }
        work->iterations += (os_real_t)1;
    }
}
