/* Bring a quaternion to length one and to the sign whose scalar part, or first entry that is not zero, is positive. */
static void KERNEL_normalise_attitude(os_real_t *q)
{
    const os_real_t length = os_sqrt(((q[0] * q[0]) + (q[1] * q[1])) + ((q[2] * q[2]) + (q[3] * q[3])));
    os_real_t sign = q[3];
    for (int32_t k = 0; k < 3; ++k) {
        sign = (os_fabs(sign) > (os_real_t)0) ? sign : q[k];
    }
    const os_real_t divisor = (sign < (os_real_t)0) ? -length : length;
    for (int32_t k = 0; k < 4; ++k) {
        /* the sum turns -0 into 0 */
        q[k] = (q[k] / divisor) + (os_real_t)0;
    }
}

/* Davenport's matrix of the weighted vectors, order [v; s]. */
static void KERNEL_fill_davenport(KERNEL_work_t *work)
{
    os_real_t (*K)[4] = work->matrix;
    os_real_t B[3][3];
    for (int32_t i = 0; i < 3; ++i) {
        for (int32_t j = 0; j < 3; ++j) {
            B[i][j] = (os_real_t)0;
            for (int32_t k = 0; k < KERNEL_N; ++k) {
                B[i][j] += (work->weight[k] * work->b_B[k][i]) * work->r_N[k][j];
            }
        }
    }
    const os_real_t trace = (B[0][0] + B[1][1]) + B[2][2];
    for (int32_t i = 0; i < 3; ++i) {
        for (int32_t j = 0; j < 3; ++j) {
            K[i][j] = (B[i][j] + B[j][i]) - ((i == j) ? trace : (os_real_t)0);
        }
    }
    K[0][3] = B[1][2] - B[2][1];
    K[1][3] = B[2][0] - B[0][2];
    K[2][3] = B[0][1] - B[1][0];
    for (int32_t i = 0; i < 3; ++i) {
        K[3][i] = K[i][3];
    }
    K[3][3] = trace;
}

/* The dominant eigenvector of Davenport's matrix. Where rounding cannot tell the next one from it, the attitudes of
   both are free, and of those the smallest rotation is taken. */
static void KERNEL_find_attitude(KERNEL_work_t *work)
{
    int32_t first = 0;
    os_real_t scalar = (os_real_t)0;
    KERNEL_fill_davenport(work);
    KERNEL_diagonalise(4, work);
    for (int32_t k = 1; k < 4; ++k) {
        first = (work->matrix[k][k] > work->matrix[first][first]) ? k : first;
    }
    const os_real_t largest = work->matrix[first][first];
    for (int32_t k = 0; k < 4; ++k) {
        const bool free = (largest - work->matrix[k][k]) <= ((os_real_t)64 * OS_EPSILON);
        scalar = free ? os_fmax(scalar, os_fabs(work->vectors[3][k])) : scalar;
    }
    const bool turnable = scalar > ((os_real_t)64 * OS_EPSILON);
    for (int32_t i = 0; i < 4; ++i) {
        os_real_t entry = (os_real_t)0;
        for (int32_t k = 0; k < 4; ++k) {
            const bool free = (largest - work->matrix[k][k]) <= ((os_real_t)64 * OS_EPSILON);
            const os_real_t share = turnable ? work->vectors[3][k] : ((k == first) ? (os_real_t)1 : (os_real_t)0);
            entry += free ? (share * work->vectors[i][k]) : (os_real_t)0;
        }
        work->ball.q_BN[i] = entry;
    }
    KERNEL_normalise_attitude(work->ball.q_BN);
}

static void KERNEL_fill_dcm(KERNEL_work_t *work)
{
    const os_real_t *q = work->ball.q_BN;
    const os_real_t two = (os_real_t)2;
    const os_real_t one = (os_real_t)1;
    work->dcm[0][0] = one - (two * ((q[1] * q[1]) + (q[2] * q[2])));
    work->dcm[0][1] = two * ((q[0] * q[1]) + (q[3] * q[2]));
    work->dcm[0][2] = two * ((q[0] * q[2]) - (q[3] * q[1]));
    work->dcm[1][0] = two * ((q[0] * q[1]) - (q[3] * q[2]));
    work->dcm[1][1] = one - (two * ((q[0] * q[0]) + (q[2] * q[2])));
    work->dcm[1][2] = two * ((q[1] * q[2]) + (q[3] * q[0]));
    work->dcm[2][0] = two * ((q[0] * q[2]) + (q[3] * q[1]));
    work->dcm[2][1] = two * ((q[1] * q[2]) - (q[3] * q[0]));
    work->dcm[2][2] = one - (two * ((q[0] * q[0]) + (q[1] * q[1])));
}

/* Every vector's inequality about the attitude, for attitudes [g; 1] (x) q, in a form without cancellation. */
static void KERNEL_centre(KERNEL_work_t *work)
{
    KERNEL_fill_dcm(work);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const os_real_t *b = work->b_B[i];
        const os_real_t versine = ((os_real_t)2 * work->half_sine[i]) * work->half_sine[i];
        os_real_t y[3];
        os_real_t gap[3];
        for (int32_t k = 0; k < 3; ++k) {
            y[k] = KERNEL_dot(work->dcm[k], work->r_N[i]);
            gap[k] = b[k] - y[k];
        }
        const os_real_t level = KERNEL_dot(b, y) + ((os_real_t)1 - versine);
        work->about[i].value = versine - ((os_real_t)0.5 * KERNEL_dot(gap, gap));
        KERNEL_cross(b, y, work->about[i].linear);
        for (int32_t column = 0; column < 3; ++column) {
            for (int32_t row = 0; row <= column; ++row) {
                work->about[i].block[KERNEL_place(row, column)] = ((b[row] * y[column]) + (y[row] * b[column])) -
                    ((row == column) ? level : (os_real_t)0);
            }
        }
    }
}

/* Weighted sum of the inequalities: a + 2 h.g - g' C g, C into `matrix`; spread: size of the terms of a. */
static void KERNEL_sum(KERNEL_work_t *work)
{
    work->total = (os_real_t)0;
    work->spread = (os_real_t)0;
    for (int32_t row = 0; row < 3; ++row) {
        work->pull[row] = (os_real_t)0;
        for (int32_t column = 0; column < 3; ++column) {
            work->matrix[row][column] = (os_real_t)0;
        }
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const os_real_t weight = work->weight[i];
        work->total += weight * work->about[i].value;
        work->spread += weight * ((os_real_t)2 * work->half_sine[i]);
        for (int32_t column = 0; column < 3; ++column) {
            work->pull[column] += weight * work->about[i].linear[column];
            for (int32_t row = 0; row <= column; ++row) {
                work->matrix[row][column] -= weight * work->about[i].block[KERNEL_place(row, column)];
            }
        }
    }
    for (int32_t row = 1; row < 3; ++row) {
        for (int32_t column = 0; column < row; ++column) {
            work->matrix[row][column] = work->matrix[column][row];
        }
    }
}

/* The least eigenvalue of C, not above; C diagonal but for rounding. */
static os_real_t KERNEL_least_curvature(const KERNEL_work_t *work)
{
    os_real_t least = OS_REAL_MAX;
    for (int32_t i = 0; i < 3; ++i) {
        os_real_t edge = work->matrix[i][i];
        for (int32_t j = 0; j < 3; ++j) {
            edge -= (i == j) ? (os_real_t)0 : os_fabs(work->matrix[i][j]);
        }
        least = os_fmin(least, edge);
    }
    return least;
}

/* Turn the attitude to where the weighted sum is largest, C being diagonalised. */
static void KERNEL_recentre(KERNEL_work_t *work)
{
    os_real_t *q = work->ball.q_BN;
    os_real_t turn[3] = { (os_real_t)0, (os_real_t)0, (os_real_t)0 };
    os_real_t across[3];
    for (int32_t k = 0; k < 3; ++k) {
        os_real_t share = (os_real_t)0;
        for (int32_t i = 0; i < 3; ++i) {
            share += work->vectors[i][k] * work->pull[i];
        }
        share = share / work->matrix[k][k];
        for (int32_t i = 0; i < 3; ++i) {
            turn[i] += share * work->vectors[i][k];
        }
    }
    KERNEL_cross(turn, q, across);
    const os_real_t scalar = q[3];
    const os_real_t along = KERNEL_dot(turn, q);
    for (int32_t k = 0; k < 3; ++k) {
        q[k] = (q[k] + (scalar * turn[k])) - across[k];
    }
    q[3] = scalar - along;
    KERNEL_normalise_attitude(q);
}

/* The ball of attitudes that the weights prove, rounded outward: f >= 0 for every admissible attitude and
   f <= s1 + s2 |g|^2 with s1 >= a + |h|^2 / mu, s2 <= mu - C for any mu > 0. */
static void KERNEL_enclose(KERNEL_work_t *work)
{
    const os_real_t u = KERNEL_ROUNDOFFS * OS_EPSILON;
    KERNEL_find_attitude(work);
    KERNEL_centre(work);
    KERNEL_sum(work);
    KERNEL_diagonalise(3, work);
    const os_real_t rough = KERNEL_least_curvature(work);
    const os_real_t negligible = (os_real_t)1e-14 * (os_fmax(work->total, (os_real_t)0) * rough);
    if ((rough > u) && (KERNEL_dot(work->pull, work->pull) > negligible)) {
        KERNEL_recentre(work);
        KERNEL_centre(work);
        KERNEL_sum(work);
        KERNEL_diagonalise(3, work);
    }
    const os_real_t curvature = KERNEL_least_curvature(work);
    const os_real_t positive = os_fmax(curvature, OS_REAL_MIN);
    const os_real_t pull = os_sqrt(KERNEL_dot(work->pull, work->pull)) + ((os_real_t)2 * u);
    const os_real_t mu =
        os_fmin((os_real_t)0.5 * positive, pull * os_sqrt(positive / os_fmax(work->total, u * u)));
    const os_real_t s1 = (work->total + ((pull * pull) / mu)) + (u * ((os_fabs(work->total) + work->spread) + u));
    const os_real_t s2 = (mu - curvature) + ((os_real_t)2 * u);
    work->ball.bounded = (curvature > (os_real_t)0) && (s2 < (os_real_t)0) && (s1 <= OS_REAL_MAX);
    work->ball.empty = work->ball.bounded && (s1 < (os_real_t)0);
    work->ball.tangent_square = work->ball.bounded ? (os_fmax(s1, (os_real_t)0) / -s2) : OS_REAL_MAX;
}
