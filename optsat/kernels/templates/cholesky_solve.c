/* Cholesky: x of A x = b, A = U' U symmetric positive definite; of A the upper triangle is read. */

/*@sizes*/

typedef struct {
    os_real_t factor[KERNEL_PADDED][KERNEL_PADDED];
    os_real_t reciprocal[KERNEL_N];
    os_real_t rest[KERNEL_PADDED];
    os_real_t solution[KERNEL_PADDED];
} KERNEL_work_t;

/*@include lane_sums*/
/* Replace the rows of A by those of U; return the least ratio of a pivot to its diagonal, 0 where one is not usable. */
static os_real_t KERNEL_factorise(KERNEL_work_t *work)
{
    os_real_t least = (os_real_t)1;
    bool usable = true;
    for (int32_t j = 0; (j < KERNEL_N) && usable; ++j) {
        os_real_t rest[KERNEL_PADDED];
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            rest[i] = work->factor[j][i];
        }
        const os_real_t diagonal = rest[j];
        for (int32_t first = 0; first < j; first += KERNEL_GROUP) {
            /* several rows in one pass, those from j on times zero */
            os_real_t factor[KERNEL_GROUP];
            for (int32_t k = 0; k < KERNEL_GROUP; ++k) {
                factor[k] = ((first + k) < j) ? work->factor[first + k][j] : (os_real_t)0;
            }
            for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
                rest[i] = (((rest[i] - (work->factor[first][i] * factor[0])) - (work->factor[first + 1][i] * factor[1]))
                           - (work->factor[first + 2][i] * factor[2])) - (work->factor[first + 3][i] * factor[3]);
            }
        }
        const os_real_t pivot = rest[j];
        usable = (pivot > (((os_real_t)KERNEL_N * OS_EPSILON) * diagonal)) && (pivot <= OS_REAL_MAX);
        least = usable ? os_fmin(least, pivot / diagonal) : (os_real_t)0;
        work->reciprocal[j] = (os_real_t)1 / os_sqrt(usable ? pivot : (os_real_t)1);
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->factor[j][i] = rest[i] * work->reciprocal[j];
        }
        for (int32_t i = 0; i < j; ++i) {
            work->factor[j][i] = (os_real_t)0;
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
        const os_real_t forward = work->rest[k] * work->reciprocal[k];
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->rest[i] -= work->factor[k][i] * forward;
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
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            work->factor[i][j] = ((i < KERNEL_N) && (j < KERNEL_N)) ? x[(i * KERNEL_N) + j] : (os_real_t)0;
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
