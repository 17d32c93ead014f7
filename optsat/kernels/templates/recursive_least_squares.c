/* Recursive least squares: a measurement z = h . theta + noise brought into an estimate and its covariance. */

/*@sizes*/

typedef struct {
    os_real_t theta[KERNEL_PADDED];
    os_real_t row[KERNEL_PADDED];
    os_real_t gain[KERNEL_PADDED];
    os_real_t covariance[KERNEL_N * KERNEL_N];
} KERNEL_work_t;

/*@include lane_sums*/
/* x: theta (N), P (N, N), h (N), z, variance, forgetting; y: theta (N), P (N, N), innovation, its variance */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t *P = &x[KERNEL_N];
    const os_real_t *h = &P[KERNEL_N * KERNEL_N];
    const os_real_t z = h[KERNEL_N];
    const os_real_t variance = h[KERNEL_N + 1];
    const os_real_t forgetting = h[KERNEL_N + 2];
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        work->theta[i] = (i < KERNEL_N) ? x[i] : (os_real_t)0;
        work->row[i] = (i < KERNEL_N) ? h[i] : (os_real_t)0;
        work->gain[i] = (os_real_t)0;
    }
    os_real_t sum[KERNEL_N];
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        sum[i] = (os_real_t)0;
    }
    for (int32_t k = 0; k < KERNEL_N; ++k) {
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            sum[i] += P[(k * KERNEL_N) + i] * work->row[k];
        }
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->gain[i] = sum[i];
        sum[i] = (os_real_t)0;
    }
    const os_real_t innovation = z - KERNEL_dot(work->row, work->theta);
    const os_real_t spread = (forgetting * variance) + KERNEL_dot(work->row, work->gain);
    const bool allowed = (variance > (os_real_t)0) && (forgetting > (os_real_t)0) && (forgetting <= (os_real_t)1);
    const bool usable = allowed && (spread > (os_real_t)0) && (spread <= OS_REAL_MAX);
    const os_real_t scale = (os_real_t)1 / os_sqrt(usable ? spread : (os_real_t)1);
    const os_real_t inflation = (os_real_t)1 / (usable ? forgetting : (os_real_t)1);
    const os_real_t step = innovation * scale;
    /* products of two entries of one vector keep the covariance symmetric to the bit */
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->gain[i] *= scale;
        work->theta[i] += work->gain[i] * step;
    }
    bool positive = true;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        for (int32_t j = 0; j < KERNEL_N; ++j) {
            const int32_t place = (i * KERNEL_N) + j;
            work->covariance[place] = (P[place] - (work->gain[i] * work->gain[j])) * inflation;
            sum[j] += work->covariance[place];
        }
        positive = positive && (work->covariance[i * (KERNEL_N + 1)] > (os_real_t)0);
    }
    /* a sum is finite only where all of its terms are */
    const bool finite = os_all_finite(work->theta, KERNEL_N) && os_all_finite(sum, KERNEL_N);
    os_status_t status = OS_OK;
    if (!(usable && finite && positive)) {
        if (!os_all_finite(x, (KERNEL_N * (KERNEL_N + 2)) + 3)) {
            status = OS_E_NOT_FINITE;
        } else if (!allowed) {
            status = OS_E_RANGE;
        } else {
            status = (finite && (spread <= OS_REAL_MAX)) ? OS_E_STATE : OS_E_OUTPUT;
        }
    }
    const bool good = status == OS_OK;
    const int32_t covered = KERNEL_N * (KERNEL_N + 1);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = good ? work->theta[i] : (os_real_t)NAN;
    }
    for (int32_t i = 0; i < (KERNEL_N * KERNEL_N); ++i) {
        y[KERNEL_N + i] = good ? work->covariance[i] : (os_real_t)NAN;
    }
    y[covered] = good ? innovation : (os_real_t)NAN;
    y[covered + 1] = (good ? (spread * inflation) : (os_real_t)NAN);
    return status;
}
