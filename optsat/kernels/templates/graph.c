/* Graph: every node of a sparse graph from its own state and the weighted sum of what its neighbours send. */

/*@sizes*/

/*@leaf send: K -> G */

/*@leaf node: K + G + DEGREES + A + C -> K */

typedef struct {
    os_real_t state[KERNEL_NODES][KERNEL_K];
    os_real_t sent[KERNEL_NODES][KERNEL_G];
    os_real_t result[KERNEL_NODES][KERNEL_K];
    os_real_t argument[KERNEL_K + KERNEL_G + KERNEL_DEGREES + KERNEL_A + KERNEL_C];
} KERNEL_work_t;

/* x: states (NODES, K), what nodes have of their own (NODES, A), what they share (C); y: states (NODES, K) */
static os_status_t KERNEL_body(const os_real_t *x, os_real_t *y, KERNEL_work_t *work)
{
    /*@tables*/
    const os_real_t *own = &x[KERNEL_NODES * KERNEL_K];
    const os_real_t *shared = &own[KERNEL_NODES * KERNEL_A];
    for (int32_t i = 0; i < KERNEL_NODES; ++i) {
        for (int32_t k = 0; k < KERNEL_K; ++k) {
            work->state[i][k] = x[(KERNEL_ORDER[i] * KERNEL_K) + k];
        }
        KERNEL_send_leaf(work->state[i], work->sent[i]);
    }
    for (int32_t k = 0; k < KERNEL_C; ++k) {
        work->argument[KERNEL_K + KERNEL_G + KERNEL_DEGREES + KERNEL_A + k] = shared[k];
    }
    for (int32_t i = 0; i < KERNEL_NODES; ++i) {
        os_real_t sum[KERNEL_G];
        os_real_t degree = (os_real_t)0;
        for (int32_t k = 0; k < KERNEL_G; ++k) {
            sum[k] = (os_real_t)0;
        }
        for (int32_t edge = KERNEL_ROWS[i]; edge < KERNEL_ROWS[i + 1]; ++edge) {
            const os_real_t weight = KERNEL_WEIGHT[edge];
            degree += weight;
            for (int32_t k = 0; k < KERNEL_G; ++k) {
                sum[k] += weight * work->sent[KERNEL_COLUMN[edge]][k];
            }
        }
        for (int32_t k = 0; k < KERNEL_K; ++k) {
            work->argument[k] = work->state[i][k];
        }
        for (int32_t k = 0; k < KERNEL_G; ++k) {
            work->argument[KERNEL_K + k] = sum[k];
        }
        for (int32_t k = 0; k < KERNEL_DEGREES; ++k) {
            work->argument[KERNEL_K + KERNEL_G + k] = degree;
        }
        for (int32_t k = 0; k < KERNEL_A; ++k) {
            work->argument[KERNEL_K + KERNEL_G + KERNEL_DEGREES + k] = own[(KERNEL_ORDER[i] * KERNEL_A) + k];
        }
        KERNEL_node_leaf(work->argument, work->result[i]);
    }
    for (int32_t i = 0; i < KERNEL_NODES; ++i) {
        for (int32_t k = 0; k < KERNEL_K; ++k) {
            y[(KERNEL_ORDER[i] * KERNEL_K) + k] = work->result[i][k];
        }
    }
    os_status_t status = OS_OK;
    if (!os_all_finite(&work->result[0][0], KERNEL_NODES * KERNEL_K)) {
        const int32_t arguments = (KERNEL_NODES * (KERNEL_K + KERNEL_A)) + KERNEL_C;
        status = os_all_finite(x, arguments) ? OS_E_OUTPUT : OS_E_NOT_FINITE;
    }
    return status;
}
