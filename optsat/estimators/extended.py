"""Extended Kalman filter: one pure step of any model, its Jacobians exact."""

from typing import Literal

from optsat.errors import InputError
from optsat.estimators.filter_model import FilterModel, Noise, symmetric
from optsat.estimators.gaussian_update import arguments, cholesky, log_likelihood, step_function
from optsat.symbolic.generated_function import GeneratedFunction


def extended_step(
    model: FilterModel,
    name: str = "extended_filter",
    form: Literal["joseph", "symmetric"] = "joseph",
    noise: Noise = "full",
    rounding: float = 2.0**-52,
) -> GeneratedFunction:
    """Return one step, prediction and update: (x, P, u..., z, Q, R) -> (x, P, innovation, S, log_likelihood, definite).

    x_ = f(x, u), P_ = F P F^T + Q; y = z - h(x_, u), S = H P_ H^T + R, K = P_ H^T S^-1; x = x_ + K y.
    S is the covariance of the innovation y, log_likelihood that of y; definite is 1 where S was positive definite.

    form : "joseph", P = (I - K H) P_ (I - K H)^T + K R K^T, positive whatever rounding does to K; or "symmetric",
        P = P_ - K S K^T, at half the operations
    noise : "full", Q and R are matrices of which the lower triangle is read; "diagonal", columns of variances
    rounding : spacing at 1 of the numbers it runs in

    Raises
    ------
    InputError : an option is none of those.
    Source: Simon, Optimal State Estimation, 13.2; Joseph form 5.1.
    """
    import casadi as ca

    if form not in ("joseph", "symmetric"):
        raise InputError(f"`form` must be 'joseph' or 'symmetric', got {form!r}.")
    given = arguments(model, noise)
    f, h = model.f(given.u), model.h(given.u)
    moved = f(given.x)
    F = ca.jacobian(moved, given.x)
    predicted = model.scaled(moved)
    P = symmetric(F @ given.P @ F.T + given.Q)

    at = ca.SX.sym("x_predicted", model.state_size)
    seen = h(at)
    expected, H = ca.substitute([seen, ca.jacobian(seen, at)], [at], [predicted])
    innovation = model.on_the_side_of(expected, given.z) - expected
    HP = H @ P
    S = symmetric(HP @ H.T + given.R)
    factor = cholesky(S, rounding)
    whitened, gain_root = factor.solve(innovation), factor.solve(HP).T
    x = model.scaled(predicted + gain_root @ whitened)
    if form == "symmetric":
        updated = symmetric(P - gain_root @ gain_root.T)
    else:
        gain = gain_root @ factor.solve(ca.SX.eye(model.measurement_size))
        kept = ca.SX.eye(model.state_size) - gain @ H
        updated = symmetric(kept @ P @ kept.T + gain @ given.R @ gain.T)
    likelihood = log_likelihood(factor, whitened)
    return step_function(name, given, x, updated, innovation, S, likelihood, factor.definite)
