/* One rotation of Jacobi's method, which makes entry p, q zero. */
static void KERNEL_rotate(int32_t n, int32_t p, int32_t q, KERNEL_work_t *work)
{
    os_real_t (*a)[4] = work->matrix;
    const os_real_t between = a[p][q];
    const os_real_t ratio = (a[q][q] - a[p][p]) / ((os_real_t)2 * between);
    const os_real_t size = os_fabs(ratio) + os_sqrt((ratio * ratio) + (os_real_t)1);
    const os_real_t tangent = os_copysign((os_real_t)1 / size, ratio);
    const os_real_t cosine = (os_real_t)1 / os_sqrt((tangent * tangent) + (os_real_t)1);
    const os_real_t sine = tangent * cosine;
    a[p][p] = a[p][p] - (tangent * between);
    a[q][q] = a[q][q] + (tangent * between);
    a[p][q] = (os_real_t)0;
    a[q][p] = (os_real_t)0;
    for (int32_t k = 0; k < n; ++k) {
        if ((k != p) && (k != q)) {
            const os_real_t at_p = (cosine * a[k][p]) - (sine * a[k][q]);
            const os_real_t at_q = (sine * a[k][p]) + (cosine * a[k][q]);
            a[k][p] = at_p;
            a[p][k] = at_p;
            a[k][q] = at_q;
            a[q][k] = at_q;
        }
        const os_real_t along_p = (cosine * work->vectors[k][p]) - (sine * work->vectors[k][q]);
        const os_real_t along_q = (sine * work->vectors[k][p]) + (cosine * work->vectors[k][q]);
        work->vectors[k][p] = along_p;
        work->vectors[k][q] = along_q;
    }
}

/* Eigenvalues to the diagonal and eigenvectors to the columns of `vectors`, of the leading n x n part of `matrix`. */
static void KERNEL_diagonalise(int32_t n, KERNEL_work_t *work)
{
    bool turning = true;
    for (int32_t i = 0; i < 4; ++i) {
        for (int32_t j = 0; j < 4; ++j) {
            work->vectors[i][j] = (i == j) ? (os_real_t)1 : (os_real_t)0;
        }
    }
    for (int32_t sweep = 0; (sweep < KERNEL_SWEEPS) && turning; ++sweep) {
        os_real_t rest = (os_real_t)0;
        for (int32_t q = 1; q < n; ++q) {
            for (int32_t p = 0; p < q; ++p) {
                const os_real_t between = os_fabs(work->matrix[p][q]);
                rest = os_fmax(rest, between);
                if (between > (os_real_t)0) {
                    KERNEL_rotate(n, p, q, work);
                }
            }
        }
        turning = rest > (OS_EPSILON * OS_EPSILON);
    }
}
