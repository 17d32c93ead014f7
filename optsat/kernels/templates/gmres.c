/* GMRES: x of A x = b by restarted generalised minimal residuals; what is reported is b - A x itself. */

/*@sizes*/

typedef struct {
    os_real_t columns[KERNEL_PADDED][KERNEL_PADDED];
    os_real_t basis[KERNEL_M + KERNEL_GROUP][KERNEL_PADDED];
    os_real_t triangle[KERNEL_M][KERNEL_M + KERNEL_GROUP];
    os_real_t cosine[KERNEL_M];
    os_real_t sine[KERNEL_M];
    os_real_t reduced[KERNEL_M + 1];
    os_real_t given[KERNEL_PADDED];
    os_real_t point[KERNEL_PADDED];
    os_real_t rest[KERNEL_PADDED];
    os_real_t best[KERNEL_PADDED];
} KERNEL_work_t;

/*@include lane_sums*/
/* Length without overflow or underflow of the squares. */
static os_real_t KERNEL_length(const os_real_t *a, os_real_t *scaled)
{
    os_real_t largest = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        largest = os_fmax(largest, os_fabs(a[i]));
    }
    const os_real_t unit = (largest > (os_real_t)0) ? largest : (os_real_t)1;
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        scaled[i] = a[i] / unit;
    }
    return unit * os_sqrt(KERNEL_dot(scaled, scaled));
}

static void KERNEL_multiply(const KERNEL_work_t *work, const os_real_t *factor, os_real_t *product)
{
    os_real_t sum[KERNEL_PADDED];
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        sum[i] = (os_real_t)0;
    }
    for (int32_t first = 0; first < KERNEL_PADDED; first += KERNEL_GROUP) {
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            sum[i] = (((sum[i] + (work->columns[first][i] * factor[first]))
                       + (work->columns[first + 1][i] * factor[first + 1]))
                      + (work->columns[first + 2][i] * factor[first + 2]))
                     + (work->columns[first + 3][i] * factor[first + 3]);
        }
    }
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        product[i] = sum[i];
    }
}

static void KERNEL_find_rest(KERNEL_work_t *work)
{
    KERNEL_multiply(work, work->point, work->rest);
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        work->rest[i] = work->given[i] - work->rest[i];
    }
}

/* Extend the basis by A times its vector j, orthogonal to the others; false where nothing new is left to add.
   Vectors are taken off in groups, the basis beyond j being zero. */
static bool KERNEL_extend(KERNEL_work_t *work, int32_t j)
{
    os_real_t fresh[KERNEL_PADDED];
    os_real_t *column = work->triangle[j];
    KERNEL_multiply(work, work->basis[j], fresh);
    const os_real_t before = os_sqrt(KERNEL_dot(fresh, fresh));
    for (int32_t first = 0; first <= j; first += KERNEL_GROUP) {
        for (int32_t i = 0; i < KERNEL_GROUP; ++i) {
            column[first + i] = KERNEL_dot(fresh, work->basis[first + i]);
        }
        for (int32_t k = 0; k < KERNEL_PADDED; ++k) {
            fresh[k] = (((fresh[k] - (work->basis[first][k] * column[first]))
                         - (work->basis[first + 1][k] * column[first + 1]))
                        - (work->basis[first + 2][k] * column[first + 2]))
                       - (work->basis[first + 3][k] * column[first + 3]);
        }
    }
    const os_real_t below = os_sqrt(KERNEL_dot(fresh, fresh));
    for (int32_t i = 0; i < j; ++i) {
        const os_real_t upper = (work->cosine[i] * column[i]) + (work->sine[i] * column[i + 1]);
        column[i + 1] = (work->cosine[i] * column[i + 1]) - (work->sine[i] * column[i]);
        column[i] = upper;
    }
    const os_real_t radius = os_sqrt((column[j] * column[j]) + (below * below));
    const bool usable = radius > (((os_real_t)KERNEL_N * OS_EPSILON) * before);
    if (usable) {
        work->cosine[j] = column[j] / radius;
        work->sine[j] = below / radius;
        column[j] = radius;
        work->reduced[j + 1] = -(work->sine[j] * work->reduced[j]);
        work->reduced[j] = work->cosine[j] * work->reduced[j];
        const os_real_t scale = (os_real_t)1 / ((below > (os_real_t)0) ? below : (os_real_t)1);
        for (int32_t k = 0; k < KERNEL_PADDED; ++k) {
            work->basis[j + 1][k] = fresh[k] * scale;
        }
    }
    return usable;
}

/* One cycle from the point, whose rest has the length given; the number of columns used. */
static int32_t KERNEL_cycle(KERNEL_work_t *work, os_real_t length, os_real_t enough)
{
    int32_t used = 0;
    bool more = true;
    for (int32_t j = 0; j < (KERNEL_M + KERNEL_GROUP); ++j) {
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->basis[j][i] = (j == 0) ? (work->rest[i] / length) : (os_real_t)0;
        }
    }
    work->reduced[0] = length;
    for (int32_t j = 0; (j < KERNEL_M) && more; ++j) {
        more = KERNEL_extend(work, j);
        used += more ? 1 : 0;
        more = more && (os_fabs(work->reduced[j + 1]) > enough);
    }
    for (int32_t i = used - 1; i >= 0; --i) {
        os_real_t sum = work->reduced[i];
        for (int32_t k = i + 1; k < used; ++k) {
            sum -= work->triangle[k][i] * work->reduced[k];
        }
        work->reduced[i] = sum / work->triangle[i][i];
    }
    for (int32_t j = 0; j < used; ++j) {
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->point[i] += work->basis[j][i] * work->reduced[j];
        }
    }
    return used;
}

/* x: A (N, N), b (N), tolerance; y: x (N), |b - A x| / |b|, iterations */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t tolerance = x[KERNEL_N * (KERNEL_N + 1)];
    for (int32_t k = 0; k < KERNEL_PADDED; ++k) {
        for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
            work->columns[k][i] = ((i < KERNEL_N) && (k < KERNEL_N)) ? x[(i * KERNEL_N) + k] : (os_real_t)0;
        }
    }
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        work->given[i] = (i < KERNEL_N) ? x[(KERNEL_N * KERNEL_N) + i] : (os_real_t)0;
        work->point[i] = (os_real_t)0;
        work->best[i] = (os_real_t)0;
    }
    os_real_t length = KERNEL_length(work->given, work->basis[0]);
    const os_real_t whole = (length > (os_real_t)0) ? length : (os_real_t)1;
    os_real_t residual = length / whole;
    os_real_t iterations = (os_real_t)0;
    bool more = (residual > tolerance) && (length <= OS_REAL_MAX);
    for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
        work->rest[i] = work->given[i];
    }
    for (int32_t cycle = 0; (cycle < KERNEL_CYCLES) && more; ++cycle) {
        const int32_t used = KERNEL_cycle(work, length, tolerance * whole);
        iterations += (os_real_t)used;
        KERNEL_find_rest(work);
        length = KERNEL_length(work->rest, work->basis[0]);
        const bool better = (length / whole) < residual;
        if (better) {
            residual = length / whole;
            for (int32_t i = 0; i < KERNEL_PADDED; ++i) {
                work->best[i] = work->point[i];
            }
        }
        more = better && (residual > tolerance);
    }
    os_status_t status = (residual <= tolerance) ? OS_OK : OS_E_NOT_CONVERGED;
    if (!os_all_finite(x, (KERNEL_N * (KERNEL_N + 1)) + 1)) {
        status = OS_E_NOT_FINITE;
    } else if (!(tolerance > (os_real_t)0)) {
        status = OS_E_RANGE;
    } else if (!os_all_finite(work->best, KERNEL_N)) {
        status = OS_E_OUTPUT;
    } else {
        /* as found above */
    }
    const bool known = (status == OS_OK) || (status == OS_E_NOT_CONVERGED);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = known ? work->best[i] : (os_real_t)NAN;
    }
    y[KERNEL_N] = known ? residual : (os_real_t)NAN;
    y[KERNEL_N + 1] = iterations;
    return status;
}
