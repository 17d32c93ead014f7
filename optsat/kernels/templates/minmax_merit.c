/* Merit: gamma, minus mu times the logarithms of all slacks, plus a penalty on rows that do not fit their slack. */

/* Sum of the logarithms of positive numbers, from their product: without the mathematical library, whose bits differ
   between machines. */
static os_real_t KERNEL_log_sum(const os_real_t *value)
{
    const os_real_t low = os_sqrt(OS_REAL_MIN);
    const os_real_t high = (os_real_t)1 / low;
    os_real_t product = (os_real_t)1;
    os_real_t exponent = (os_real_t)0;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        product *= (value[p] > low) ? os_fmin(value[p], high) : low;
        for (int32_t k = 0; (k < 32) && (product < low); ++k) {
            product *= (os_real_t)0x1p32;
            exponent -= (os_real_t)32;
        }
        for (int32_t k = 0; (k < 32) && (product > high); ++k) {
            product *= (os_real_t)0x1p-32;
            exponent += (os_real_t)32;
        }
    }
    for (int32_t k = 0; (k < 32) && (product < (os_real_t)1); ++k) {
        product *= (os_real_t)0x1p32;
        exponent -= (os_real_t)32;
    }
    for (int32_t k = 0; (k < 32) && (product >= (os_real_t)0x1p32); ++k) {
        product *= (os_real_t)0x1p-32;
        exponent += (os_real_t)32;
    }
    os_real_t power = (os_real_t)0x1p16;
    os_real_t count = (os_real_t)16;
    for (int32_t k = 0; k < 5; ++k) {
        if (product >= power) {
            product /= power;
            exponent += count;
        }
        power = os_sqrt(power);
        count *= (os_real_t)0.5;
    }
    const os_real_t s = (product - (os_real_t)1.4142135623730951) / (product + (os_real_t)1.4142135623730951);
    const os_real_t square = s * s;
    os_real_t series = (os_real_t)0;
    for (int32_t odd = 23; odd > 1; odd -= 2) {
        series = (series + ((os_real_t)1 / (os_real_t)odd)) * square;
    }
    const os_real_t whole = (exponent + (os_real_t)0.5) * (os_real_t)0.6931471805599453;
    return whole + ((os_real_t)2 * (s + (s * series)));
}

static void KERNEL_measure(const KERNEL_work_t *work, KERNEL_point_t *point)
{
    point->log_sum = KERNEL_log_sum(point->slack);
    point->misfit = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        point->misfit += os_fabs((point->row[i] - (work->width[i] * point->gamma)) + point->slack[i]);
    }
}

static os_real_t KERNEL_merit(const KERNEL_work_t *work, const KERNEL_point_t *point, os_real_t mu)
{
    return (point->gamma - (mu * point->log_sum)) + (work->penalty * point->misfit);
}

/* Derivative of the merit along the step, where the misfit shrinks with the length of the step. */
static os_real_t KERNEL_slope(const KERNEL_work_t *work, const KERNEL_step_t *step, os_real_t mu)
{
    os_real_t barrier = (os_real_t)0;
    for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
        barrier += step->slack[p] * work->inverse[p];
    }
    return (step->v[KERNEL_N] - (mu * barrier)) - (work->penalty * work->now.misfit);
}

/* Distances to the bounds that are there; 1 for the others, which then count nowhere. False where one is not positive. */
static bool KERNEL_measure_gaps(const KERNEL_work_t *work, KERNEL_point_t *point)
{
    bool inside = true;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const int32_t lower = KERNEL_ROWS + j;
        const int32_t upper = lower + KERNEL_N;
        point->slack[lower] = work->present[lower] ? (point->x[j] - work->lower[j]) : (os_real_t)1;
        point->slack[upper] = work->present[upper] ? (work->upper[j] - point->x[j]) : (os_real_t)1;
        inside = inside && (point->slack[lower] > (os_real_t)0) && (point->slack[upper] > (os_real_t)0);
    }
    return inside;
}

/* Values of the rows at a point; false where one is not finite. */
static bool KERNEL_evaluate(KERNEL_work_t *work, KERNEL_point_t *point)
{
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        work->argument[j] = point->x[j];
    }
    KERNEL_rows_leaf(work->argument, point->row);
    return os_all_finite(point->row, KERNEL_ROWS);
}
