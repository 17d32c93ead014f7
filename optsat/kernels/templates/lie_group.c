/* One step of the commutator-free Lie-group method of order four: the state never leaves its group. */

/*@sizes*/

/*@step rate: N + M + TIME -> D */

/*@leaf move: N + D -> N */

typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_M + KERNEL_TIME];
    os_real_t moved[KERNEL_N + KERNEL_D];
    os_real_t slope[4][KERNEL_D];
    os_real_t state[4][KERNEL_N];
    KERNEL_rate_work_t rate;
} KERNEL_work_t;

/* The state moved by the displacement already in its place. */
static void KERNEL_move(KERNEL_work_t *work, const os_real_t *from, os_real_t *state)
{
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->moved[i] = from[i];
    }
    KERNEL_move_leaf(work->moved, state);
}

/* Slope of a stage; the status before, or of the rate. */
static os_status_t KERNEL_find_slope(KERNEL_work_t *work, const os_real_t *x, const os_real_t *state,
    os_real_t ahead, int32_t stage, os_status_t before)
{
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->argument[i] = state[i];
    }
    for (int32_t i = KERNEL_N; i < (KERNEL_N + KERNEL_M); ++i) {
        work->argument[i] = x[i];
    }
    for (int32_t i = KERNEL_N + KERNEL_M; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
        work->argument[i] = x[i] + ahead;
    }
    const os_status_t found = KERNEL_rate_body(work->argument, work->slope[stage], &work->rate);
    return (before == OS_OK) ? found : before;
}

/* x: state (N), inputs (M), time (TIME), dt; y: state (N) */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t dt = x[KERNEL_N + KERNEL_M + KERNEL_TIME];
    const os_real_t half = dt / (os_real_t)2;
    const os_real_t twelfth = dt / (os_real_t)12;
    os_status_t status = KERNEL_find_slope(work, x, x, (os_real_t)0, 0, OS_OK);
    for (int32_t stage = 1; stage < 3; ++stage) {
        for (int32_t i = 0; i < KERNEL_D; ++i) {
            work->moved[KERNEL_N + i] = half * work->slope[stage - 1][i];
        }
        KERNEL_move(work, x, work->state[stage]);
        status = KERNEL_find_slope(work, x, work->state[stage], half, stage, status);
    }
    for (int32_t i = 0; i < KERNEL_D; ++i) {
        work->moved[KERNEL_N + i] = (dt * work->slope[2][i]) - (half * work->slope[0][i]);
    }
    KERNEL_move(work, work->state[1], work->state[3]);
    status = KERNEL_find_slope(work, x, work->state[3], dt, 3, status);
    for (int32_t part = 0; part < 2; ++part) {
        for (int32_t i = 0; i < KERNEL_D; ++i) {
            const os_real_t early = work->slope[0][i];
            const os_real_t late = work->slope[3][i];
            const os_real_t middle = (os_real_t)2 * (work->slope[1][i] + work->slope[2][i]);
            const os_real_t ends = (part == 0) ? (((os_real_t)3 * early) - late) : (((os_real_t)3 * late) - early);
            work->moved[KERNEL_N + i] = twelfth * (middle + ends);
        }
        KERNEL_move(work, (part == 0) ? x : work->state[0], (part == 0) ? work->state[0] : work->state[1]);
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = (status == OS_OK) ? work->state[1][i] : (os_real_t)NAN;
    }
    return status;
}
