"""Windowed outputs: all samples of a window as one vector, linear in first state, fault signals and noise."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.models.linear_discrete import LinearDiscreteModel

# singular values below this part of the largest are rounding: the columns are scaled to length 1 before
TRUNCATION = 1e-9
# between these, rounding and a weak but real direction look alike
UNCLEAR = (1e-12, 1e-8)


@dataclass(frozen=True, eq=False)
class WindowedOutputs:
    """y = O x(0) + T f + e over `samples` samples, e of covariance Sigma, everything multiplied by Sigma^-1/2.

    Sigma holds the sensors' noise and what the noise of the steps has become at the sensors. Rows run sample by sample.
    """

    model: LinearDiscreteModel
    samples: int
    whitening: Array
    first_state: Array

    def toeplitz(self, names: tuple[str, ...]) -> Array:
        """Return the whitened (samples p, samples m) map of fault signals on the named inputs or sensors.

        Columns run sample by sample; a signal on an input is held until the next sample.
        """
        ways = [self.model.channel(name) for name in names]
        steps, outputs = np.array([way[0] for way in ways]).T, np.array([way[1] for way in ways]).T
        return self._whitened(_toeplitz(self.model, steps, outputs, self.samples))

    def unexplained(self, change: Array, *causes: Array) -> tuple[Array, bool]:
        """Return the part of a whitened change of outputs that no first state and no signal of the causes makes.

        Also whether the rank is clear: no singular value between rounding and what is certainly real.
        """
        columns = np.hstack([self.first_state, *causes])
        length = np.linalg.norm(columns, axis=0)
        columns = columns / np.where(length > 0.0, length, 1.0)
        basis, singular, _ = np.linalg.svd(columns, full_matrices=False)
        part = singular / singular[0] if singular[0] > 0.0 else singular
        basis = basis[:, part > TRUNCATION]
        low, high = UNCLEAR
        rest = change - basis @ (basis.T @ change)
        # a second pass takes out what rounding has left of a long projection
        return np.asarray(rest - basis @ (basis.T @ rest)), not bool(np.any((part > low) & (part < high)))

    def _whitened(self, rows: Array) -> Array:
        from scipy.linalg import solve_triangular

        return np.asarray(solve_triangular(self.whitening, rows, lower=True))


def windowed_outputs(model: LinearDiscreteModel, samples: int) -> WindowedOutputs:
    """Return the outputs of a window of a linear model, see `WindowedOutputs`."""
    from scipy.linalg import solve_triangular

    A, C, Q = np.asarray(model.A), model.C, np.asarray(model.Q)
    n, p = len(A), len(C)
    observability = np.vstack(_powers(C, A, samples))
    noise = _toeplitz(model, np.eye(n), np.zeros((p, n)), samples)
    covariance = noise @ np.kron(np.eye(samples), Q) @ noise.T + np.diag(np.tile(model.sigma**2, samples))
    factor = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    return WindowedOutputs(model, samples, factor, np.asarray(solve_triangular(factor, observability, lower=True)))


def _powers(C: Array, A: Array, count: int) -> list[Array]:
    """C, C A, C A^2, ..."""
    rows = [C]
    while len(rows) < count:
        rows.append(rows[-1] @ A)
    return rows


def _toeplitz(model: LinearDiscreteModel, steps: Array, outputs: Array, samples: int) -> Array:
    """Lower block-triangular map of signals that enter the step by `steps` (n, m), the outputs by `outputs` (p, m)."""
    p, m = outputs.shape
    responses = [outputs, *(row @ steps for row in _powers(model.C, np.asarray(model.A), samples - 1))][:samples]
    full = np.zeros((samples, p, samples, m))
    for late, response in enumerate(responses):
        for start in range(samples - late):
            full[start + late, :, start, :] = response
    return full.reshape(samples * p, samples * m)
