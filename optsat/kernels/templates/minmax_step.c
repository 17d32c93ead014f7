/* Step: residuals of the optimality conditions, and the Newton step that reduces them. */

/* Values, gradients and curvature at the present point, and by how much the conditions are missed there. */
static void KERNEL_residuals(KERNEL_work_t *work)
{
    const KERNEL_point_t *now = &work->now;
    const os_real_t *jacobian = &work->derivative[KERNEL_ROWS];
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        work->argument[j] = now->x[j];
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        work->argument[KERNEL_N + KERNEL_PARAMETERS + i] = work->multiplier[i];
    }
    KERNEL_derivatives_leaf(work->argument, work->derivative);
    os_real_t all = (os_real_t)0;
    work->dual_error = (os_real_t)0;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        os_real_t sum = (os_real_t)0;
        os_real_t scale = (os_real_t)1;
        for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
            const os_real_t term = work->multiplier[i] * jacobian[(i * KERNEL_N) + j];
            sum += term;
            scale += os_fabs(term);
        }
        work->gradient[j] = sum;
        all += scale;
        sum -= work->multiplier[KERNEL_ROWS + j];
        sum += work->multiplier[KERNEL_ROWS + KERNEL_N + j];
        work->dual_residual[j] = work->fixed[j] ? (os_real_t)0 : sum;
        work->dual_error = os_fmax(os_fabs(work->dual_residual[j]) / scale, work->dual_error);
    }
    os_real_t rest = (os_real_t)1;
    work->row_error = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        rest -= work->width[i] * work->multiplier[i];
        work->row_residual[i] = (work->derivative[i] - (work->width[i] * now->gamma)) + now->slack[i];
        const os_real_t scale = (os_real_t)1 + os_fabs(work->derivative[i]);
        all += scale;
        work->row_error = os_fmax(os_fabs(work->row_residual[i]) / scale, work->row_error);
    }
    work->dual_residual[KERNEL_N] = rest;
    work->dual_error = os_fmax(os_fabs(rest), work->dual_error);
    work->gap = (os_real_t)0;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->product[p] = now->slack[p] * work->multiplier[p];
        work->gap += work->product[p];
    }
    /* the largest of several numbers would not show a NaN among them */
    if (!((all + work->gap) <= OS_REAL_MAX)) {
        work->dual_error = OS_REAL_MAX;
    }
    work->error = os_fmax(work->gap / ((os_real_t)1 + os_fabs(now->gamma)), os_fmax(work->row_error, work->dual_error));
}

/* The matrix of the step in x and gamma, slacks and multipliers eliminated, damped until its inertia is right. */
static bool KERNEL_prepare(KERNEL_work_t *work)
{
    const os_real_t *hessian = &work->derivative[KERNEL_ROWS + (KERNEL_ROWS * KERNEL_N)];
    os_real_t *matrix = work->matrix;
    for (int32_t k = 0; k < KERNEL_TRIANGLE; ++k) {
        matrix[k] = (k < KERNEL_HESSIAN) ? hessian[k] : (os_real_t)0;
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        KERNEL_add_row(work, i, work->multiplier[i] / work->now.slack[i]);
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const int32_t lower = KERNEL_ROWS + j;
        const int32_t upper = lower + KERNEL_N;
        matrix[KERNEL_at(j, j)] += work->multiplier[lower] / work->now.slack[lower];
        matrix[KERNEL_at(j, j)] += work->multiplier[upper] / work->now.slack[upper];
        if (work->fixed[j]) {
            KERNEL_freeze(work, j);
        }
    }
    const os_real_t growth = (work->damping > (os_real_t)0) ? (os_real_t)8 : (os_real_t)100;
    os_real_t damping = (os_real_t)0;
    bool positive = KERNEL_factor(work, damping);
    for (int32_t k = 0; (k < 20) && !positive; ++k) {
        damping = (damping > (os_real_t)0) ? (damping * growth)
                                           : os_fmax((os_real_t)1e-4, work->damping / (os_real_t)3);
        positive = KERNEL_factor(work, damping);
    }
    if (positive && (damping > (os_real_t)0)) {
        work->damping = damping;
    }
    return positive;
}

/* The step that takes the misfits of the rows to zero, and the products of the pairs down by `product`. */
static void KERNEL_direction(const KERNEL_work_t *work, const os_real_t *misfit, const os_real_t *product,
                             KERNEL_step_t *step)
{
    const os_real_t *jacobian = &work->derivative[KERNEL_ROWS];
    const os_real_t *slack = work->now.slack;
    const os_real_t *multiplier = work->multiplier;
    for (int32_t j = 0; j < KERNEL_V; ++j) {
        step->v[j] = -work->dual_residual[j];
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t force = ((multiplier[i] * misfit[i]) - product[i]) / slack[i];
        for (int32_t j = 0; j < KERNEL_N; ++j) {
            step->v[j] -= jacobian[(i * KERNEL_N) + j] * force;
        }
        step->v[KERNEL_N] += work->width[i] * force;
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const int32_t lower = KERNEL_ROWS + j;
        const int32_t upper = lower + KERNEL_N;
        step->v[j] -= work->present[lower] ? (product[lower] / slack[lower]) : (os_real_t)0;
        step->v[j] += work->present[upper] ? (product[upper] / slack[upper]) : (os_real_t)0;
        step->v[j] = work->fixed[j] ? (os_real_t)0 : step->v[j];
    }
    KERNEL_solve(work, step->v);
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        os_real_t change = (os_real_t)0;
        for (int32_t j = 0; j < KERNEL_N; ++j) {
            change += jacobian[(i * KERNEL_N) + j] * step->v[j];
        }
        step->slack[i] = -misfit[i] - (change - (work->width[i] * step->v[KERNEL_N]));
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        step->slack[KERNEL_ROWS + j] = step->v[j];
        step->slack[KERNEL_ROWS + KERNEL_N + j] = -step->v[j];
    }
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        step->slack[p] = work->present[p] ? step->slack[p] : (os_real_t)0;
        step->multiplier[p] =
            work->present[p] ? ((-product[p] - (multiplier[p] * step->slack[p])) / slack[p]) : (os_real_t)0;
    }
}

/* Longest steps, at most 1, that leave each slack and each multiplier 1 - share of itself. */
static void KERNEL_lengths(const KERNEL_work_t *work, const KERNEL_step_t *step, os_real_t share, os_real_t *primal,
                           os_real_t *dual)
{
    *primal = (os_real_t)1;
    *dual = (os_real_t)1;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        if (step->slack[p] < (os_real_t)0) {
            *primal = os_fmin((-share * work->now.slack[p]) / step->slack[p], *primal);
        }
        if (step->multiplier[p] < (os_real_t)0) {
            *dual = os_fmin((-share * work->multiplier[p]) / step->multiplier[p], *dual);
        }
    }
}
