/* os_adapt.h: between the layouts of these kernels and those of other flight code. The two arguments of a call must not
 * be the same memory. */
#ifndef OS_ADAPT_H
#define OS_ADAPT_H

#include "os_rt.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Kernels take and give quaternions as [x, y, z, w], scalar last; others as [w, x, y, z]. */
static inline void os_quaternion_from_scalar_first(const os_real_t *wxyz, os_real_t *xyzw)
{
    xyzw[0] = wxyz[1];
    xyzw[1] = wxyz[2];
    xyzw[2] = wxyz[3];
    xyzw[3] = wxyz[0];
}

static inline void os_quaternion_to_scalar_first(const os_real_t *xyzw, os_real_t *wxyz)
{
    wxyz[0] = xyzw[3];
    wxyz[1] = xyzw[0];
    wxyz[2] = xyzw[1];
    wxyz[3] = xyzw[2];
}

/* The opposite direction: q_NB of q_BN, scalar last. */
static inline void os_quaternion_inverse(const os_real_t *q_BN, os_real_t *q_NB)
{
    q_NB[0] = -q_BN[0];
    q_NB[1] = -q_BN[1];
    q_NB[2] = -q_BN[2];
    q_NB[3] = q_BN[3];
}

/* Kernels count matrices by rows: entry (i, j) of (m, n) is [n * i + j]; others by columns: [m * j + i]. */
static inline void os_matrix_from_columns(const os_real_t *by_columns, uint32_t m, uint32_t n, os_real_t *by_rows)
{
    for (uint32_t i = 0U; i < m; i++) {
        for (uint32_t j = 0U; j < n; j++) {
            by_rows[(i * n) + j] = by_columns[(j * m) + i];
        }
    }
}

static inline void os_matrix_to_columns(const os_real_t *by_rows, uint32_t m, uint32_t n, os_real_t *by_columns)
{
    for (uint32_t i = 0U; i < m; i++) {
        for (uint32_t j = 0U; j < n; j++) {
            by_columns[(j * m) + i] = by_rows[(i * n) + j];
        }
    }
}

#ifdef __cplusplus
}
#endif

#endif
