/* One step of the explicit midpoint method, inputs held over the step. */

/*@sizes*/

/*@step rate: N + M + TIME -> N */

typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_M + KERNEL_TIME];
    os_real_t slope[KERNEL_N];
    KERNEL_rate_work_t rate;
} KERNEL_work_t;

/* x: state (N), inputs (M), time (TIME), dt; y: state (N) */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t dt = x[KERNEL_N + KERNEL_M + KERNEL_TIME];
    const os_real_t half = dt / (os_real_t)2;
    os_status_t status = KERNEL_rate_body(x, work->slope, &work->rate);
    for (int32_t i = 0; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
        work->argument[i] = x[i];
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->argument[i] = x[i] + (half * work->slope[i]);
    }
    for (int32_t i = KERNEL_N + KERNEL_M; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
        work->argument[i] = x[i] + half;
    }
    if (status == OS_OK) {
        status = KERNEL_rate_body(work->argument, work->slope, &work->rate);
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = (status == OS_OK) ? (x[i] + (dt * work->slope[i])) : (os_real_t)NAN;
    }
    return status;
}
