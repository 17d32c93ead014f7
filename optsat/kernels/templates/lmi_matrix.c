/* Place of an entry, row <= column, in the upper triangle by columns. */
static int32_t KERNEL_place(int32_t row, int32_t column)
{
    return row + ((column * (column + 1)) / 2);
}

static os_real_t KERNEL_value(const os_real_t *x, const KERNEL_work_t *work)
{
    os_real_t sum = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        sum += work->cost[i] * x[i];
    }
    return sum;
}

/* A row of the given matrices, or a sum of them, as matrices. */
static void KERNEL_unpack(const os_real_t *packed, KERNEL_blocks_t *m)
{
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t column = 0; column < KERNEL_SIDE; ++column) {
            for (int32_t row = 0; row <= column; ++row) {
                const os_real_t entry = packed[(b * KERNEL_TRIANGLE) + KERNEL_place(row, column)];
                m->at[b][row][column] = entry;
                m->at[b][column][row] = entry;
            }
        }
    }
}

/* constant F_0 + x_1 F_1 + .. + x_M F_M. */
static void KERNEL_combine(os_real_t constant, const os_real_t *x, KERNEL_work_t *work, KERNEL_blocks_t *m)
{
    for (int32_t e = 0; e < KERNEL_PADDED; ++e) {
        work->packed[e] = constant * work->given[0][e];
    }
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        const os_real_t share = x[i];
        for (int32_t e = 0; e < KERNEL_PADDED; ++e) {
            work->packed[e] += share * work->given[i + 1][e];
        }
    }
    KERNEL_unpack(work->packed, m);
}

/* m + factor * added. */
static void KERNEL_add(os_real_t factor, const KERNEL_blocks_t *added, KERNEL_blocks_t *m)
{
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                m->at[b][i][j] += factor * added->at[b][i][j];
            }
        }
    }
}

/* m + level * identity. */
static void KERNEL_raise(os_real_t level, KERNEL_blocks_t *m)
{
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            m->at[b][i][i] += level;
        }
    }
}

static void KERNEL_scale(os_real_t factor, KERNEL_blocks_t *m)
{
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                m->at[b][i][j] = factor * m->at[b][i][j];
            }
        }
    }
}

/* The upper triangle of m + m', halved on the diagonal: its product with a packed matrix is that of m. */
static void KERNEL_pack(const KERNEL_blocks_t *m, os_real_t *packed)
{
    for (int32_t e = KERNEL_BLOCKS * KERNEL_TRIANGLE; e < KERNEL_PADDED; ++e) {
        packed[e] = (os_real_t)0;
    }
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t column = 0; column < KERNEL_SIDE; ++column) {
            for (int32_t row = 0; row < column; ++row) {
                packed[(b * KERNEL_TRIANGLE) + KERNEL_place(row, column)] =
                    m->at[b][row][column] + m->at[b][column][row];
            }
            packed[(b * KERNEL_TRIANGLE) + KERNEL_place(column, column)] = m->at[b][column][column];
        }
    }
}

/* What a matrix gives with F_0 .. F_M. */
static void KERNEL_draw(const KERNEL_blocks_t *m, KERNEL_work_t *work)
{
    KERNEL_pack(m, work->packed);
    for (int32_t i = 0; i <= KERNEL_M; ++i) {
        work->drawn[i] = KERNEL_dot(work->given[i], work->packed);
    }
}

static os_real_t KERNEL_inner(const KERNEL_blocks_t *a, const KERNEL_blocks_t *b)
{
    os_real_t sum = (os_real_t)0;
    for (int32_t k = 0; k < KERNEL_BLOCKS; ++k) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                sum += a->at[k][i][j] * b->at[k][i][j];
            }
        }
    }
    return sum;
}

static os_real_t KERNEL_largest(const KERNEL_blocks_t *m)
{
    os_real_t largest = (os_real_t)0;
    for (int32_t k = 0; k < KERNEL_BLOCKS; ++k) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                largest = os_fmax(largest, os_fabs(m->at[k][i][j]));
            }
        }
    }
    return largest;
}

/* a b, block by block. */
static void KERNEL_multiply(const KERNEL_blocks_t *a, const KERNEL_blocks_t *b, KERNEL_blocks_t *product)
{
    for (int32_t k = 0; k < KERNEL_BLOCKS; ++k) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            os_real_t row[KERNEL_SIDE];
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                row[j] = (os_real_t)0;
            }
            for (int32_t l = 0; l < KERNEL_SIDE; ++l) {
                const os_real_t factor = a->at[k][i][l];
                for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                    row[j] += factor * b->at[k][l][j];
                }
            }
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                product->at[k][i][j] = row[j];
            }
        }
    }
}

/* The symmetric part of inverse * m * other. */
static void KERNEL_transform(const KERNEL_blocks_t *m, const KERNEL_blocks_t *other, KERNEL_work_t *work,
    KERNEL_blocks_t *image)
{
    KERNEL_multiply(&work->inverse, m, &work->half);
    KERNEL_multiply(&work->half, other, image);
    for (int32_t k = 0; k < KERNEL_BLOCKS; ++k) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < i; ++j) {
                const os_real_t mean = (os_real_t)0.5 * (image->at[k][i][j] + image->at[k][j][i]);
                image->at[k][i][j] = mean;
                image->at[k][j][i] = mean;
            }
        }
    }
}

/* Whether a block of m + length * step is positive definite. */
static bool KERNEL_is_definite(int32_t block, const KERNEL_blocks_t *m, const KERNEL_blocks_t *step, os_real_t length)
{
    os_real_t rest[KERNEL_SIDE][KERNEL_SIDE];
    bool definite = true;
    for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            rest[i][j] = m->at[block][i][j] + (length * step->at[block][i][j]);
        }
    }
    for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
        definite = definite && (rest[j][j] > (os_real_t)0);
        const os_real_t reciprocal = (os_real_t)1 / (definite ? rest[j][j] : (os_real_t)1);
        for (int32_t i = j + 1; i < KERNEL_SIDE; ++i) {
            const os_real_t factor = rest[i][j] * reciprocal;
            for (int32_t k = j + 1; k <= i; ++k) {
                rest[i][k] -= factor * rest[k][j];
            }
        }
    }
    return definite;
}

/* Whether the inequality holds at x, whatever rounding did to the sum and to this test. */
static bool KERNEL_holds(const os_real_t *x, KERNEL_work_t *work)
{
    os_real_t size = work->largest[0];
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        size += os_fabs(x[i]) * work->largest[i + 1];
    }
    KERNEL_combine((os_real_t)1, x, work, &work->image);
    work->margin = (((os_real_t)0.5 * (os_real_t)KERNEL_ROUNDOFFS) * OS_EPSILON) * size;
    KERNEL_raise(-work->margin, &work->image);
    bool holds = true;
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        holds = holds && KERNEL_is_definite(b, &work->image, &work->image, (os_real_t)0);
    }
    return holds;
}

/* Inverse of every block by Cholesky's method; false where one is not positive definite. */
static bool KERNEL_invert(const KERNEL_blocks_t *m, KERNEL_blocks_t *inverse)
{
    bool definite = true;
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        os_real_t lower[KERNEL_SIDE][KERNEL_SIDE];
        os_real_t part[KERNEL_SIDE][KERNEL_SIDE];
        for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
            os_real_t pivot = m->at[b][j][j];
            for (int32_t k = 0; k < j; ++k) {
                pivot -= lower[j][k] * lower[j][k];
            }
            definite = definite && (pivot > (os_real_t)0) && (pivot <= OS_REAL_MAX);
            part[j][j] = (os_real_t)1 / os_sqrt(definite ? pivot : (os_real_t)1);
            for (int32_t i = j + 1; i < KERNEL_SIDE; ++i) {
                os_real_t entry = m->at[b][i][j];
                for (int32_t k = 0; k < j; ++k) {
                    entry -= lower[i][k] * lower[j][k];
                }
                lower[i][j] = entry * part[j][j];
            }
        }
        for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
            for (int32_t i = j + 1; i < KERNEL_SIDE; ++i) {
                os_real_t sum = (os_real_t)0;
                for (int32_t k = j; k < i; ++k) {
                    sum += lower[i][k] * part[k][j];
                }
                part[i][j] = -(sum * part[i][i]);
            }
        }
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j <= i; ++j) {
                os_real_t sum = (os_real_t)0;
                for (int32_t k = i; k < KERNEL_SIDE; ++k) {
                    sum += part[k][i] * part[k][j];
                }
                inverse->at[b][i][j] = sum;
                inverse->at[b][j][i] = sum;
            }
        }
    }
    return definite;
}
