/* Semidefinite programme: minimise c.x where every block of F_0 + x_1 F_1 + .. + x_M F_M is positive semidefinite. */

/*@sizes*/

/* A symmetric matrix for every block. */
typedef struct {
    os_real_t at[KERNEL_BLOCKS][KERNEL_SIDE][KERNEL_SIDE];
} KERNEL_blocks_t;

/* The homogeneous model: x / tau, slack / tau and multiplier / tau solve the programme where tau stays above kappa;
   where kappa does, x or the multiplier alone proves that there is no solution. */
typedef struct {
    os_real_t cost[KERNEL_M];
    os_real_t given[KERNEL_M + 1][KERNEL_PADDED];
    os_real_t largest[KERNEL_M + 1];
    os_real_t cost_size;
    os_real_t slack_size;
    os_real_t x[KERNEL_M];
    os_real_t x_step[KERNEL_M];
    os_real_t tau;
    os_real_t tau_step;
    os_real_t kappa;
    os_real_t kappa_step;
    KERNEL_blocks_t slack;
    KERNEL_blocks_t slack_step;
    KERNEL_blocks_t multiplier;
    KERNEL_blocks_t multiplier_step;
    KERNEL_blocks_t inverse;
    KERNEL_blocks_t correction;
    KERNEL_blocks_t rest;
    KERNEL_blocks_t rest_image;
    KERNEL_blocks_t present;
    KERNEL_blocks_t image;
    KERNEL_blocks_t half;
    os_real_t packed[KERNEL_PADDED];
    os_real_t drawn[KERNEL_M + 1];
    os_real_t unmet[KERNEL_M];
    os_real_t excess[KERNEL_M];
    os_real_t sensitivity[KERNEL_M];
    os_real_t further[KERNEL_M];
    os_real_t lost;
    os_real_t steepness;
    os_real_t gap;
    os_real_t constant;
    os_real_t margin;
    bool is_near;
    os_real_t schur[KERNEL_M][KERNEL_M];
    os_real_t pivot[KERNEL_M];
    os_real_t right[KERNEL_M];
} KERNEL_work_t;

/*@include lane_sums*/
/*@include lmi_matrix*/
/*@include lmi_step*/
/* Take in costs and matrices; rows beyond a block's own are the inequality 1 >= 0. */
static void KERNEL_load(const os_real_t *x, KERNEL_work_t *work)
{
    /*@tables*/
    int32_t from = KERNEL_M;
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->cost[i] = x[i];
    }
    for (int32_t i = 0; i <= KERNEL_M; ++i) {
        work->largest[i] = (os_real_t)0;
        for (int32_t e = 0; e < KERNEL_PADDED; ++e) {
            work->given[i][e] = (os_real_t)0;
        }
        for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
            for (int32_t column = 0; column < KERNEL_SIDE; ++column) {
                for (int32_t row = 0; row <= column; ++row) {
                    const int32_t place = (b * KERNEL_TRIANGLE) + KERNEL_place(row, column);
                    if (column < KERNEL_SIDES[b]) {
                        work->given[i][place] = x[from];
                        work->largest[i] = os_fmax(work->largest[i], os_fabs(x[from]));
                        ++from;
                    } else {
                        work->given[i][place] = ((i == 0) && (row == column)) ? (os_real_t)1 : (os_real_t)0;
                    }
                }
            }
        }
    }
}

/* Multiples of the identity, in proportion to the data. */
static void KERNEL_start(KERNEL_work_t *work)
{
    work->cost_size = (os_real_t)1;
    work->slack_size = os_fmax((os_real_t)1, work->largest[0]);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->cost_size = os_fmax(work->cost_size, os_fabs(work->cost[i]));
        work->slack_size = os_fmax(work->slack_size, work->largest[i + 1]);
        work->x[i] = (os_real_t)0;
    }
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                work->slack.at[b][i][j] = (i == j) ? work->slack_size : (os_real_t)0;
                work->multiplier.at[b][i][j] = (i == j) ? work->cost_size : (os_real_t)0;
            }
        }
    }
    work->tau = (os_real_t)1;
    work->kappa = work->slack_size * work->cost_size;
}

/* What the present point shows: 0 the optimum, 1 that no x of reasonable size satisfies the inequality, 2 that the cost
   falls for ever, 3 nothing yet. Also the gap, and what both sides lack of their equations. */
static int32_t KERNEL_judge(KERNEL_work_t *work)
{
    const os_real_t enough = os_fmax(KERNEL_TOLERANCE, (os_real_t)512 * OS_EPSILON);
    const os_real_t value = KERNEL_value(work->x, work);
    os_real_t unmet = (os_real_t)0;
    os_real_t drawn = (os_real_t)0;
    KERNEL_draw(&work->multiplier, work);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->unmet[i] = (work->tau * work->cost[i]) - work->drawn[i + 1];
        unmet = os_fmax(unmet, os_fabs(work->unmet[i]));
        drawn = os_fmax(drawn, os_fabs(work->drawn[i + 1]));
    }
    work->gap = KERNEL_inner(&work->slack, &work->multiplier);
    work->constant = work->drawn[0];
    const os_real_t constant = work->constant;
    const os_real_t size = (work->tau + os_fabs(value)) + os_fabs(constant);
    KERNEL_combine(work->tau, work->x, work, &work->rest);
    KERNEL_add((os_real_t)-1, &work->slack, &work->rest);
    const os_real_t rest = KERNEL_largest(&work->rest);
    const os_real_t moved = rest + (work->tau * os_fmax(work->largest[0], (os_real_t)1));
    work->is_near = work->gap <= (((os_real_t)0.001 * size) * work->tau);
    const bool close = (work->gap <= ((enough * size) * work->tau)) && ((value + constant) <= (enough * size));
    const bool met = (unmet <= ((enough * work->cost_size) * work->tau)) &&
        (rest <= ((enough * work->slack_size) * work->tau));
    const bool infeasible = (constant < (os_real_t)0) && (drawn <= (enough * -constant));
    const bool unbounded = (value < (os_real_t)0) && (moved <= (enough * -value));
    return (close && met) ? 0 : (infeasible ? 1 : (unbounded ? 2 : 3));
}

/* Bring x into the cone, where the slack is already: steps towards the slack of a larger and larger gap, its multiplier
   being the one that belongs to it, tau being held. True where the inequality then holds. */
static bool KERNEL_repair(KERNEL_work_t *work)
{
    const os_real_t scale = (os_real_t)1 / work->tau;
    os_real_t mean = ((scale * scale) * work->gap) / (os_real_t)KERNEL_ORDER;
    bool going = true;
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->x[i] = scale * work->x[i];
    }
    KERNEL_scale(scale, &work->slack);
    work->tau = (os_real_t)1;
    work->kappa = (os_real_t)0;
    for (int32_t k = 0; (k < KERNEL_REPAIRS) && going; ++k) {
        going = !KERNEL_holds(work->x, work);
        if (going) {
            KERNEL_raise(work->margin, &work->slack);
            mean = os_fmax(mean, ((os_real_t)2 * work->margin) * work->cost_size);
            going = KERNEL_invert(&work->slack, &work->inverse);
        }
        if (going) {
            work->multiplier = work->inverse;
            KERNEL_scale(mean, &work->multiplier);
            (void)KERNEL_judge(work);
            going = KERNEL_factorise(work);
        }
        if (going) {
            KERNEL_centre(work);
            work->steepness = OS_REAL_MAX;
            KERNEL_clear_correction(work);
            KERNEL_find_step(mean, (os_real_t)1, (os_real_t)0, work);
            const os_real_t reach = KERNEL_reach(KERNEL_FINE, false, work);
            (void)KERNEL_move((reach >= (os_real_t)1) ? reach : ((os_real_t)0.9 * reach), work);
            mean = (os_real_t)4 * mean;
        }
    }
    return KERNEL_holds(work->x, work);
}

/* x: c (M), F (M + 1, upper triangles by columns); y: x (M), objective, bound, outcome */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const bool finite = os_all_finite(x, KERNEL_ENTRIES);
    int32_t outcome = 4;
    os_real_t value = (os_real_t)NAN;
    os_real_t bound = (os_real_t)NAN;
    if (finite) {
        bool going = true;
        KERNEL_load(x, work);
        KERNEL_start(work);
        int32_t shown = KERNEL_judge(work);
        for (int32_t iteration = 0; (iteration < KERNEL_ITERATIONS) && (shown == 3) && going; ++iteration) {
            going = KERNEL_advance(work);
            shown = going ? KERNEL_judge(work) : shown;
        }
        const os_real_t lowest = -(work->constant / work->tau);
        if ((shown == 1) || (shown == 2)) {
            outcome = shown;
        } else if (KERNEL_repair(work)) {
            const os_real_t enough =
                (os_real_t)10 * os_fmax(KERNEL_TOLERANCE, (os_real_t)512 * OS_EPSILON);
            value = KERNEL_value(work->x, work);
            bound = lowest;
            const os_real_t size = ((os_real_t)1 + os_fabs(value)) + os_fabs(bound);
            outcome = 3;
            if ((shown == 0) && ((value - bound) <= (enough * size))) {
                outcome = 0;
            }
        } else {
            outcome = 4;
        }
    }
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        y[i] = ((outcome == 0) || (outcome == 3)) ? work->x[i] : (os_real_t)NAN;
    }
    y[KERNEL_M] = value;
    y[KERNEL_M + 1] = bound;
    y[KERNEL_M + 2] = (os_real_t)outcome;
    os_status_t status = OS_E_NOT_CONVERGED;
    if (!finite) {
        status = OS_E_NOT_FINITE;
    } else if (outcome == 0) {
        status = OS_OK;
    } else if (outcome < 3) {
        status = OS_E_RANGE;
    } else {
        status = OS_E_NOT_CONVERGED;
    }
    return status;
}
