"""Certified attitude of two vectors in single precision: the bound holds the truth, rounded data included."""

import numpy as np
import pytest
from single_precision import SinglePrecision

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.export.catalogue import build
from optsat.symbolic.generated_function import GeneratedFunction


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


@pytest.mark.parametrize("spread", [0.0, 0.1, 0.01])
@pytest.mark.parametrize("decades", [(-9, -8), (-6, -4), (-4, -0.46)])
def test_the_truth_is_within_the_bound(decades: tuple[float, float], spread: float) -> None:
    kernel = build("certified_two_vector", "float")
    assert isinstance(kernel, GeneratedFunction)
    rng = np.random.default_rng(1)
    count = 4000
    truth = unit(rng.standard_normal((count, 4)))
    r = unit(rng.standard_normal((count, 2, 3)))
    if spread:
        r[:, 1] = unit(r[:, 0] + spread * r[:, 1])
    eps = 10.0 ** rng.uniform(*decades, size=(count, 2))
    y = np.einsum("nij,nkj->nki", dcm.from_quaternion(truth), r)
    # every error as long as its bound allows
    across = unit(np.cross(y, rng.standard_normal(y.shape)))
    b = np.cos(eps)[..., None] * y + np.sin(eps)[..., None] * across
    q, bound, weights, status = SinglePrecision(kernel).batch(b, r, eps)
    assert np.all(np.isfinite(np.column_stack((q, bound, weights, status))))
    assert np.all(status != 2)
    assert np.all(quaternion.error_angle(unit(q), truth) <= bound)
    if decades[0] > -9 and spread == 0.0:
        certain = status == 0
        assert np.mean(certain) > 0.95
        assert np.max((quaternion.error_angle(unit(q), truth) / bound)[certain]) > 0.9
