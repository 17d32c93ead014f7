/* Unscented Kalman filter in loops: sigma points of P through f, of the predicted covariance through h, joint update. */

/*@sizes*/

/*@leaf f: N + U -> N */

/*@leaf h: N + U -> M */

/*@leaf restore: N -> N */

/*@leaf near: M + M -> M */

/*@leaf log: 1 -> 1 */

typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_U];
    os_real_t image[(2 * KERNEL_N) + 1][KERNEL_WIDTH];
    os_real_t shift[KERNEL_WIDTH];
    os_real_t factor[KERNEL_N * KERNEL_N];
    os_real_t covariance[KERNEL_N * KERNEL_N];
    os_real_t innovation_covariance[KERNEL_M * KERNEL_M];
    os_real_t innovation_factor[KERNEL_M * KERNEL_M];
    os_real_t gain[KERNEL_N][KERNEL_M];
    os_real_t mean[KERNEL_N];
    os_real_t state[KERNEL_N];
    os_real_t pair[2 * KERNEL_M];
    os_real_t innovation[KERNEL_M];
    os_real_t whitened[KERNEL_M];
} KERNEL_work_t;

/* Replace the lower triangle of a by its factor; false where a pivot is lost in rounding. */
static bool KERNEL_factorise(os_real_t *a, int32_t n)
{
    bool definite = true;
    for (int32_t j = 0; j < n; ++j) {
        const os_real_t least = ((os_real_t)4 * OS_EPSILON) * a[(j * n) + j];
        os_real_t inverse = (os_real_t)1;
        for (int32_t i = j; i < n; ++i) {
            os_real_t rest = a[(i * n) + j];
            for (int32_t k = 0; k < j; ++k) {
                rest -= a[(i * n) + k] * a[(j * n) + k];
            }
            if (i == j) {
                const bool usable = (rest > least) && (rest <= OS_REAL_MAX);
                definite = definite && usable;
                rest = os_sqrt(usable ? rest : (os_real_t)1);
                inverse = (os_real_t)1 / rest;
            } else {
                rest = rest * inverse;
            }
            a[(i * n) + j] = rest;
        }
    }
    return definite;
}

/* Replace b by the solution of L y = b. */
static void KERNEL_substitute(const os_real_t *L, os_real_t *b, int32_t n)
{
    for (int32_t i = 0; i < n; ++i) {
        os_real_t rest = b[i];
        for (int32_t k = 0; k < i; ++k) {
            rest -= L[(i * n) + k] * b[k];
        }
        b[i] = rest / L[(i * n) + i];
    }
}

/* Images under f or h of the centre, and of the other points relative to it; mean and covariance of all of them. */
static void KERNEL_transform(KERNEL_work_t *work, const os_real_t *u, bool moves, os_real_t *covariance)
{
    const int32_t size = moves ? KERNEL_N : KERNEL_M;
    for (int32_t i = 0; i < KERNEL_U; ++i) {
        work->argument[KERNEL_N + i] = u[i];
    }
    for (int32_t point = 0; point <= (2 * KERNEL_N); ++point) {
        const int32_t column = (point <= KERNEL_N) ? (point - 1) : (point - KERNEL_N - 1);
        const os_real_t distance = (point <= KERNEL_N) ? KERNEL_DISTANCE : -KERNEL_DISTANCE;
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            const bool moved = (column >= 0) && (column <= i);
            const os_real_t step = moved ? (distance * work->factor[(i * KERNEL_N) + column]) : (os_real_t)0;
            work->argument[i] = work->state[i] + step;
        }
        if (moves) {
            KERNEL_f_leaf(work->argument, work->image[point]);
        } else {
            KERNEL_h_leaf(work->argument, work->image[point]);
        }
    }
    for (int32_t i = 0; i < size; ++i) {
        os_real_t sum = (os_real_t)0;
        for (int32_t point = 1; point <= (2 * KERNEL_N); ++point) {
            work->image[point][i] -= work->image[0][i];
            sum += work->image[point][i];
        }
        work->shift[i] = sum * KERNEL_WEIGHT;
    }
    for (int32_t i = 0; i < size; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            os_real_t sum = (os_real_t)0;
            for (int32_t point = 1; point <= (2 * KERNEL_N); ++point) {
                sum += (work->image[point][i] - work->shift[i]) * (work->image[point][j] - work->shift[j]);
            }
            sum = (sum * KERNEL_WEIGHT) + (KERNEL_CENTRE * (work->shift[i] * work->shift[j]));
            covariance[(i * size) + j] = sum;
            covariance[(j * size) + i] = sum;
        }
    }
}

static void KERNEL_add_noise(os_real_t *covariance, const os_real_t *noise, int32_t n)
{
    for (int32_t i = 0; i < n; ++i) {
        for (int32_t j = (KERNEL_FULL == 1) ? 0 : i; j <= i; ++j) {
            const os_real_t sum = covariance[(i * n) + j] + noise[(KERNEL_FULL == 1) ? ((i * n) + j) : i];
            covariance[(i * n) + j] = sum;
            covariance[(j * n) + i] = sum;
        }
    }
}

static void KERNEL_copy(os_real_t *to, const os_real_t *from, int32_t n)
{
    for (int32_t i = 0; i < n; ++i) {
        to[i] = from[i];
    }
}

/* Mean and covariance after the step; false where a covariance was not positive definite. */
static bool KERNEL_predict(KERNEL_work_t *work, const os_real_t *x, const os_real_t *noise)
{
    KERNEL_copy(work->state, x, KERNEL_N);
    KERNEL_copy(work->factor, &x[KERNEL_N], KERNEL_N * KERNEL_N);
    const bool before = KERNEL_factorise(work->factor, KERNEL_N);
    KERNEL_transform(work, &x[KERNEL_N * (KERNEL_N + 1)], true, work->covariance);
    KERNEL_add_noise(work->covariance, noise, KERNEL_N);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->mean[i] = work->image[0][i] + work->shift[i];
    }
    KERNEL_restore_leaf(work->mean, work->state);
    KERNEL_copy(work->factor, work->covariance, KERNEL_N * KERNEL_N);
    const bool after = KERNEL_factorise(work->factor, KERNEL_N);
    return before && after;
}

/* Measurement into mean and covariance; false where the covariance of the innovation was not positive definite. */
static bool KERNEL_update(KERNEL_work_t *work, const os_real_t *u, const os_real_t *z, const os_real_t *noise)
{
    KERNEL_transform(work, u, false, work->innovation_covariance);
    KERNEL_add_noise(work->innovation_covariance, noise, KERNEL_M);
    KERNEL_copy(work->innovation_factor, work->innovation_covariance, KERNEL_M * KERNEL_M);
    const bool definite = KERNEL_factorise(work->innovation_factor, KERNEL_M);
    for (int32_t j = 0; j < KERNEL_M; ++j) {
        work->pair[j] = work->image[0][j] + work->shift[j];
        work->pair[KERNEL_M + j] = z[j];
    }
    KERNEL_near_leaf(work->pair, work->innovation);
    for (int32_t j = 0; j < KERNEL_M; ++j) {
        work->innovation[j] -= work->pair[j];
    }
    KERNEL_copy(work->whitened, work->innovation, KERNEL_M);
    KERNEL_substitute(work->innovation_factor, work->whitened, KERNEL_M);
    /* the deviations of the points are the columns of the factor */
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        os_real_t *gain = work->gain[i];
        for (int32_t j = 0; j < KERNEL_M; ++j) {
            os_real_t sum = (os_real_t)0;
            for (int32_t k = 0; k <= i; ++k) {
                const os_real_t apart = work->image[1 + k][j] - work->image[1 + KERNEL_N + k][j];
                sum += work->factor[(i * KERNEL_N) + k] * apart;
            }
            gain[j] = sum * KERNEL_CROSS;
        }
        KERNEL_substitute(work->innovation_factor, gain, KERNEL_M);
        os_real_t correction = (os_real_t)0;
        for (int32_t j = 0; j < KERNEL_M; ++j) {
            correction += gain[j] * work->whitened[j];
        }
        work->mean[i] = work->state[i] + correction;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            os_real_t sum = (os_real_t)0;
            for (int32_t k = 0; k < KERNEL_M; ++k) {
                sum += work->gain[i][k] * work->gain[j][k];
            }
            work->covariance[(i * KERNEL_N) + j] -= sum;
            work->covariance[(j * KERNEL_N) + i] = work->covariance[(i * KERNEL_N) + j];
        }
    }
    KERNEL_restore_leaf(work->mean, work->state);
    return definite;
}

static os_real_t KERNEL_log_likelihood(const KERNEL_work_t *work)
{
    os_real_t square = (os_real_t)0;
    os_real_t determinant = (os_real_t)0;
    for (int32_t j = 0; j < KERNEL_M; ++j) {
        os_real_t logarithm = (os_real_t)0;
        KERNEL_log_leaf(&work->innovation_factor[j * (KERNEL_M + 1)], &logarithm);
        determinant += logarithm;
        square += work->whitened[j] * work->whitened[j];
    }
    return -(((square / (os_real_t)2) + determinant) + KERNEL_OFFSET);
}

/* x: x (N), P (N, N), u (U), z (M), Q, R; y: x (N), P (N, N), innovation (M), S (M, M), log likelihood */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t *u = &x[KERNEL_N * (KERNEL_N + 1)];
    const os_real_t *z = &u[KERNEL_U];
    const os_real_t *Q = &z[KERNEL_M];
    const int32_t process = (KERNEL_FULL == 1) ? (KERNEL_N * KERNEL_N) : KERNEL_N;
    const int32_t measured = (KERNEL_FULL == 1) ? (KERNEL_M * KERNEL_M) : KERNEL_M;
    const os_real_t *R = &Q[process];
    const int32_t arguments = (KERNEL_N * (KERNEL_N + 1)) + KERNEL_U + KERNEL_M + process + measured;
    const int32_t results = (KERNEL_N * (KERNEL_N + 1)) + (KERNEL_M * (KERNEL_M + 1));
    os_status_t status = os_all_finite(x, arguments) ? OS_OK : OS_E_NOT_FINITE;
    if (status == OS_OK) {
        const bool predicted = KERNEL_predict(work, x, Q);
        const bool updated = KERNEL_update(work, u, z, R);
        status = (predicted && updated) ? OS_OK : OS_E_STATE;
    }
    if (status == OS_OK) {
        KERNEL_copy(y, work->state, KERNEL_N);
        KERNEL_copy(&y[KERNEL_N], work->covariance, KERNEL_N * KERNEL_N);
        KERNEL_copy(&y[KERNEL_N * (KERNEL_N + 1)], work->innovation, KERNEL_M);
        KERNEL_copy(&y[(KERNEL_N * (KERNEL_N + 1)) + KERNEL_M], work->innovation_covariance, KERNEL_M * KERNEL_M);
        y[results] = KERNEL_log_likelihood(work);
        status = os_all_finite(y, results + 1) ? OS_OK : OS_E_OUTPUT;
    }
    for (int32_t i = 0; (i <= results) && (status != OS_OK); ++i) {
        y[i] = (os_real_t)NAN;
    }
    return status;
}
