/* One step of the explicit midpoint method, inputs held over the step. */

/*@sizes*/

/*@leaf rate: N + M + TIME -> N */

typedef struct {
    os_real_t argument[KERNEL_N + KERNEL_M + KERNEL_TIME];
    os_real_t slope[KERNEL_N];
} KERNEL_work_t;

/* x: state (N), inputs (M), time (TIME), dt; y: state (N) */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    const os_real_t dt = x[KERNEL_N + KERNEL_M + KERNEL_TIME];
    const os_real_t half = dt / (os_real_t)2;
    KERNEL_rate_leaf(x, work->slope);
    for (int32_t i = 0; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
        work->argument[i] = x[i];
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        work->argument[i] = x[i] + (half * work->slope[i]);
    }
    for (int32_t i = KERNEL_N + KERNEL_M; i < (KERNEL_N + KERNEL_M + KERNEL_TIME); ++i) {
        work->argument[i] = x[i] + half;
    }
    KERNEL_rate_leaf(work->argument, work->slope);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        y[i] = x[i] + (dt * work->slope[i]);
    }
    return OS_OK;
}
