/* Attitude from N vectors of bounded error, and the angle that its error never exceeds. */

/*@sizes*/

typedef struct {
    os_real_t at[4][4];
} KERNEL_matrix_t;

/* A cone of matrices: the constraint's value, its multiplier, and what a step changes. */
typedef struct {
    KERNEL_matrix_t slack;
    KERNEL_matrix_t multiplier;
    KERNEL_matrix_t inverse;
    KERNEL_matrix_t slack_step;
    KERNEL_matrix_t multiplier_step;
    KERNEL_matrix_t correction;
} KERNEL_cone_t;

typedef struct {
    os_real_t q_BN[4];
    os_real_t tangent_square;
    bool bounded;
    bool empty;
} KERNEL_ball_t;

/* f(g) = value + 2 linear.g + g' block g of a vector, block by columns of its upper triangle; size: what it was divided
   by */
typedef struct {
    os_real_t value;
    os_real_t linear[3];
    os_real_t block[6];
    os_real_t size;
} KERNEL_quadratic_t;

typedef struct {
    os_real_t b_B[KERNEL_N][3];
    os_real_t r_N[KERNEL_N][3];
    os_real_t bound[KERNEL_N];
    os_real_t half_sine[KERNEL_N];
    int32_t row[KERNEL_N];
    os_real_t weight[KERNEL_N];
    os_real_t best_weight[KERNEL_N];
    KERNEL_ball_t ball;
    KERNEL_ball_t best;
    KERNEL_quadratic_t about[KERNEL_N];
    os_real_t dcm[3][3];
    os_real_t matrix[4][4];
    os_real_t vectors[4][4];
    os_real_t total;
    os_real_t pull[3];
    os_real_t spread;
    os_real_t scale;
    os_real_t x[10];
    os_real_t x_step[10];
    os_real_t coefficient[KERNEL_N][10];
    os_real_t slack[KERNEL_N];
    os_real_t slack_step[KERNEL_N];
    os_real_t multiplier[KERNEL_N];
    os_real_t multiplier_step[KERNEL_N];
    os_real_t correction[KERNEL_N];
    KERNEL_cone_t cone[2];
    os_real_t schur[10][10];
    os_real_t pivot[10];
    os_real_t right[10];
} KERNEL_work_t;

/*@include certified_attitude_angle*/
/*@include certified_attitude_eigen*/
/*@include certified_attitude_ball*/
/*@include certified_attitude_cone*/
/*@include certified_attitude_step*/
/*@include certified_attitude_search*/
/* Bring a vector to length one; false where it is zero. */
static bool KERNEL_normalise(os_real_t *v)
{
    const os_real_t largest = os_fmax(os_fmax(os_fabs(v[0]), os_fabs(v[1])), os_fabs(v[2]));
    const bool usable = largest > (os_real_t)0;
    const os_real_t divisor = usable ? largest : (os_real_t)1;
    for (int32_t k = 0; k < 3; ++k) {
        v[k] = v[k] / divisor;
    }
    const os_real_t length = usable ? os_sqrt(((v[0] * v[0]) + (v[1] * v[1])) + (v[2] * v[2])) : (os_real_t)1;
    for (int32_t k = 0; k < 3; ++k) {
        v[k] = v[k] / length;
    }
    return usable;
}

/* Take the vectors in; a row whose bound is pi says nothing and repeats the first that does. */
static os_status_t KERNEL_load(const os_real_t *x, KERNEL_work_t *work)
{
    const os_real_t *bound = &x[6 * KERNEL_N];
    int32_t first = -1;
    os_status_t status = OS_OK;
    for (int32_t i = KERNEL_N - 1; i >= 0; --i) {
        first = (bound[i] < KERNEL_PI) ? i : first;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const int32_t row = (bound[i] < KERNEL_PI) ? i : first;
        const bool finite = os_all_finite(&bound[i], 1) &&
            ((row < 0) || (os_all_finite(&x[3 * row], 3) && os_all_finite(&x[(3 * KERNEL_N) + (3 * row)], 3)));
        work->row[i] = row;
        work->bound[i] = (row < 0) ? KERNEL_PI : bound[row];
        for (int32_t k = 0; k < 3; ++k) {
            const os_real_t axis = (k == 0) ? (os_real_t)1 : (os_real_t)0;
            work->b_B[i][k] = (finite && (row >= 0)) ? x[(3 * row) + k] : axis;
            work->r_N[i][k] = (finite && (row >= 0)) ? x[(3 * KERNEL_N) + (3 * row) + k] : axis;
        }
        const bool usable_B = KERNEL_normalise(work->b_B[i]);
        const bool usable_N = KERNEL_normalise(work->r_N[i]);
        if (!finite) {
            status = OS_E_NOT_FINITE;
        } else if ((status == OS_OK) && ((bound[i] < (os_real_t)0) || (bound[i] > KERNEL_PI))) {
            status = OS_E_RANGE;
        } else if ((status == OS_OK) && !(usable_B && usable_N)) {
            status = OS_E_NOT_UNIT;
        } else {
            /* this row can be used */
        }
    }
    return status;
}

/* Excess of a pair's mismatch over its bounds, as a sine; negative where the bounds allow any. */
static os_real_t KERNEL_excess(const KERNEL_work_t *work, int32_t i, int32_t j)
{
    const os_real_t sine_B = KERNEL_cross_length(work->b_B[i], work->b_B[j]);
    const os_real_t sine_N = KERNEL_cross_length(work->r_N[i], work->r_N[j]);
    const os_real_t cosine_B = KERNEL_dot(work->b_B[i], work->b_B[j]);
    const os_real_t cosine_N = KERNEL_dot(work->r_N[i], work->r_N[j]);
    const os_real_t sine = os_fabs((sine_B * cosine_N) - (cosine_B * sine_N));
    const os_real_t cosine = (cosine_B * cosine_N) + (sine_B * sine_N);
    const os_real_t half_i = work->half_sine[i];
    const os_real_t half_j = work->half_sine[j];
    const os_real_t cosine_i = (os_real_t)1 - (((os_real_t)2 * half_i) * half_i);
    const os_real_t cosine_j = (os_real_t)1 - (((os_real_t)2 * half_j) * half_j);
    const os_real_t sine_i = ((os_real_t)2 * half_i) * os_sqrt((os_real_t)1 - (half_i * half_i));
    const os_real_t sine_j = ((os_real_t)2 * half_j) * os_sqrt((os_real_t)1 - (half_j * half_j));
    const os_real_t sum_sine = (sine_i * cosine_j) + (cosine_i * sine_j);
    const os_real_t sum_cosine = (cosine_i * cosine_j) - (sine_i * sine_j);
    /* of an angle of more than a right angle the sine says nothing of the size */
    const bool beyond = ((cosine * sum_cosine) + (sine * sum_sine)) <= (os_real_t)0;
    const os_real_t excess = (sine * sum_cosine) - (cosine * sum_sine);
    const bool wide = (work->bound[i] + work->bound[j]) >= KERNEL_PI;
    return wide ? (os_real_t)-1 : (beyond ? os_copysign((os_real_t)1, excess) : excess);
}

/* Half-angle sines of the bounds, rounding data being granted a mismatch; false where a pair contradicts itself. */
static bool KERNEL_agree(KERNEL_work_t *work)
{
    const os_real_t granted = os_fmax(KERNEL_GRANTED, (os_real_t)16 * OS_EPSILON);
    os_real_t largest = (os_real_t)-1;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->half_sine[i] = KERNEL_sine((os_real_t)0.5 * work->bound[i]);
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        for (int32_t j = 0; j < i; ++j) {
            largest = os_fmax(largest, KERNEL_excess(work, i, j));
        }
    }
    if ((largest > (os_real_t)0) && (largest <= granted)) {
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            work->half_sine[i] = KERNEL_sine((os_real_t)0.5 * os_fmin(work->bound[i] + granted, KERNEL_PI));
        }
    }
    return largest <= granted;
}

/* Weights 1 / (1 - cos bound), sum 1: they need no search. */
static void KERNEL_weigh(KERNEL_work_t *work)
{
    os_real_t widest = OS_EPSILON;
    os_real_t sum = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        widest = os_fmax(widest, work->half_sine[i]);
    }
    const os_real_t least = os_sqrt(os_sqrt(OS_EPSILON)) * widest;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const os_real_t share = least / os_fmax(work->half_sine[i], least);
        work->weight[i] = share * share;
        sum += work->weight[i];
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->weight[i] = work->weight[i] / sum;
    }
}

/* Keep the ball of the present weights where it is the smallest so far, or proves that no attitude is admissible. */
static void KERNEL_keep(KERNEL_work_t *work)
{
    const KERNEL_ball_t *ball = &work->ball;
    const bool smaller = ball->bounded && (ball->tangent_square < work->best.tangent_square);
    if (!work->best.empty && (ball->empty || smaller)) {
        work->best = *ball;
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            work->best_weight[i] = work->weight[i];
        }
    }
}

/* The smallest ball: search about a pivot, and once more about what was found where that is much smaller. */
static void KERNEL_search(bool consistent, KERNEL_work_t *work)
{
    bool going = consistent;
    KERNEL_weigh(work);
    KERNEL_enclose(work);
    work->best = work->ball;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->best_weight[i] = work->weight[i];
    }
    for (int32_t pass = 0; (pass < KERNEL_PASSES) && going && !work->best.empty; ++pass) {
        KERNEL_draw_chart(work);
        going = KERNEL_optimise(work);
        if (going) {
            KERNEL_enclose(work);
            KERNEL_keep(work);
            going = work->ball.bounded &&
                (work->ball.tangent_square < ((os_real_t)0.1 * (work->scale * work->scale)));
        }
    }
}

/* x: b_B (N, 3), r_N (N, 3), angle_bound_rad (N); y: q_BN (4), bound_rad, weights (N), status */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_status_t status = KERNEL_load(x, work);
    const bool usable = (status == OS_OK) && (work->row[0] >= 0);
    bool consistent = true;
    for (int32_t k = 0; k < 4; ++k) {
        work->best.q_BN[k] = (k == 3) ? (os_real_t)1 : (os_real_t)0;
    }
    work->best.bounded = false;
    if (usable) {
        consistent = KERNEL_agree(work);
        KERNEL_search(consistent, work);
        consistent = consistent && !work->best.empty;
    }
    const bool bounded = usable && consistent && work->best.bounded;
    const os_real_t outside = consistent ? (os_real_t)1 : (os_real_t)2;
    for (int32_t k = 0; k < 4; ++k) {
        y[k] = work->best.q_BN[k];
    }
    y[4] = bounded ? KERNEL_angle(work->best.tangent_square) : KERNEL_PI;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[5 + i] = (os_real_t)0;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        if (usable) {
            y[5 + work->row[i]] += work->best_weight[i];
        }
    }
    y[5 + KERNEL_N] = bounded ? (os_real_t)0 : outside;
    return status;
}
