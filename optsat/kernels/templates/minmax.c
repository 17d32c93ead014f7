/* Min-max: least gamma with row(x) <= width gamma and lower <= x <= upper, rows of width 0 being constraints.
   Primal-dual interior point in x and gamma, each row and each bound a pair of a slack and a multiplier. */

/*@sizes*/

typedef struct {
    os_real_t x[KERNEL_N];
    os_real_t gamma;
    os_real_t row[KERNEL_ROWS];
    os_real_t slack[KERNEL_PAIRS];
    os_real_t misfit;
    os_real_t log_sum;
} KERNEL_point_t;

typedef struct {
    os_real_t v[KERNEL_PADDED];
    os_real_t slack[KERNEL_PAIRS];
    os_real_t multiplier[KERNEL_PAIRS];
} KERNEL_step_t;

/* Pairs: the rows, the lower bounds, the upper bounds. Of x and gamma together there are V, in rows of length PADDED.
   derivative: values of the rows, their gradients (each followed by -width and padding), Hessian of their sum weighted
   by the multipliers, which becomes the matrix of the step. */
typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_PARAMETERS + KERNEL_ROWS];
    os_real_t derivative[KERNEL_ROWS + ((KERNEL_ROWS + KERNEL_V) * KERNEL_PADDED)];
    os_real_t width[KERNEL_ROWS];
    os_real_t lower[KERNEL_N];
    os_real_t upper[KERNEL_N];
    os_real_t multiplier[KERNEL_PAIRS];
    os_real_t product[KERNEL_PAIRS];
    os_real_t change[KERNEL_PAIRS];
    os_real_t gradient[KERNEL_PADDED];
    os_real_t dual_residual[KERNEL_PADDED];
    os_real_t row_residual[KERNEL_ROWS];
    os_real_t inverse[KERNEL_PAIRS];
    os_real_t rest[KERNEL_V][KERNEL_PADDED];
    os_real_t by_rows[KERNEL_V][KERNEL_PADDED];
    os_real_t by_columns[KERNEL_V][KERNEL_PADDED];
    os_real_t diagonal[KERNEL_V];
    os_real_t reciprocal[KERNEL_PADDED];
    os_real_t best_x[KERNEL_N];
    os_real_t best_gamma;
    os_real_t best_violation;
    os_real_t dual_error;
    os_real_t row_error;
    os_real_t gap;
    os_real_t error;
    os_real_t count;
    os_real_t damping;
    os_real_t penalty;
    os_real_t tolerance;
    os_real_t iterations;
    KERNEL_point_t now;
    KERNEL_point_t trial;
    KERNEL_step_t step;
    KERNEL_step_t second;
    bool present[KERNEL_PAIRS];
    bool fixed[KERNEL_N];
} KERNEL_work_t;

/*@leaf rows: N + PARAMETERS -> ROWS */
/*@leaf derivatives: N + PARAMETERS + ROWS -> ROWS + ROWS * PADDED + V * PADDED */
/*@leaf widths: PARAMETERS -> ROWS */
/*@include minmax_factor*/
/*@include minmax_merit*/
/*@include minmax_step*/
/*@include minmax_search*/
/*@include minmax_iterate*/
/*@include minmax_fallback*/
/* Arguments and bounds into the work memory; the status says what is wrong with them. */
static os_status_t KERNEL_read(const os_real_t *x, KERNEL_work_t *work)
{
    const os_real_t *bounds = &x[KERNEL_N + KERNEL_PARAMETERS];
    bool ordered = true;
    bool wide = false;
    work->count = (os_real_t)KERNEL_ROWS;
    for (int32_t k = 0; k < (KERNEL_N + KERNEL_PARAMETERS); ++k) {
        work->argument[k] = x[k];
    }
    KERNEL_widths_leaf(&x[KERNEL_N], work->width);
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        work->present[i] = true;
        wide = wide || (work->width[i] > (os_real_t)0);
    }
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        work->now.x[j] = x[j];
        work->lower[j] = bounds[j];
        work->upper[j] = bounds[KERNEL_N + j];
        ordered = ordered && (work->lower[j] <= work->upper[j]);
        /* closer bounds leave no room for numbers between them */
        const os_real_t size = os_fmax(os_fabs(work->lower[j]), os_fabs(work->upper[j]));
        work->fixed[j] = (work->upper[j] - work->lower[j]) <= (((os_real_t)256 * OS_EPSILON) * size);
        const bool lower = !work->fixed[j] && (work->lower[j] > -KERNEL_UNBOUNDED);
        const bool upper = !work->fixed[j] && (work->upper[j] < KERNEL_UNBOUNDED);
        work->present[KERNEL_ROWS + j] = lower;
        work->present[KERNEL_ROWS + KERNEL_N + j] = upper;
        work->count += (lower ? (os_real_t)1 : (os_real_t)0) + (upper ? (os_real_t)1 : (os_real_t)0);
    }
    os_status_t status = OS_OK;
    if (!os_all_finite(x, (3 * KERNEL_N) + KERNEL_PARAMETERS)) {
        status = OS_E_NOT_FINITE;
    } else if (!(ordered && wide)) {
        status = OS_E_RANGE;
    } else {
        status = OS_OK;
    }
    return status;
}

/* Slacks and multipliers at `now`, moved away from its bounds, so that the products of the pairs are alike and the
   multipliers of the rows fit gamma; false where a row is not finite there. */
static bool KERNEL_start(KERNEL_work_t *work)
{
    KERNEL_point_t *now = &work->now;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const os_real_t share = (os_real_t)0.01 * (work->upper[j] - work->lower[j]);
        const os_real_t low = (os_real_t)0.01 * os_fmax(os_fabs(work->lower[j]), (os_real_t)1);
        const os_real_t high = (os_real_t)0.01 * os_fmax(os_fabs(work->upper[j]), (os_real_t)1);
        if (work->present[KERNEL_ROWS + j]) {
            now->x[j] = os_fmax(now->x[j], work->lower[j] + os_fmin(low, share));
        }
        if (work->present[KERNEL_ROWS + KERNEL_N + j]) {
            now->x[j] = os_fmin(now->x[j], work->upper[j] - os_fmin(high, share));
        }
        if (work->fixed[j]) {
            now->x[j] = work->lower[j];
        }
    }
    const bool usable = KERNEL_measure_gaps(work, now) && KERNEL_evaluate(work, now);
    if (usable) {
        KERNEL_remember(work, now);
        os_real_t most = -OS_REAL_MAX;
        os_real_t least = OS_REAL_MAX;
        for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
            if (work->width[i] > (os_real_t)0) {
                most = os_fmax(now->row[i] / work->width[i], most);
                least = os_fmin(now->row[i] / work->width[i], least);
            }
        }
        now->gamma = most + ((os_real_t)0.1 * ((os_real_t)1 + (most - least)));
        os_real_t sum = (os_real_t)0;
        for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
            const os_real_t fitting = (work->width[i] * now->gamma) - now->row[i];
            now->slack[i] = (work->width[i] > (os_real_t)0) ? fitting : os_fmax(fitting, (os_real_t)0.1);
            sum += work->width[i] / now->slack[i];
        }
        for (int32_t p = 0; p < KERNEL_PAIRS; ++p) {
            work->multiplier[p] = work->present[p] ? (((os_real_t)1 / sum) / now->slack[p]) : (os_real_t)0;
        }
        KERNEL_measure(work, now);
        work->damping = (os_real_t)0;
        work->penalty = (os_real_t)1;
    }
    return usable;
}

/* What is missed of the optimality conditions at `now`, from the derivatives there, with gamma as attained by the
   objectives and the slacks as the rows leave them. */
static os_real_t KERNEL_verify(KERNEL_work_t *work)
{
    KERNEL_point_t *now = &work->now;
    now->gamma = -OS_REAL_MAX;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        now->row[i] = work->derivative[i];
        if (work->width[i] > (os_real_t)0) {
            now->gamma = os_fmax(now->row[i] / work->width[i], now->gamma);
        }
    }
    os_real_t residual = work->dual_error;
    os_real_t gap = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
        const os_real_t slack = (work->width[i] * now->gamma) - now->row[i];
        if (!(work->width[i] > (os_real_t)0)) {
            residual = os_fmax(now->row[i], residual);
        }
        gap += os_fabs(work->multiplier[i] * slack);
    }
    for (int32_t p = KERNEL_ROWS; p < KERNEL_PAIRS; ++p) {
        gap += work->product[p];
    }
    residual = os_fmax(gap / ((os_real_t)1 + os_fabs(now->gamma)), residual);
    const bool known = os_all_finite(work->derivative, KERNEL_ROWS * (KERNEL_PADDED + 1)) && (residual <= OS_REAL_MAX);
    return known ? residual : OS_REAL_MAX;
}

static void KERNEL_write(const KERNEL_work_t *work, os_status_t status, os_real_t residual, os_real_t *y)
{
    const int32_t bounds = KERNEL_N + 1 + KERNEL_ROWS;
    if ((status == OS_OK) || (status == OS_E_NOT_CONVERGED)) {
        /* after an overflow there are none */
        const bool finite = os_all_finite(work->multiplier, KERNEL_PAIRS) && os_all_finite(work->gradient, KERNEL_N);
        for (int32_t j = 0; j < KERNEL_N; ++j) {
            const os_real_t pull = work->multiplier[KERNEL_ROWS + j] - work->multiplier[KERNEL_ROWS + KERNEL_N + j];
            y[j] = work->now.x[j];
            y[bounds + j] = finite ? (work->fixed[j] ? work->gradient[j] : pull) : (os_real_t)0;
        }
        y[KERNEL_N] = work->now.gamma;
        for (int32_t i = 0; i < KERNEL_ROWS; ++i) {
            y[KERNEL_N + 1 + i] = finite ? work->multiplier[i] : (os_real_t)0;
        }
        y[bounds + KERNEL_N] = residual;
    } else {
        for (int32_t k = 0; k <= (bounds + KERNEL_N); ++k) {
            y[k] = (os_real_t)NAN;
        }
    }
    y[bounds + KERNEL_N + 1] = work->iterations;
}

/* x: start (N), parameters, lower and upper bounds (N each);
   y: x (N), gamma, multipliers of the rows, of the bounds (N), residual, iterations */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    os_real_t residual = OS_REAL_MAX;
    os_status_t status = KERNEL_read(x, work);
    work->tolerance = (os_real_t)0.5 * os_sqrt(OS_EPSILON);
    work->iterations = (os_real_t)0;
    work->best_gamma = OS_REAL_MAX;
    work->best_violation = OS_REAL_MAX;
    if ((status == OS_OK) && !KERNEL_start(work)) {
        status = OS_E_NOT_FINITE;
    }
    if (status == OS_OK) {
        KERNEL_iterate(work);
        residual = KERNEL_verify(work);
        if (!(residual <= work->tolerance)) {
            KERNEL_fall_back(work);
            for (int32_t j = 0; j < KERNEL_N; ++j) {
                work->now.x[j] = work->best_x[j];
            }
            (void)KERNEL_start(work);
            KERNEL_iterate(work);
            residual = KERNEL_verify(work);
        }
        if (!(residual <= work->tolerance)) {
            for (int32_t j = 0; j < KERNEL_N; ++j) {
                work->now.x[j] = work->best_x[j];
            }
            (void)KERNEL_measure_gaps(work, &work->now);
            KERNEL_residuals(work);
            residual = KERNEL_verify(work);
        }
        status = (residual <= work->tolerance) ? OS_OK : OS_E_NOT_CONVERGED;
    }
    KERNEL_write(work, status, residual, y);
    return status;
}
