/* Step: residuals of the optimality conditions, and the Newton step that reduces them. */

/* Values, gradients and curvature at the present point, and by how much the conditions are missed there. */
static void KERNEL_residuals(KERNEL_work_t *work)
{
    const KERNEL_point_t *now = &work->now;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        work->argument[j] = now->x[j];
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        work->argument[KERNEL_N + KERNEL_PARAMETERS + i] = work->multiplier[i];
    }
    KERNEL_derivatives_leaf(work->argument, work->derivative);
    os_real_t scale[KERNEL_PADDED];
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        work->gradient[j] = (os_real_t)0;
        scale[j] = (os_real_t)1;
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t multiplier = work->multiplier[i];
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            const os_real_t term = multiplier * work->derivative[KERNEL_ROWS + (i * KERNEL_PADDED) + j];
            work->gradient[j] += term;
            scale[j] += os_fabs(term);
        }
    }
    work->gradient[KERNEL_N] += (os_real_t)1;
    os_real_t all = (os_real_t)0;
    work->dual_error = (os_real_t)0;
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        work->dual_residual[j] = work->gradient[j];
        all += scale[j];
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const os_real_t pull = work->multiplier[KERNEL_ROWS + j] - work->multiplier[KERNEL_ROWS + KERNEL_N + j];
        work->dual_residual[j] = work->fixed[j] ? (os_real_t)0 : (work->gradient[j] - pull);
        work->dual_error = os_fmax(os_fabs(work->dual_residual[j]) / scale[j], work->dual_error);
    }
    work->dual_error = os_fmax(os_fabs(work->dual_residual[KERNEL_N]), work->dual_error);
    work->row_error = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        work->row_residual[i] = (work->derivative[i] - (work->width[i] * now->gamma)) + now->slack[i];
        const os_real_t size = (os_real_t)1 + os_fabs(work->derivative[i]);
        all += size;
        work->row_error = os_fmax(os_fabs(work->row_residual[i]) / size, work->row_error);
    }
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
    os_real_t *matrix = KERNEL_matrix(work);
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        work->inverse[p] = (os_real_t)1 / work->now.slack[p];
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        KERNEL_add_row(work, i, work->multiplier[i] * work->inverse[i]);
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const int32_t lower = KERNEL_ROWS + j;
        const int32_t upper = lower + KERNEL_N;
        matrix[(j * KERNEL_PADDED) + j] += work->multiplier[lower] * work->inverse[lower];
        matrix[(j * KERNEL_PADDED) + j] += work->multiplier[upper] * work->inverse[upper];
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
    const os_real_t *multiplier = work->multiplier;
    const os_real_t *inverse = work->inverse;
    os_real_t v[KERNEL_PADDED];
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        v[j] = -work->dual_residual[j];
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t force = ((multiplier[i] * misfit[i]) - product[i]) * inverse[i];
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            v[j] -= work->derivative[KERNEL_ROWS + (i * KERNEL_PADDED) + j] * force;
        }
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const int32_t lower = KERNEL_ROWS + j;
        const int32_t upper = lower + KERNEL_N;
        v[j] -= work->present[lower] ? (product[lower] * inverse[lower]) : (os_real_t)0;
        v[j] += work->present[upper] ? (product[upper] * inverse[upper]) : (os_real_t)0;
        v[j] = work->fixed[j] ? (os_real_t)0 : v[j];
    }
    KERNEL_solve(work, v);
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        step->v[j] = v[j];
    }
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        os_real_t change = (os_real_t)0;
        for (int32_t j = 0; j < KERNEL_V; ++j) {
            change += work->derivative[KERNEL_ROWS + (i * KERNEL_PADDED) + j] * v[j];
        }
        step->slack[i] = -misfit[i] - change;
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        step->slack[KERNEL_ROWS + j] = v[j];
        step->slack[KERNEL_ROWS + KERNEL_N + j] = -v[j];
    }
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        step->slack[p] = work->present[p] ? step->slack[p] : (os_real_t)0;
        const os_real_t change = (-product[p] - (multiplier[p] * step->slack[p])) * inverse[p];
        step->multiplier[p] = work->present[p] ? change : (os_real_t)0;
    }
}

/* Longest step, at most 1, that leaves each value 1 - share of itself. */
static os_real_t KERNEL_length(const os_real_t *value, const os_real_t *step, os_real_t share)
{
    os_real_t length = (os_real_t)1;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        const os_real_t room = share * value[p];
        if ((-step[p] * length) > room) {
            length = room / -step[p];
        }
    }
    return length;
}
