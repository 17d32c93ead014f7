/* The Schur complement <F_i, inverse F_j multiplier> as L D L', its diagonal raised by what rounding may have taken; an
   unknown whose pivot is lost all the same stays as it is. False where there is a number that is none. */
static bool KERNEL_factorise(KERNEL_work_t *work)
{
    bool finite = true;
    for (int32_t j = 0; j < KERNEL_M; ++j) {
        KERNEL_unpack(work->given[j + 1], &work->present);
        KERNEL_multiply(&work->inverse, &work->present, &work->half);
        KERNEL_multiply(&work->half, &work->multiplier, &work->image);
        KERNEL_pack(&work->image, work->packed);
        for (int32_t i = j; i < KERNEL_M; ++i) {
            work->schur[i][j] = KERNEL_dot(work->given[i + 1], work->packed);
        }
        work->schur[j][j] += ((os_real_t)64 * OS_EPSILON) * work->schur[j][j];
    }
    for (int32_t j = 0; j < KERNEL_M; ++j) {
        const os_real_t pivot = work->schur[j][j];
        const bool usable = pivot > (os_real_t)0;
        finite = finite && (os_fabs(pivot) <= OS_REAL_MAX);
        work->pivot[j] = usable ? ((os_real_t)1 / pivot) : (os_real_t)0;
        for (int32_t i = j + 1; i < KERNEL_M; ++i) {
            const os_real_t factor = work->schur[i][j] * work->pivot[j];
            for (int32_t k = j + 1; k <= i; ++k) {
                work->schur[i][k] -= factor * work->schur[k][j];
            }
        }
        for (int32_t i = j + 1; i < KERNEL_M; ++i) {
            work->schur[i][j] = work->schur[i][j] * work->pivot[j];
        }
    }
    return finite;
}

/* The unknowns for which the Schur complement gives `right`. */
static void KERNEL_substitute(os_real_t *step, KERNEL_work_t *work)
{
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        os_real_t rest = work->right[i];
        for (int32_t k = 0; k < i; ++k) {
            rest -= work->schur[i][k] * step[k];
        }
        step[i] = rest;
    }
    for (int32_t i = KERNEL_M - 1; i >= 0; --i) {
        os_real_t rest = step[i] * work->pivot[i];
        for (int32_t k = i + 1; k < KERNEL_M; ++k) {
            rest -= work->schur[k][i] * step[k];
        }
        step[i] = rest;
    }
}

/* What a change of tau alone does, x / tau being kept: it stretches the present value of the inequality. */
static void KERNEL_centre(KERNEL_work_t *work)
{
    const os_real_t reciprocal = (os_real_t)1 / work->tau;
    KERNEL_transform(&work->rest, &work->multiplier, work, &work->rest_image);
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                work->present.at[b][i][j] = reciprocal * (work->slack.at[b][i][j] + work->rest.at[b][i][j]);
                work->image.at[b][i][j] = reciprocal * (work->multiplier.at[b][i][j] + work->rest_image.at[b][i][j]);
            }
        }
    }
    KERNEL_draw(&work->image, work);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->right[i] = work->cost[i] + work->drawn[i + 1];
        work->excess[i] = work->drawn[i + 1] - work->cost[i];
    }
    KERNEL_substitute(work->sensitivity, work);
    work->lost = work->kappa + KERNEL_inner(&work->present, &work->multiplier);
    os_real_t steepness = (work->kappa / work->tau) + KERNEL_inner(&work->present, &work->image);
    /* what the sum below takes away must leave something, which rounding does not know */
    const os_real_t least = os_fmax((os_real_t)0.01 * steepness, OS_REAL_MIN);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        steepness -= work->excess[i] * work->sensitivity[i];
    }
    work->steepness = os_fmax(steepness, least);
}

/* The step of Helmberg, Kojima and Monteiro to slack * multiplier = target and tau * kappa = target that makes good a
   share of all that is unmet, with the corrections of second order. */
static void KERNEL_find_step(os_real_t target, os_real_t share, os_real_t added, KERNEL_work_t *work)
{
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                const os_real_t aim =
                    (target * work->inverse.at[b][i][j]) - (share * work->rest_image.at[b][i][j]);
                work->image.at[b][i][j] = (aim - work->multiplier.at[b][i][j]) - work->correction.at[b][i][j];
            }
        }
    }
    KERNEL_draw(&work->image, work);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->right[i] = work->drawn[i + 1] - (share * work->unmet[i]);
    }
    KERNEL_substitute(work->x_step, work);
    const os_real_t wanted = (target - (work->tau * work->kappa)) - added;
    os_real_t tau = ((share * work->lost) + KERNEL_inner(&work->present, &work->image)) + (wanted / work->tau);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        tau -= work->excess[i] * work->x_step[i];
    }
    tau = tau / work->steepness;
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->x_step[i] = work->x_step[i] - (tau * work->sensitivity[i]);
    }
    KERNEL_combine((os_real_t)0, work->x_step, work, &work->slack_step);
    KERNEL_add(tau, &work->present, &work->slack_step);
    KERNEL_add(share, &work->rest, &work->slack_step);
    KERNEL_transform(&work->slack_step, &work->multiplier, work, &work->image);
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                const os_real_t aim = (target * work->inverse.at[b][i][j]) - work->image.at[b][i][j];
                work->multiplier_step.at[b][i][j] =
                    (aim - work->multiplier.at[b][i][j]) - work->correction.at[b][i][j];
            }
        }
    }
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->x_step[i] = work->x_step[i] + ((tau / work->tau) * work->x[i]);
    }
    work->tau_step = tau;
    work->kappa_step = (wanted - (work->kappa * tau)) / work->tau;
}

/* Once more for what rounding left of the multiplier's equations: the inverse is large near the optimum. */
static void KERNEL_refine(os_real_t share, KERNEL_work_t *work)
{
    KERNEL_draw(&work->multiplier_step, work);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        const os_real_t left = work->drawn[i + 1] - (work->tau_step * work->cost[i]);
        work->right[i] = left - (share * work->unmet[i]);
    }
    KERNEL_substitute(work->further, work);
    for (int32_t i = 0; i < KERNEL_M; ++i) {
        work->x_step[i] = work->x_step[i] + work->further[i];
    }
    KERNEL_combine((os_real_t)0, work->further, work, &work->correction);
    KERNEL_add((os_real_t)1, &work->correction, &work->slack_step);
    KERNEL_transform(&work->correction, &work->multiplier, work, &work->image);
    KERNEL_add((os_real_t)-1, &work->image, &work->multiplier_step);
}

/* The longest of a few step lengths up to a limit that keeps every block positive definite; more are tried as long as
   none does, and then it is 0. */
static os_real_t KERNEL_reach_of(const KERNEL_blocks_t *m, const KERNEL_blocks_t *step, os_real_t limit,
    int32_t halvings)
{
    os_real_t reach = limit;
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        os_real_t inside = (os_real_t)0;
        os_real_t outside = reach;
        os_real_t length = reach;
        bool open = true;
        for (int32_t k = 1; (k <= KERNEL_HALVINGS) && open; ++k) {
            const bool stays = KERNEL_is_definite(b, m, step, length);
            inside = stays ? length : inside;
            outside = stays ? outside : length;
            length = (os_real_t)0.5 * (inside + outside);
            open = (inside < outside) && ((k < halvings) || (inside <= (os_real_t)0));
        }
        reach = inside;
    }
    return reach;
}

/* How much of the step slack, tau and kappa can go, and the multiplier where asked. */
static os_real_t KERNEL_reach(int32_t halvings, bool of_multiplier, const KERNEL_work_t *work)
{
    const os_real_t none = (os_real_t)0;
    const os_real_t end_of_tau = (work->tau_step < none) ? -(work->tau / work->tau_step) : (os_real_t)1;
    const os_real_t end_of_kappa = (work->kappa_step < none) ? -(work->kappa / work->kappa_step) : (os_real_t)1;
    os_real_t reach = os_fmin(os_fmin((os_real_t)1, end_of_tau), end_of_kappa);
    reach = KERNEL_reach_of(&work->slack, &work->slack_step, reach, halvings);
    if (of_multiplier) {
        reach = KERNEL_reach_of(&work->multiplier, &work->multiplier_step, reach, halvings);
    }
    return reach;
}

/* Go the step; false, and stay, where the length is zero: the step may then be no number. */
static bool KERNEL_move(os_real_t length, KERNEL_work_t *work)
{
    const bool going = length > (os_real_t)0;
    if (going) {
        for (int32_t i = 0; i < KERNEL_M; ++i) {
            work->x[i] += length * work->x_step[i];
        }
        KERNEL_add(length, &work->slack_step, &work->slack);
        KERNEL_add(length, &work->multiplier_step, &work->multiplier);
        work->tau += length * work->tau_step;
        work->kappa += length * work->kappa_step;
    }
    return going;
}

static void KERNEL_clear_correction(KERNEL_work_t *work)
{
    for (int32_t b = 0; b < KERNEL_BLOCKS; ++b) {
        for (int32_t i = 0; i < KERNEL_SIDE; ++i) {
            for (int32_t j = 0; j < KERNEL_SIDE; ++j) {
                work->correction.at[b][i][j] = (os_real_t)0;
            }
        }
    }
}

/* One predictor and corrector from the present point; false where it can go no further. */
static bool KERNEL_advance(KERNEL_work_t *work)
{
    bool going = KERNEL_invert(&work->slack, &work->inverse);
    going = going && KERNEL_factorise(work);
    if (going) {
        KERNEL_centre(work);
        KERNEL_clear_correction(work);
        KERNEL_find_step((os_real_t)0, (os_real_t)1, (os_real_t)0, work);
        const os_real_t left = (os_real_t)1 - KERNEL_reach(KERNEL_COARSE, true, work);
        const os_real_t centring = (left * left) * left;
        const os_real_t share = (os_real_t)1 - centring;
        KERNEL_transform(&work->slack_step, &work->multiplier_step, work, &work->correction);
        const os_real_t mean =
            (work->gap + (work->tau * work->kappa)) / ((os_real_t)KERNEL_ORDER + (os_real_t)1);
        KERNEL_find_step(centring * mean, share, work->tau_step * work->kappa_step, work);
        if (work->is_near) {
            KERNEL_refine(share, work);
        }
        const os_real_t reach = KERNEL_reach(KERNEL_FINE, true, work);
        const os_real_t length = ((os_real_t)0.9 + ((os_real_t)0.09 * reach)) * reach;
        going = KERNEL_move(length, work);
    }
    return going;
}
