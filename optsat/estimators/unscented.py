"""Unscented Kalman filter: one pure step of any model, by Cholesky-based sigma points drawn anew before the update."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from optsat.attitude.backend import Value
from optsat.errors import InputError
from optsat.estimators.filter_model import FilterModel, Noise, symmetric
from optsat.estimators.gaussian_update import arguments, cholesky, log_likelihood, step_function
from optsat.symbolic.generated_function import GeneratedFunction


@dataclass(frozen=True)
class SigmaPoints:
    """Scaled sigma points of n states: x and x +- sqrt(n + lambda) L_k, lambda = alpha^2 (n + kappa) - n.

    alpha : spread of the points; one keeps all weights positive and loses no digits, small ones stay near x
    beta : knowledge of the distribution, 2 for a Gaussian
    kappa : second spread, 3 - n matches the fourth moment of one state

    Raises
    ------
    InputError : the points would coincide, or fall on no real numbers.
    Source: van der Merwe, Sigma-Point Kalman Filters for Probabilistic Inference (2004), 3.2.
    """

    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0

    def spread(self, n: int) -> float:
        """Return n + lambda, the square of the points' distance in deviations."""
        spread = self.alpha**2 * (n + self.kappa)
        if not (math.isfinite(spread) and spread > 0 and math.isfinite(self.beta)):
            raise InputError(
                f"`alpha` {self.alpha} and `kappa` {self.kappa} give no sigma points of {n} states: "
                f"alpha^2 (n + kappa) must be positive, and `beta` {self.beta} finite."
            )
        return spread

    def centre_weight(self, n: int) -> float:
        """Return the weight of the centre in covariances."""
        spread = self.spread(n)
        return (spread - n) / spread + 1 - self.alpha**2 + self.beta


def unscented_step(
    model: FilterModel,
    name: str = "unscented_filter",
    points: SigmaPoints | None = None,
    noise: Noise = "full",
    rounding: float = 2.0**-52,
) -> GeneratedFunction:
    """Return one step, prediction and update: (x, P, u..., z, Q, R) -> (x, P, innovation, S, log_likelihood, definite).

    The points of P go through f; points of the predicted covariance, Q included, through h, so that a linear model
    gives the Kalman filter exactly. Where h is linear in the state, its moments are known without points, and taken.
    P = P_ - K S K^T, symmetric to the bit. S is the covariance of the innovation, log_likelihood that of the
    innovation; definite is 1 where P, its prediction and S were positive definite. Where h is linear, the noise
    diagonal and no weight negative, the prediction cannot be indefinite, and the variances of Q are tested instead.

    points : spread and weights of the sigma points
    noise : "full", Q and R are matrices of which the lower triangle is read; "diagonal", columns of variances
    rounding : spacing at 1 of the numbers it runs in

    Raises
    ------
    InputError : an option is none of those, or there are no such points.
    """
    import casadi as ca

    points = SigmaPoints() if points is None else points
    n = model.state_size
    spread, centre_weight = points.spread(n), points.centre_weight(n)
    given = arguments(model, noise)
    before = cholesky(given.P, rounding)
    moved = _Images.of(model.f(given.u), given.x, before.L, spread)
    predicted = model.scaled(moved.mean())
    P = symmetric(moved.covariance(centre_weight) + given.Q)

    # variances and weights that are not negative make no covariance indefinite
    surely_semidefinite = noise == "diagonal" and centre_weight >= 0
    sound = ca.mmin(ca.diag(given.Q)) >= 0 if surely_semidefinite else None
    expected, covariance, cross, sound = _measured(model.h(given.u), predicted, P, points, rounding, sound)
    innovation = model.on_the_side_of(expected, given.z) - expected
    S = symmetric(covariance + given.R)
    factor = cholesky(S, rounding)
    gain_root = factor.solve(cross.T).T
    whitened = factor.solve(innovation)
    definite = ca.logic_and(before.definite, ca.logic_and(sound, factor.definite))
    return step_function(
        name,
        given,
        x=model.scaled(predicted + gain_root @ whitened),
        P=symmetric(P - gain_root @ gain_root.T),
        innovation=innovation,
        S=S,
        likelihood=log_likelihood(factor, whitened),
        definite=definite,
    )


def _measured(
    h: Callable[[Value], Value], x: Value, P: Value, points: SigmaPoints, rounding: float, sound: Value | None
) -> tuple[Value, Value, Value, Value]:
    """Return mean and covariance of h, the lower triangle counting, that of the state with it, and if P is sound.

    sound : whether P is, where that is known without a factor of it
    """
    import casadi as ca

    state = ca.SX.sym("state", x.numel())
    image = h(state)
    if ca.is_linear(image, state):
        H = ca.jacobian(image, state)
        cross = P @ H.T
        return h(x), H @ cross, cross, cholesky(P, rounding).definite if sound is None else sound
    factor, n = cholesky(P, rounding), x.numel()
    spread = points.spread(n)
    seen = _Images.of(h, x, factor.L, spread)
    # the deviations of the points are the columns of L, so their product with those of the images is triangular
    cross = factor.L @ seen.differences().T * (0.5 / math.sqrt(spread))
    return seen.mean(), seen.covariance(points.centre_weight(n)), cross, factor.definite


@dataclass(frozen=True)
class _Images:
    """What a function makes of sigma points: the image of the centre, and those of the others relative to it.

    plus, minus : images of x + sqrt(spread) L_k and x - sqrt(spread) L_k, less that of x
    """

    centre: Value
    plus: Sequence[Value]
    minus: Sequence[Value]
    spread: float

    @staticmethod
    def of(function: Callable[[Value], Value], x: Value, L: Value, spread: float) -> "_Images":
        centre = function(x)
        steps = [math.sqrt(spread) * L[:, k] for k in range(L.shape[1])]
        plus = [function(x + step) - centre for step in steps]
        return _Images(centre, plus, [function(x - step) - centre for step in steps], spread)

    def _shift(self) -> Value:
        """Return the mean less the image of the centre; the weights sum to one, so the centre's drops out."""
        total = sum((*self.plus, *self.minus), start=0 * self.centre)
        return total * (0.5 / self.spread)

    def mean(self) -> Value:
        return self.centre + self._shift()

    def covariance(self, centre_weight: float) -> Value:
        """Return the weighted outer products about the mean; the lower triangle counts."""
        import casadi as ca

        shift = self._shift()
        deviations = ca.horzcat(*(image - shift for image in (*self.plus, *self.minus)))
        return deviations @ deviations.T * (0.5 / self.spread) + centre_weight * (shift @ shift.T)

    def differences(self) -> Value:
        """Return the images of opposite points less each other as columns."""
        import casadi as ca

        return ca.horzcat(*(ahead - behind for ahead, behind in zip(self.plus, self.minus, strict=True)))
