/* Cholesky: x of A x = b, A = U' U symmetric positive definite; of A the upper triangle is read. */

/*@sizes*/

typedef struct {
    os_real_t factor[KERNEL_N][KERNEL_PADDED];
    os_real_t reciprocal[KERNEL_N];
    os_real_t rest[KERNEL_PADDED];
    os_real_t solution[KERNEL_PADDED];
} KERNEL_work_t;

/*@include lane_sums*/
/* Replace the rows of A by those of U; return the least ratio of a pivot to its diagonal, 0 where one is not usable. */
static os_real_t KERNEL_factorise(KERNEL_work_t *work)
{
    os_real_t least = (os_real_t)1;
    for (int32_t j = 0; (j < KERNEL_N) && (least > (os_real_t)0); ++j) {
        os_real_t *row = work->factor[j];
        const os_real_t diagonal = row[j];
        for (int32_t begin = j - (j % KERNEL_LANES); begin < KERNEL_PADDED; begin += KERNEL_LANES) {
            os_real_t rest[KERNEL_LANES];
            for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
                rest[lane] = row[begin + lane];
            }
            for (int32_t k = 0; k < j; ++k) {
                const os_real_t *above = &work->factor[k][begin];
                const os_real_t factor = work->factor[k][j];
                for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
                    rest[lane] -= above[lane] * factor;
                }
            }
            for (int32_t lane = 0; lane < KERNEL_LANES; ++lane) {
                row[begin + lane] = rest[lane];
            }
        }
        const os_real_t pivot = row[j];
        const bool usable = (pivot > (((os_real_t)KERNEL_N * OS_EPSILON) * diagonal)) && (pivot <= OS_REAL_MAX);
        least = usable ? os_fmin(least, pivot / diagonal) : (os_real_t)0;
        work->reciprocal[j] = (os_real_t)1 / os_sqrt(usable ? pivot : (os_real_t)1);
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            row[i] = (i < j) ? (os_real_t)0 : (row[i] * work->reciprocal[j]);
        }
    }
    return least;
}

static void KERNEL_substitute(KERNEL_work_t *work)
{
    for (int32_t k = 0; k < KERNEL_N; ++k) {
        work->solution[k] = (os_real_t)0;
    }
    for (int32_t k = 0; k < KERNEL_N; ++k) {
        const os_real_t *row = work->factor[k];
        const os_real_t forward = work->rest[k] * work->reciprocal[k];
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->rest[i] -= row[i] * forward;
        }
        work->rest[k] = forward;
    }
    for (int32_t k = KERNEL_N - 1; k >= 0; --k) {
        const os_real_t known = KERNEL_dot(work->factor[k], work->solution);
        work->solution[k] = (work->rest[k] - known) * work->reciprocal[k];
    }
}

/* x: A (N, N), b (N); y: x (N), least ratio of a pivot to its diagonal */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    os_status_t status = OS_OK;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            work->factor[i][j] = (j < KERNEL_N) ? x[(i * KERNEL_N) + j] : (os_real_t)0;
        }
    }
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        work->rest[j] = (j < KERNEL_N) ? x[(KERNEL_N * KERNEL_N) + j] : (os_real_t)0;
        work->solution[j] = (os_real_t)0;
    }
    const os_real_t least = KERNEL_factorise(work);
    if (least > (os_real_t)0) {
        KERNEL_substitute(work);
        status = os_all_finite(work->solution, KERNEL_N) ? OS_OK : OS_E_OUTPUT;
    } else {
        status = OS_E_RANGE;
    }
    if ((status != OS_OK) && !os_all_finite(x, KERNEL_N * (KERNEL_N + 1))) {
        status = OS_E_NOT_FINITE;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = (status == OS_OK) ? work->solution[i] : (os_real_t)NAN;
    }
    y[KERNEL_N] = least;
    return status;
}
