/* The programme in Gibbs coordinates g about the pivot attitude, in units s of the pivot's own ball:
     maximise tau over G (6, upper triangle by columns), h (3), tau, with Y = [[1 - s^2 tr G, h'], [h, G]],
     Y >= 0,  tr(M_i Y) >= 0 of every vector,  [[tr G - tau, -h'], [-h, (1 - s^2 tau) I - s^2 G]] >= 0. */

/* Scale every vector's inequality to order one. Bounds are widened by what rounding costs the proof, so that a bound of
   zero does not draw all weight. */
static void KERNEL_draw_chart(KERNEL_work_t *work)
{
    const os_real_t u = KERNEL_ROUNDOFFS * OS_EPSILON;
    const os_real_t narrowest = (os_real_t)256 * OS_EPSILON;
    const os_real_t radius = work->ball.bounded ? os_sqrt(work->ball.tangent_square) : KERNEL_WIDEST;
    const os_real_t s = os_fmin(os_fmax(radius, narrowest), KERNEL_WIDEST);
    const os_real_t s2 = s * s;
    work->scale = s;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        KERNEL_quadratic_t *f = &work->about[i];
        f->value += ((os_real_t)2 * u) * (((os_real_t)2 * work->half_sine[i]) + u);
        f->size = os_fmax(os_fabs(f->value), OS_REAL_MIN);
        for (int32_t k = 0; k < 3; ++k) {
            f->linear[k] = s * f->linear[k];
            f->size = os_fmax(f->size, os_fabs(f->linear[k]));
        }
        for (int32_t k = 0; k < 6; ++k) {
            f->block[k] = s2 * f->block[k];
            f->size = os_fmax(f->size, os_fabs(f->block[k]));
        }
        f->value = f->value / f->size;
        for (int32_t column = 0; column < 3; ++column) {
            for (int32_t row = 0; row <= column; ++row) {
                const int32_t k = KERNEL_place(row, column);
                const os_real_t entry = f->block[k] / f->size;
                work->coefficient[i][k] = (row == column) ? (entry - (s2 * f->value)) : ((os_real_t)2 * entry);
            }
            work->coefficient[i][6 + column] = (os_real_t)2 * (f->linear[column] / f->size);
        }
        work->coefficient[i][9] = (os_real_t)0;
    }
}

/* The matrix of a cone at x, or of a step where `constant` is 0. */
static void KERNEL_fill_slack(int32_t which, const os_real_t *x, os_real_t constant, os_real_t s2, KERNEL_matrix_t *m)
{
    const os_real_t trace = (x[0] + x[2]) + x[5];
    const os_real_t side = (which == 0) ? (os_real_t)1 : (os_real_t)-1;
    const os_real_t inner = (which == 0) ? (os_real_t)1 : -s2;
    const os_real_t diagonal = (which == 0) ? (os_real_t)0 : (constant - (s2 * x[9]));
    m->at[0][0] = (which == 0) ? (constant - (s2 * trace)) : (trace - x[9]);
    for (int32_t column = 0; column < 3; ++column) {
        m->at[0][column + 1] = side * x[6 + column];
        m->at[column + 1][0] = m->at[0][column + 1];
        for (int32_t row = 0; row <= column; ++row) {
            const os_real_t added = (row == column) ? diagonal : (os_real_t)0;
            const os_real_t entry = (inner * x[KERNEL_place(row, column)]) + added;
            m->at[row + 1][column + 1] = entry;
            m->at[column + 1][row + 1] = entry;
        }
    }
}

/* Adjoint of the above: what a symmetric matrix gives in the ten unknowns. */
static void KERNEL_fill_adjoint(int32_t which, const KERNEL_matrix_t *m, os_real_t s2, os_real_t *x)
{
    const os_real_t side = (which == 0) ? (os_real_t)2 : (os_real_t)-2;
    const os_real_t inner = (which == 0) ? (os_real_t)1 : -s2;
    const os_real_t corner = (which == 0) ? -(s2 * m->at[0][0]) : m->at[0][0];
    const os_real_t trace = (m->at[1][1] + m->at[2][2]) + m->at[3][3];
    for (int32_t column = 0; column < 3; ++column) {
        for (int32_t row = 0; row <= column; ++row) {
            const os_real_t entry = inner * m->at[row + 1][column + 1];
            x[KERNEL_place(row, column)] = (row == column) ? (entry + corner) : ((os_real_t)2 * entry);
        }
        x[6 + column] = side * m->at[0][column + 1];
    }
    x[9] = (which == 0) ? (os_real_t)0 : -(m->at[0][0] + (s2 * trace));
}

/* Inverse of a symmetric 4 x 4 matrix by Cholesky's method; false where it is not positive definite. */
static bool KERNEL_invert(const KERNEL_matrix_t *m, KERNEL_matrix_t *inverse)
{
    os_real_t lower[4][4];
    os_real_t part[4][4];
    bool definite = true;
    for (int32_t j = 0; j < 4; ++j) {
        os_real_t pivot = m->at[j][j];
        for (int32_t k = 0; k < j; ++k) {
            pivot -= lower[j][k] * lower[j][k];
        }
        definite = definite && (pivot > (os_real_t)0) && (pivot <= OS_REAL_MAX);
        const os_real_t reciprocal = (os_real_t)1 / os_sqrt(definite ? pivot : (os_real_t)1);
        part[j][j] = reciprocal;
        for (int32_t i = j + 1; i < 4; ++i) {
            os_real_t entry = m->at[i][j];
            for (int32_t k = 0; k < j; ++k) {
                entry -= lower[i][k] * lower[j][k];
            }
            lower[i][j] = entry * reciprocal;
        }
    }
    for (int32_t j = 0; j < 4; ++j) {
        for (int32_t i = j + 1; i < 4; ++i) {
            os_real_t sum = (os_real_t)0;
            for (int32_t k = j; k < i; ++k) {
                sum += lower[i][k] * part[k][j];
            }
            part[i][j] = -(sum * part[i][i]);
        }
    }
    for (int32_t i = 0; i < 4; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            os_real_t sum = (os_real_t)0;
            for (int32_t k = i; k < 4; ++k) {
                sum += part[k][i] * part[k][j];
            }
            inverse->at[i][j] = sum;
            inverse->at[j][i] = sum;
        }
    }
    return definite;
}

/* Whether m + length * step is positive definite. */
static bool KERNEL_stays_definite(const KERNEL_matrix_t *m, const KERNEL_matrix_t *step, os_real_t length)
{
    os_real_t rest[4][4];
    bool definite = true;
    for (int32_t i = 0; i < 4; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            rest[i][j] = m->at[i][j] + (length * step->at[i][j]);
        }
    }
    for (int32_t j = 0; j < 4; ++j) {
        definite = definite && (rest[j][j] > (os_real_t)0);
        const os_real_t reciprocal = (os_real_t)1 / (definite ? rest[j][j] : (os_real_t)1);
        for (int32_t i = j + 1; i < 4; ++i) {
            const os_real_t factor = rest[i][j] * reciprocal;
            for (int32_t k = j + 1; k <= i; ++k) {
                rest[i][k] -= factor * rest[k][j];
            }
        }
    }
    return definite;
}

/* Entry i, j of a product. */
static os_real_t KERNEL_entry(const KERNEL_matrix_t *a, int32_t i, const KERNEL_matrix_t *b, int32_t j)
{
    return ((a->at[i][0] * b->at[0][j]) + (a->at[i][1] * b->at[1][j])) +
        ((a->at[i][2] * b->at[2][j]) + (a->at[i][3] * b->at[3][j]));
}

/* The symmetric part of a b c. */
static void KERNEL_multiply(const KERNEL_matrix_t *a, const KERNEL_matrix_t *b, const KERNEL_matrix_t *c,
    KERNEL_matrix_t *product)
{
    KERNEL_matrix_t half;
    for (int32_t i = 0; i < 4; ++i) {
        for (int32_t j = 0; j < 4; ++j) {
            half.at[i][j] = KERNEL_entry(a, i, b, j);
        }
    }
    for (int32_t i = 0; i < 4; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            product->at[i][j] = (os_real_t)0.5 * (KERNEL_entry(&half, i, c, j) + KERNEL_entry(&half, j, c, i));
            product->at[j][i] = product->at[i][j];
        }
    }
}

static os_real_t KERNEL_inner(const KERNEL_matrix_t *a, const KERNEL_matrix_t *b)
{
    os_real_t sum = (os_real_t)0;
    for (int32_t i = 0; i < 4; ++i) {
        sum += ((a->at[i][0] * b->at[i][0]) + (a->at[i][1] * b->at[i][1])) +
            ((a->at[i][2] * b->at[i][2]) + (a->at[i][3] * b->at[i][3]));
    }
    return sum;
}
