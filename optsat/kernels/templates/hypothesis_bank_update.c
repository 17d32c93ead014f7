/* Copy the modes from `first` on into the lanes, and back. */
static void KERNEL_take_lanes(KERNEL_work_t *work, int32_t first)
{
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->lane_mean[e][l] = work->mean[e][first + l];
        }
    }
    for (int32_t k = 0; k < KERNEL_PACKED; ++k) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->lane_covariance[k][l] = work->covariance[k][first + l];
        }
    }
    for (int32_t b = 0; b < KERNEL_BITS; ++b) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->is_failed[b][l] = KERNEL_has_bit(first + l, b) ? (os_real_t)1 : (os_real_t)0;
        }
    }
}

static void KERNEL_give_lanes(KERNEL_work_t *work, int32_t first)
{
    for (int32_t e = 0; e < KERNEL_STATES; ++e) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->mean[e][first + l] = work->lane_mean[e][l];
        }
    }
    for (int32_t k = 0; k < KERNEL_PACKED; ++k) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->covariance[k][first + l] = work->lane_covariance[k][l];
        }
    }
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        work->log_probability[first + l] = work->lane_log[l];
    }
}

/* m = F m, P = F P F^T + Q, of F the numbers that are not zero by structure. */
static void KERNEL_predict_lanes(KERNEL_work_t *work, const os_real_t *F, const os_real_t *noise)
{
    for (int32_t i = 0; i < KERNEL_STATES; ++i) {
        os_real_t moved[KERNEL_LANES];
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            moved[l] = (os_real_t)0;
        }
        for (int32_t k = KERNEL_F_BEGIN[i]; k < KERNEL_F_BEGIN[i + 1]; ++k) {
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                moved[l] += F[k] * work->lane_mean[KERNEL_F_COLUMN[k]][l];
            }
        }
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->moved[i][l] = moved[l];
        }
        for (int32_t j = 0; j < KERNEL_STATES; ++j) {
            os_real_t sum[KERNEL_LANES];
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                sum[l] = (os_real_t)0;
            }
            for (int32_t k = KERNEL_F_BEGIN[i]; k < KERNEL_F_BEGIN[i + 1]; ++k) {
                const int32_t at = KERNEL_at(KERNEL_F_COLUMN[k], j);
                for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                    sum[l] += F[k] * work->lane_covariance[at][l];
                }
            }
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                work->product[i][j][l] = sum[l];
            }
        }
    }
    for (int32_t i = 0; i < KERNEL_STATES; ++i) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->lane_mean[i][l] = work->moved[i][l];
        }
        for (int32_t j = 0; j <= i; ++j) {
            os_real_t sum[KERNEL_LANES];
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                sum[l] = (os_real_t)0;
            }
            for (int32_t k = KERNEL_F_BEGIN[j]; k < KERNEL_F_BEGIN[j + 1]; ++k) {
                for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                    sum[l] += F[k] * work->product[i][KERNEL_F_COLUMN[k]][l];
                }
            }
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                work->lane_covariance[KERNEL_at(i, j)][l] = sum[l];
            }
        }
        const int32_t a = i - KERNEL_FIRST_ACTUATED;
        const int32_t bit = (a >= 0) ? KERNEL_BIT_OF_ACTUATED[(a >= 0) ? a : 0] : 0;
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            const os_real_t part = (a >= 0) ? work->is_failed[bit][l] : (os_real_t)1;
            work->lane_covariance[KERNEL_at(i, i)][l] += part * noise[i];
        }
    }
}

/* What row r of the measurement sees: column P h, variance h P h + R, and the innovation that is left. */
static void KERNEL_project(KERNEL_work_t *work, const os_real_t *H, const os_real_t *seen, int32_t r)
{
    for (int32_t i = 0; i < KERNEL_STATES; ++i) {
        os_real_t sum[KERNEL_LANES];
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            sum[l] = (os_real_t)0;
        }
        for (int32_t k = KERNEL_H_BEGIN[r]; k < KERNEL_H_BEGIN[r + 1]; ++k) {
            const int32_t at = KERNEL_at(i, KERNEL_H_COLUMN[k]);
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                sum[l] += H[k] * work->lane_covariance[at][l];
            }
        }
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->projected[i][l] = sum[l];
        }
    }
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        work->variance[l] = seen[KERNEL_MEASURED + r];
        work->residual[l] = seen[r];
    }
    for (int32_t k = KERNEL_H_BEGIN[r]; k < KERNEL_H_BEGIN[r + 1]; ++k) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->variance[l] += H[k] * work->projected[KERNEL_H_COLUMN[k]][l];
            work->residual[l] -= H[k] * work->lane_mean[KERNEL_H_COLUMN[k]][l];
        }
    }
}

/* Log density of a failed channel: what needs no state, plus half a normal density about what is expected, as much
   wider as an erratic sensor errs; far out it stays as it is at six deviations, for all modes alike. */
static void KERNEL_failed_density(
    KERNEL_work_t *work, const os_real_t *H, const os_real_t *seen, int32_t c, os_real_t without_state)
{
    const int32_t begin = KERNEL_CHANNEL_BEGIN[c];
    const int32_t rows = KERNEL_CHANNEL_BEGIN[c + 1] - begin;
    for (int32_t i = 0; i < rows; ++i) {
        KERNEL_project(work, H, seen, begin + i);
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->joint_residual[i][l] = work->residual[l];
            work->joint[i][i][l] = work->variance[l] + KERNEL_ERRATIC_VARIANCE[c];
        }
        for (int32_t j = 0; j < i; ++j) {
            os_real_t sum[KERNEL_LANES];
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                sum[l] = (os_real_t)0;
            }
            for (int32_t k = KERNEL_H_BEGIN[begin + j]; k < KERNEL_H_BEGIN[begin + j + 1]; ++k) {
                for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                    sum[l] += H[k] * work->projected[KERNEL_H_COLUMN[k]][l];
                }
            }
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                work->joint[i][j][l] = sum[l];
            }
        }
    }
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        work->determinant[l] = (os_real_t)1;
        work->square[l] = (os_real_t)0;
    }
    for (int32_t j = 0; j < rows; ++j) {
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            work->determinant[l] *= work->joint[j][j][l];
            work->square[l] += (work->joint_residual[j][l] * work->joint_residual[j][l]) / work->joint[j][j][l];
        }
        for (int32_t i = j + 1; i < rows; ++i) {
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                work->factor[l] = work->joint[i][j][l] / work->joint[j][j][l];
                work->joint_residual[i][l] -= work->factor[l] * work->joint_residual[j][l];
            }
            for (int32_t k = j + 1; k <= i; ++k) {
                for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                    work->joint[i][k][l] -= work->factor[l] * work->joint[k][j][l];
                }
            }
        }
    }
    const os_real_t offset = ((os_real_t)rows * KERNEL_LOG_TWO_PI) + KERNEL_TWICE_LOG_TWO;
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        os_real_t argument = work->determinant[l];
        os_real_t log_determinant = (os_real_t)0;
        KERNEL_log_leaf(&argument, &log_determinant);
        const os_real_t square = os_fmin(work->square[l], KERNEL_FARTHEST);
        const os_real_t erratic = (os_real_t)-0.5 * ((square + log_determinant) + offset);
        const os_real_t top = os_fmax(erratic, without_state);
        os_real_t less = -os_fabs(erratic - without_state);
        os_real_t ratio = (os_real_t)0;
        KERNEL_exp_leaf(&less, &ratio);
        os_real_t sum = (os_real_t)1 + ratio;
        os_real_t log_sum = (os_real_t)0;
        KERNEL_log_leaf(&sum, &log_sum);
        work->log_failed[l] = top + log_sum;
    }
}

/* Measure with the rows of channel c, one after another, where it is healthy; its log density joins that of the mode. */
static void KERNEL_measure(
    KERNEL_work_t *work, const os_real_t *H, const os_real_t *seen, int32_t c, os_real_t without_state)
{
    const int32_t bit = KERNEL_BIT_OF_CHANNEL[c];
    const int32_t begin = KERNEL_CHANNEL_BEGIN[c];
    const int32_t end = KERNEL_CHANNEL_BEGIN[c + 1];
    if (bit >= 0) {
        KERNEL_failed_density(work, H, seen, c, without_state);
    }
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        work->determinant[l] = (os_real_t)1;
        work->square[l] = (os_real_t)0;
        work->used[l] = (bit >= 0) ? ((os_real_t)1 - work->is_failed[(bit >= 0) ? bit : 0][l]) : (os_real_t)1;
    }
    for (int32_t r = begin; r < end; ++r) {
        KERNEL_project(work, H, seen, r);
        for (int32_t l = 0; l < KERNEL_LANES; ++l) {
            const os_real_t inverse = (os_real_t)1 / work->variance[l];
            work->determinant[l] *= work->variance[l];
            work->square[l] += (work->residual[l] * work->residual[l]) * inverse;
            work->weight[l] = work->used[l] * inverse;
            work->is_definite[l] = (work->variance[l] > (os_real_t)0) ? work->is_definite[l] : (os_real_t)0;
        }
        for (int32_t i = 0; i < KERNEL_STATES; ++i) {
            for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                work->gain[l] = work->projected[i][l] * work->weight[l];
                work->lane_mean[i][l] += work->gain[l] * work->residual[l];
            }
            for (int32_t j = 0; j <= i; ++j) {
                for (int32_t l = 0; l < KERNEL_LANES; ++l) {
                    work->lane_covariance[KERNEL_at(i, j)][l] -= work->gain[l] * work->projected[j][l];
                }
            }
        }
    }
    const int32_t rows = end - begin;
    const os_real_t offset = (os_real_t)rows * KERNEL_LOG_TWO_PI;
    for (int32_t l = 0; l < KERNEL_LANES; ++l) {
        os_real_t argument = work->determinant[l];
        os_real_t log_determinant = (os_real_t)0;
        KERNEL_log_leaf(&argument, &log_determinant);
        const os_real_t healthy = (os_real_t)-0.5 * ((work->square[l] + log_determinant) + offset);
        work->lane_log[l] += (work->used[l] > (os_real_t)0) ? healthy : work->log_failed[l];
    }
}
