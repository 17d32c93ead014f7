/* One step of the classical Runge-Kutta method of order four, inputs held over the step. */

/*@sizes*/

/*@step rate: N + M + TIME -> N */

typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_M + KERNEL_TIME];
    os_real_t slope[4][KERNEL_N];
    KERNEL_rate_work_t rate;
} KERNEL_work_t;

/* x: state (N), inputs (M), time (TIME), dt; y: state (N) */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t dt = x[KERNEL_N + KERNEL_M + KERNEL_TIME];
    const os_real_t half = dt / (os_real_t)2;
    os_status_t status = OS_OK;
    for (int32_t i = 0; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
        work->argument[i] = x[i];
    }
    for (int32_t stage = 0; (stage < 4) && (status == OS_OK); ++stage) {
        const os_real_t ahead = (stage == 0) ? (os_real_t)0 : ((stage == 3) ? dt : half);
        for (int32_t i = 0; (i < KERNEL_N) && (stage > 0); ++i) {
            work->argument[i] = x[i] + (ahead * work->slope[stage - 1][i]);
        }
        for (int32_t i = KERNEL_N + KERNEL_M; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
            work->argument[i] = x[i] + ahead;
        }
        status = KERNEL_rate_body(work->argument, work->slope[stage], &work->rate);
    }
    for (int32_t i = 0; (i < KERNEL_N) && (status == OS_OK); ++i) {
        const os_real_t sum = ((work->slope[0][i] + ((os_real_t)2 * work->slope[1][i]))
                               + ((os_real_t)2 * work->slope[2][i])) + work->slope[3][i];
        y[i] = x[i] + (dt * (sum / (os_real_t)6));
    }
    for (int32_t i = 0; (i < KERNEL_N) && (status != OS_OK); ++i) {
        y[i] = (os_real_t)NAN;
    }
    return status;
}
