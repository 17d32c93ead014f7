/* Sum of slack * multiplier after steps of these lengths. */
static os_real_t KERNEL_gap(os_real_t primal, os_real_t dual, const KERNEL_work_t *work)
{
    os_real_t gap = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        gap += (work->slack[i] + (primal * work->slack_step[i])) *
            (work->multiplier[i] + (dual * work->multiplier_step[i]));
    }
    for (int32_t which = 0; which < 2; ++which) {
        const KERNEL_cone_t *cone = &work->cone[which];
        gap += KERNEL_inner(&cone->slack, &cone->multiplier);
        gap += (dual * KERNEL_inner(&cone->slack, &cone->multiplier_step)) +
            (primal * KERNEL_inner(&cone->slack_step, &cone->multiplier));
        gap += (primal * dual) * KERNEL_inner(&cone->slack_step, &cone->multiplier_step);
    }
    return gap;
}

static void KERNEL_set_correction(bool predicted, KERNEL_work_t *work)
{
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->correction[i] =
            predicted ? ((work->slack_step[i] * work->multiplier_step[i]) / work->slack[i]) : (os_real_t)0;
    }
    for (int32_t which = 0; which < 2; ++which) {
        KERNEL_cone_t *cone = &work->cone[which];
        if (predicted) {
            KERNEL_multiply(&cone->inverse, &cone->slack_step, &cone->multiplier_step, &cone->correction);
        } else {
            for (int32_t i = 0; i < 4; ++i) {
                for (int32_t j = 0; j < 4; ++j) {
                    cone->correction.at[i][j] = (os_real_t)0;
                }
            }
        }
    }
}

/* A start within both cones; slacks of vectors that are violated there begin above. */
static void KERNEL_start(KERNEL_work_t *work)
{
    const os_real_t s2 = work->scale * work->scale;
    const os_real_t size = os_fmin((os_real_t)0.2, (os_real_t)0.15 / s2);
    for (int32_t k = 0; k < 10; ++k) {
        work->x[k] = ((k == 0) || (k == 2) || (k == 5)) ? size : (os_real_t)0;
    }
    work->x[9] = (os_real_t)-1;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const os_real_t *row = work->coefficient[i];
        const os_real_t value = work->about[i].value + (size * ((row[0] + row[2]) + row[5]));
        work->slack[i] = os_fmax(value, (os_real_t)0.5);
        work->multiplier[i] = (os_real_t)1 / work->slack[i];
        work->slack_step[i] = (os_real_t)0;
        work->multiplier_step[i] = (os_real_t)0;
    }
}

/* Slacks and inverses of the cones at x; multipliers too at the start. False where a slack is not positive definite. */
static bool KERNEL_place_cones(bool first, KERNEL_work_t *work)
{
    bool inside = true;
    for (int32_t which = 0; which < 2; ++which) {
        KERNEL_cone_t *cone = &work->cone[which];
        KERNEL_fill_slack(which, work->x, (os_real_t)1, work->scale * work->scale, &cone->slack);
        inside = KERNEL_invert(&cone->slack, &cone->inverse) && inside;
        for (int32_t i = 0; i < 4; ++i) {
            for (int32_t j = 0; j < 4; ++j) {
                cone->multiplier.at[i][j] = first ? cone->inverse.at[i][j] : cone->multiplier.at[i][j];
                cone->slack_step.at[i][j] = (os_real_t)0;
                cone->multiplier_step.at[i][j] = (os_real_t)0;
            }
        }
    }
    return inside;
}

static void KERNEL_advance(os_real_t primal, os_real_t dual, KERNEL_work_t *work)
{
    for (int32_t k = 0; k < 10; ++k) {
        work->x[k] += primal * work->x_step[k];
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->slack[i] += primal * work->slack_step[i];
        work->multiplier[i] += dual * work->multiplier_step[i];
    }
    for (int32_t which = 0; which < 2; ++which) {
        KERNEL_cone_t *cone = &work->cone[which];
        for (int32_t i = 0; i < 4; ++i) {
            for (int32_t j = 0; j < 4; ++j) {
                cone->multiplier.at[i][j] += dual * cone->multiplier_step.at[i][j];
            }
        }
    }
}

/* Take the multipliers for weights, sum 1; false where there are none. */
static bool KERNEL_take_weights(KERNEL_work_t *work)
{
    os_real_t largest = (os_real_t)0;
    os_real_t sum = (os_real_t)0;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        largest = os_fmax(largest, work->multiplier[i] / work->about[i].size);
    }
    const bool usable = (largest > (os_real_t)0) && (largest <= OS_REAL_MAX);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const os_real_t weight = usable ? ((work->multiplier[i] / work->about[i].size) / largest) : work->weight[i];
        work->weight[i] = os_fmax(weight, (os_real_t)0);
        sum += work->weight[i];
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->weight[i] = work->weight[i] / sum;
    }
    return usable;
}

/* Best weights in the chart by a predictor-corrector of fixed length at most; false where it gave none. */
static bool KERNEL_optimise(KERNEL_work_t *work)
{
    const os_real_t enough = KERNEL_ENOUGH + ((os_real_t)64 * OS_EPSILON);
    os_real_t unmet = (os_real_t)1;
    bool going = true;
    KERNEL_start(work);
    for (int32_t iteration = 0; (iteration < KERNEL_ITERATIONS) && going; ++iteration) {
        going = KERNEL_place_cones(iteration == 0, work);
        const os_real_t gap = KERNEL_gap((os_real_t)0, (os_real_t)0, work);
        const bool met = (gap <= (enough * os_fmax(work->x[9], (os_real_t)0.01))) && (unmet <= (os_real_t)0.0001);
        going = going && !met && (gap <= OS_REAL_MAX);
        going = going && KERNEL_factorise(work);
        if (going) {
            KERNEL_set_correction(false, work);
            KERNEL_find_step((os_real_t)0, work);
            const os_real_t ahead = KERNEL_gap(KERNEL_reach(false, 4, work), KERNEL_reach(true, 4, work), work) / gap;
            const os_real_t centring = os_fmin((ahead * ahead) + (os_real_t)0.0001, (os_real_t)1);
            KERNEL_set_correction(true, work);
            KERNEL_find_step((centring * gap) / (os_real_t)(KERNEL_N + 8), work);
            const os_real_t primal = KERNEL_SHARE * KERNEL_reach(false, 7, work);
            const os_real_t dual = KERNEL_SHARE * KERNEL_reach(true, 7, work);
            KERNEL_advance(primal, dual, work);
            unmet = unmet * ((os_real_t)1 - os_fmin(primal, dual));
            going = os_fmax(primal, dual) > (os_real_t)0;
        }
    }
    return KERNEL_take_weights(work);
}
