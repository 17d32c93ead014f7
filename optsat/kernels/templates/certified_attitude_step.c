/* Add the cone's part of the Schur complement: of every pair of unknowns, with E the matrix of each,
   the inner product of one E with the symmetric part of inverse * (the other E) * multiplier. */
static void KERNEL_add_cone(int32_t which, KERNEL_work_t *work)
{
    const KERNEL_matrix_t *a = &work->cone[which].inverse;
    const KERNEL_matrix_t *m = &work->cone[which].multiplier;
    const os_real_t s2 = work->scale * work->scale;
    KERNEL_matrix_t image;
    KERNEL_matrix_t entries;
    os_real_t row[4][4][10];
    os_real_t column[10];
    for (int32_t k = 0; k < 4; ++k) {
        for (int32_t l = k; l < 4; ++l) {
            for (int32_t i = 0; i < 4; ++i) {
                for (int32_t j = i; j < 4; ++j) {
                    const os_real_t above = (a->at[i][k] * m->at[l][j]) + (a->at[i][l] * m->at[k][j]);
                    const os_real_t below = (a->at[j][k] * m->at[l][i]) + (a->at[j][l] * m->at[k][i]);
                    image.at[i][j] = (os_real_t)0.25 * (above + below);
                }
            }
            KERNEL_fill_adjoint(which, &image, s2, row[k][l]);
        }
    }
    for (int32_t i = 0; i < 10; ++i) {
        for (int32_t k = 0; k < 4; ++k) {
            for (int32_t l = k; l < 4; ++l) {
                entries.at[k][l] = row[k][l][i];
            }
        }
        KERNEL_fill_adjoint(which, &entries, s2, column);
        for (int32_t k = i; k < 10; ++k) {
            work->schur[k][i] += column[k];
        }
    }
}

/* The Schur complement, factorised as L D L'; false where it is not positive definite. */
static bool KERNEL_factorise(KERNEL_work_t *work)
{
    bool definite = true;
    for (int32_t i = 0; i < 10; ++i) {
        for (int32_t j = 0; j <= i; ++j) {
            work->schur[i][j] = (os_real_t)0;
        }
    }
    for (int32_t k = 0; k < KERNEL_N; ++k) {
        const os_real_t ratio = work->multiplier[k] / work->slack[k];
        for (int32_t i = 0; i < 9; ++i) {
            const os_real_t share = ratio * work->coefficient[k][i];
            for (int32_t j = 0; j <= i; ++j) {
                work->schur[i][j] += share * work->coefficient[k][j];
            }
        }
    }
    KERNEL_add_cone(0, work);
    KERNEL_add_cone(1, work);
    for (int32_t j = 0; j < 10; ++j) {
        const os_real_t pivot = work->schur[j][j];
        definite = definite && (pivot > (os_real_t)0) && (pivot <= OS_REAL_MAX);
        work->pivot[j] = (os_real_t)1 / (definite ? pivot : (os_real_t)1);
        for (int32_t i = j + 1; i < 10; ++i) {
            const os_real_t factor = work->schur[i][j] * work->pivot[j];
            for (int32_t k = j + 1; k <= i; ++k) {
                work->schur[i][k] -= factor * work->schur[k][j];
            }
        }
        for (int32_t i = j + 1; i < 10; ++i) {
            work->schur[i][j] = work->schur[i][j] * work->pivot[j];
        }
    }
    return definite;
}

static void KERNEL_substitute(KERNEL_work_t *work)
{
    for (int32_t i = 0; i < 10; ++i) {
        os_real_t rest = work->right[i];
        for (int32_t k = 0; k < i; ++k) {
            rest -= work->schur[i][k] * work->x_step[k];
        }
        work->x_step[i] = rest;
    }
    for (int32_t i = 9; i >= 0; --i) {
        os_real_t rest = work->x_step[i] * work->pivot[i];
        for (int32_t k = i + 1; k < 10; ++k) {
            rest -= work->schur[k][i] * work->x_step[k];
        }
        work->x_step[i] = rest;
    }
}

/* The step of Helmberg, Kojima and Monteiro to slack * multiplier = target, with the correction of second order. */
static void KERNEL_find_step(os_real_t target, KERNEL_work_t *work)
{
    const os_real_t s2 = work->scale * work->scale;
    os_real_t rest[KERNEL_N];
    KERNEL_matrix_t image;
    os_real_t part[10];
    for (int32_t k = 0; k < 10; ++k) {
        work->right[k] = (k == 9) ? (os_real_t)1 : (os_real_t)0;
    }
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        os_real_t value = work->about[i].value;
        for (int32_t k = 0; k < 9; ++k) {
            value += work->coefficient[i][k] * work->x[k];
        }
        rest[i] = value - work->slack[i];
        const os_real_t pull =
            ((target - (rest[i] * work->multiplier[i])) / work->slack[i]) - work->correction[i];
        for (int32_t k = 0; k < 9; ++k) {
            work->right[k] += work->coefficient[i][k] * pull;
        }
    }
    for (int32_t which = 0; which < 2; ++which) {
        const KERNEL_cone_t *cone = &work->cone[which];
        for (int32_t i = 0; i < 4; ++i) {
            for (int32_t j = 0; j < 4; ++j) {
                image.at[i][j] = (target * cone->inverse.at[i][j]) - cone->correction.at[i][j];
            }
        }
        KERNEL_fill_adjoint(which, &image, s2, part);
        for (int32_t k = 0; k < 10; ++k) {
            work->right[k] += part[k];
        }
    }
    KERNEL_substitute(work);
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        os_real_t step = rest[i];
        for (int32_t k = 0; k < 9; ++k) {
            step += work->coefficient[i][k] * work->x_step[k];
        }
        work->slack_step[i] = step;
        const os_real_t aim = (target - (step * work->multiplier[i])) / work->slack[i];
        work->multiplier_step[i] = (aim - work->multiplier[i]) - work->correction[i];
    }
    for (int32_t which = 0; which < 2; ++which) {
        KERNEL_cone_t *cone = &work->cone[which];
        KERNEL_fill_slack(which, work->x_step, (os_real_t)0, s2, &cone->slack_step);
        KERNEL_multiply(&cone->inverse, &cone->slack_step, &cone->multiplier, &image);
        for (int32_t i = 0; i < 4; ++i) {
            for (int32_t j = 0; j < 4; ++j) {
                const os_real_t aim = (target * cone->inverse.at[i][j]) - image.at[i][j];
                cone->multiplier_step.at[i][j] = (aim - cone->multiplier.at[i][j]) - cone->correction.at[i][j];
            }
        }
    }
}

/* The longest of a few step lengths up to 1 that keeps slacks, or multipliers, positive; 0 where none does. */
static os_real_t KERNEL_reach(bool of_multipliers, int32_t halvings, const KERNEL_work_t *work)
{
    const os_real_t *from = of_multipliers ? work->multiplier : work->slack;
    const os_real_t *step = of_multipliers ? work->multiplier_step : work->slack_step;
    os_real_t inside = (os_real_t)0;
    os_real_t outside = (os_real_t)1;
    for (int32_t i = 0; i < KERNEL_N; ++i) {
        const os_real_t end = (step[i] < (os_real_t)0) ? -(from[i] / step[i]) : (os_real_t)1;
        outside = os_fmin(outside, end);
    }
    os_real_t length = outside;
    bool open = true;
    for (int32_t k = 0; (k <= halvings) && open; ++k) {
        bool stays = true;
        for (int32_t which = 0; which < 2; ++which) {
            const KERNEL_cone_t *cone = &work->cone[which];
            const KERNEL_matrix_t *matrix = of_multipliers ? &cone->multiplier : &cone->slack;
            const KERNEL_matrix_t *change = of_multipliers ? &cone->multiplier_step : &cone->slack_step;
            stays = stays && KERNEL_stays_definite(matrix, change, length);
        }
        inside = stays ? length : inside;
        outside = stays ? outside : length;
        length = (os_real_t)0.5 * (inside + outside);
        open = inside < outside;
    }
    return inside;
}
