/* Factor: L D L' of the matrix of a step, positive definite or refused. Lower triangles are packed by rows. */
static int32_t KERNEL_at(int32_t row, int32_t column)
{
    return ((row * (row + 1)) / 2) + column;
}

/* Factor matrix + damping I; false where a pivot is not safely positive, so that the inertia is not that of a minimum. */
static bool KERNEL_factor(KERNEL_work_t *work, os_real_t damping)
{
    os_real_t rest[KERNEL_V];
    os_real_t *factor = work->factor;
    bool positive = true;
    for (int32_t i = 0; (i < KERNEL_V) && positive; ++i) {
        const os_real_t diagonal = work->matrix[KERNEL_at(i, i)] + damping;
        os_real_t pivot = diagonal;
        for (int32_t j = 0; j < i; ++j) {
            os_real_t left = work->matrix[KERNEL_at(i, j)];
            for (int32_t k = 0; k < j; ++k) {
                left -= rest[k] * factor[KERNEL_at(j, k)];
            }
            rest[j] = left;
            factor[KERNEL_at(i, j)] = left * work->reciprocal[j];
            pivot -= left * factor[KERNEL_at(i, j)];
        }
        positive = pivot > (((os_real_t)16 * OS_EPSILON) * os_fabs(diagonal));
        work->reciprocal[i] = (os_real_t)1 / pivot;
    }
    return positive;
}

/* Replace b by the solution. */
static void KERNEL_solve(const KERNEL_work_t *work, os_real_t *b)
{
    const os_real_t *factor = work->factor;
    for (int32_t i = 1; i < KERNEL_V; ++i) {
        for (int32_t k = 0; k < i; ++k) {
            b[i] -= factor[KERNEL_at(i, k)] * b[k];
        }
    }
    for (int32_t i = 0; i < KERNEL_V; ++i) {
        b[i] *= work->reciprocal[i];
    }
    for (int32_t i = KERNEL_V - 1; i > 0; --i) {
        for (int32_t k = 0; k < i; ++k) {
            b[k] -= factor[KERNEL_at(i, k)] * b[i];
        }
    }
}

/* Take a variable out of the step: its row and column become those of the identity. */
static void KERNEL_freeze(KERNEL_work_t *work, int32_t j)
{
    for (int32_t k = 0; k < KERNEL_V; ++k) {
        work->matrix[(k < j) ? KERNEL_at(j, k) : KERNEL_at(k, j)] = (k == j) ? (os_real_t)1 : (os_real_t)0;
    }
}

/* Add d a a' over the row a = (gradient of row i, -width) to the matrix. */
static void KERNEL_add_row(KERNEL_work_t *work, int32_t i, os_real_t d)
{
    const os_real_t *gradient = &work->derivative[KERNEL_ROWS + (i * KERNEL_N)];
    const os_real_t width = d * work->width[i];
    os_real_t *matrix = work->matrix;
    for (int32_t j = 0; j < KERNEL_N; ++j) {
        const os_real_t scaled = d * gradient[j];
        os_real_t *row = &matrix[KERNEL_at(j, 0)];
        for (int32_t k = 0; k <= j; ++k) {
            row[k] += scaled * gradient[k];
        }
        matrix[KERNEL_at(KERNEL_N, j)] -= width * gradient[j];
    }
    matrix[KERNEL_at(KERNEL_N, KERNEL_N)] += width * work->width[i];
}
