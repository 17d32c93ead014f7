/* Integrate: a fixed number of steps of any one-step method; stops before the first state that is not finite. */

/*@sizes*/

/*@step advance: N + M + TIME + 1 -> N */

/*@leaf restore: N -> N */

typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_M + KERNEL_TIME + 1];
    os_real_t moved[KERNEL_N];
    os_real_t state[KERNEL_N];
    os_real_t kept[KERNEL_ROWS][KERNEL_N];
    KERNEL_advance_work_t advance;
} KERNEL_work_t;

/* x: state (N), inputs (HELD, M), time (TIME), dt; y: states (ROWS, N), row i after i EVERY steps, steps completed */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t *inputs = &x[KERNEL_N];
    const os_real_t *time = &inputs[KERNEL_HELD * KERNEL_M];
    const os_real_t dt = time[KERNEL_TIME];
    os_status_t status = os_all_finite(x, KERNEL_N) ? OS_OK : OS_E_NOT_FINITE;
    int32_t completed = 0;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->state[i] = x[i];
        work->kept[0][i] = (status == OS_OK) ? x[i] : (os_real_t)NAN;
    }
    for (int32_t row = 1; row < KERNEL_ROWS; ++row) {
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            work->kept[row][i] = (os_real_t)NAN;
        }
    }
    for (int32_t step = 0; (step < KERNEL_STEPS) && (status == OS_OK); ++step) {
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            work->argument[i] = work->state[i];
        }
        for (int32_t i = 0; i < KERNEL_M; ++i) {
            work->argument[KERNEL_N + i] = inputs[(((KERNEL_HELD == 1) ? 0 : step) * KERNEL_M) + i];
        }
        for (int32_t i = 0; i < KERNEL_TIME; ++i) {
            work->argument[KERNEL_N + KERNEL_M + i] = time[i] + ((os_real_t)step * dt);
        }
        work->argument[KERNEL_N + KERNEL_M + KERNEL_TIME] = dt;
        status = KERNEL_advance_body(work->argument, work->moved, &work->advance);
        if (status == OS_OK) {
            KERNEL_restore_leaf(work->moved, work->state);
            status = os_all_finite(work->state, KERNEL_N) ? OS_OK : OS_E_OUTPUT;
        }
        if (status == OS_OK) {
            completed = step + 1;
            for (int32_t i = 0; (i < KERNEL_N) && ((completed % KERNEL_EVERY) == 0); ++i) {
                work->kept[completed / KERNEL_EVERY][i] = work->state[i];
            }
        }
    }
    for (int32_t row = 0; row < KERNEL_ROWS; ++row) {
        for (int32_t i = 0; i < KERNEL_N; ++i) {
            y[(row * KERNEL_N) + i] = work->kept[row][i];
        }
    }
    y[KERNEL_ROWS * KERNEL_N] = (os_real_t)completed;
    return status;
}
