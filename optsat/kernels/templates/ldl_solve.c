/* LDL: x of A x = b, A = U' D U symmetric, refined once and checked; of A the upper triangle is read. */

/*@sizes*/

typedef struct {
    os_real_t matrix[KERNEL_N][KERNEL_PADDED];
    os_real_t factor[KERNEL_N][KERNEL_PADDED];
    os_real_t pivot[KERNEL_N];
    os_real_t reciprocal[KERNEL_N];
    os_real_t given[KERNEL_PADDED];
    os_real_t rest[KERNEL_PADDED];
    os_real_t correction[KERNEL_PADDED];
    os_real_t solution[KERNEL_PADDED];
} KERNEL_work_t;

/*@include lane_sums*/
static os_real_t KERNEL_largest(const os_real_t *row, int32_t begin)
{
    os_real_t largest = (os_real_t)0;
    for (int32_t i = begin; i < KERNEL_PADDED; ++i) {
        largest = os_fmax(largest, os_fabs(row[i]));
    }
    return largest;
}

/* No interchanges: each pivot must stand out of the rounding of its row. */
static bool KERNEL_factorise(KERNEL_work_t *work)
{
    bool usable = true;
    for (int32_t j = 0; (j < KERNEL_N) && usable; ++j) {
        os_real_t *row = work->factor[j];
        for (int32_t begin = j - (j % KERNEL_LANES); begin < KERNEL_PADDED; begin += KERNEL_LANES) {
            os_real_t rest[KERNEL_LANES];
            for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
                rest[lane] = work->matrix[j][begin + lane];
            }
            for (int32_t k = 0; k < j; ++k) {
                const os_real_t *above = &work->factor[k][begin];
                const os_real_t factor = work->factor[k][j] * work->pivot[k];
                for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
                    rest[lane] -= above[lane] * factor;
                }
            }
            for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
                row[begin + lane] = rest[lane];
            }
        }
        const os_real_t least = ((os_real_t)KERNEL_N * OS_EPSILON) * KERNEL_largest(row, j);
        work->pivot[j] = row[j];
        usable = (os_fabs(row[j]) > least) && (os_fabs(row[j]) <= OS_REAL_MAX);
        work->reciprocal[j] = (os_real_t)1 / (usable ? row[j] : (os_real_t)1);
        for (int32_t i = 0; i < j; ++i) {
            row[i] = (os_real_t)0;
        }
        row[j] = (os_real_t)1;
        for (int32_t i = j + 1; i < KERNEL_PADDED; ++i) {
            row[i] *= work->reciprocal[j];
        }
    }
    return usable;
}

/* Add A^-1 rest to the solution. */
static void KERNEL_correct(KERNEL_work_t *work)
{
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        work->correction[i] = (os_real_t)0;
    }
    for (int32_t k = 0; k < KERNEL_N; ++k) {
        const os_real_t forward = work->rest[k];
        for (int32_t i = k + 1; i < KERNEL_PADDED; ++i) {
            work->rest[i] -= work->factor[k][i] * forward;
        }
    }
    for (int32_t k = KERNEL_N - 1; k >= 0; --k) {
        const os_real_t known = KERNEL_dot(work->factor[k], work->correction);
        work->correction[k] = (work->rest[k] * work->reciprocal[k]) - known;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->solution[i] += work->correction[i];
    }
}

/* Let rest be b - A solution. */
static void KERNEL_find_rest(KERNEL_work_t *work)
{
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        work->rest[i] = work->given[i];
    }
    for (int32_t k = 0; k < KERNEL_N; ++k) {
        const os_real_t known = work->solution[k];
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->rest[i] -= work->matrix[k][i] * known;
        }
    }
}

/* The rest over what rounding alone may leave: |A| |x| + |b|, largest entries and row sums. */
static os_real_t KERNEL_relative_rest(const KERNEL_work_t *work)
{
    os_real_t widest = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        os_real_t sum = (os_real_t)0;
        for (int32_t k = 0; k < KERNEL_N; ++k) {
            sum += os_fabs(work->matrix[i][k]);
        }
        widest = os_fmax(widest, sum);
    }
    const os_real_t rest = KERNEL_largest(work->rest, 0);
    const os_real_t scale = (widest * KERNEL_largest(work->solution, 0)) + KERNEL_largest(work->given, 0);
    return rest / ((scale > (os_real_t)0) ? scale : (os_real_t)1);
}

/* x: A (N, N), b (N); y: x (N), relative residual, number of negative pivots */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            const int32_t place = (j < i) ? ((j * KERNEL_N) + i) : ((i * KERNEL_N) + j);
            work->matrix[i][j] = (j < KERNEL_N) ? x[place] : (os_real_t)0;
        }
    }
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        work->given[j] = (j < KERNEL_N) ? x[(KERNEL_N * KERNEL_N) + j] : (os_real_t)0;
        work->solution[j] = (os_real_t)0;
    }
    const bool usable = KERNEL_factorise(work);
    os_status_t status = OS_E_RANGE;
    os_real_t residual = (os_real_t)NAN;
    os_real_t negative = (os_real_t)NAN;
    if (usable) {
        for (int32_t pass = 0; pass < 2; ++pass) {
            KERNEL_find_rest(work);
            KERNEL_correct(work);
        }
        KERNEL_find_rest(work);
        residual = KERNEL_relative_rest(work);
        negative = (os_real_t)0;
        for (int32_t k = 0; k < KERNEL_N; ++k) {
            negative += (work->pivot[k] < (os_real_t)0) ? (os_real_t)1 : (os_real_t)0;
        }
        status = (residual <= ((os_real_t)(4 * KERNEL_N) * OS_EPSILON)) ? OS_OK : OS_E_NOT_CONVERGED;
        if (!os_all_finite(work->solution, KERNEL_N)) {
            status = OS_E_OUTPUT;
        }
    }
    if ((status != OS_OK) && !os_all_finite(x, KERNEL_N * (KERNEL_N + 1))) {
        status = OS_E_NOT_FINITE;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = ((status == OS_OK) || (status == OS_E_NOT_CONVERGED)) ? work->solution[i] : (os_real_t)NAN;
    }
    y[KERNEL_N] = residual;
    y[KERNEL_N + 1] = negative;
    return status;
}
