/* Factor: L D L' of the matrix of a step, positive definite or refused. Loops have one length, zeros included, so that
   they run in lanes. */

static os_real_t *KERNEL_matrix(KERNEL_work_t *work)
{
    return &work->derivative[KERNEL_ROWS + (KERNEL_ROWS * KERNEL_PADDED)];
}

/* Factor matrix + damping I; false where a pivot is not safely positive, so that the inertia is not that of a minimum. */
static bool KERNEL_factor(KERNEL_work_t *work, os_real_t damping)
{
    const os_real_t *matrix = KERNEL_matrix(work);
    bool positive = true;
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        work->reciprocal[j] = (os_real_t)0;
    }
    for (int32_t i = 0; i < KERNEL_V; ++i) {
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            work->rest[i][j] = matrix[(i * KERNEL_PADDED) + j] + ((j == i) ? damping : (os_real_t)0);
            work->by_rows[i][j] = (os_real_t)0;
            work->by_columns[i][j] = (os_real_t)0;
        }
        work->diagonal[i] = work->rest[i][i];
    }
    for (int32_t k = 0; (k < KERNEL_V) && positive; ++k) {
        os_real_t column[KERNEL_PADDED] = { (os_real_t)0 };
        const os_real_t pivot = work->rest[k][k];
        positive = pivot > (((os_real_t)16 * OS_EPSILON) * os_fabs(work->diagonal[k]));
        work->reciprocal[k] = (os_real_t)1 / pivot;
        for (int32_t i = k + 1; i < KERNEL_V; ++i) {
            column[i] = work->rest[i][k] * work->reciprocal[k];
            work->by_rows[i][k] = column[i];
        }
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            work->by_columns[k][j] = column[j];
        }
        for (int32_t i = k + 1; i < KERNEL_V; ++i) {
            const os_real_t factor = work->rest[i][k];
            for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
                work->rest[i][j] -= factor * column[j];
            }
        }
    }
    return positive;
}

/* Replace b by the solution. */
static void KERNEL_solve(const KERNEL_work_t *work, os_real_t *b)
{
    os_real_t x[KERNEL_PADDED];
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        x[j] = b[j];
    }
    for (int32_t k = 0; k < KERNEL_V; ++k) {
        const os_real_t known = x[k];
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            x[j] -= work->by_columns[k][j] * known;
        }
    }
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        x[j] *= work->reciprocal[j];
    }
    for (int32_t k = KERNEL_V - 1; k >= 0; --k) {
        const os_real_t known = x[k];
        for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
            x[j] -= work->by_rows[k][j] * known;
        }
    }
    for (int32_t j = 0; j < KERNEL_PADDED; ++j) {
        b[j] = x[j];
    }
}

/* Take a variable out of the step: its row and column become those of the identity. */
static void KERNEL_freeze(KERNEL_work_t *work, int32_t j)
{
    os_real_t *matrix = KERNEL_matrix(work);
    for (int32_t k = 0; k < KERNEL_V; ++k) {
        matrix[(j * KERNEL_PADDED) + k] = (os_real_t)0;
        matrix[(k * KERNEL_PADDED) + j] = (os_real_t)0;
    }
    matrix[(j * KERNEL_PADDED) + j] = (os_real_t)1;
}

/* Add d a a' over the row a = (gradient, -width, padding) to the matrix: all of it, in loops of one length. */
static void KERNEL_add_row(KERNEL_work_t *work, int32_t i, os_real_t d)
{
    os_real_t *matrix = KERNEL_matrix(work);
    os_real_t row[KERNEL_PADDED];
    for (int32_t k = 0; k < KERNEL_PADDED; ++k) {
        row[k] = work->derivative[KERNEL_ROWS + (i * KERNEL_PADDED) + k];
    }
    for (int32_t j = 0; j < KERNEL_V; ++j) {
        const os_real_t scaled = d * row[j];
        for (int32_t k = 0; k < KERNEL_PADDED; ++k) {
            matrix[(j * KERNEL_PADDED) + k] += scaled * row[k];
        }
    }
}
