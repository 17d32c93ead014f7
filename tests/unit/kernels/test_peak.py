"""Peak: the measurement counts what it does."""

import numpy as np
import pytest
from kernel_examples import needs_compiler

from optsat.kernels.peak import measured_peak
from optsat.kernels.unit import Real


@pytest.mark.parametrize("real", ["double", "float"])
def test_the_peak_is_a_rate_of_operations(real: Real) -> None:
    needs_compiler()
    peak = measured_peak(real, repetitions=1)
    assert np.isfinite(peak)
    # one lane of the slowest machine does more, and no machine does so many
    assert 1e7 < peak < 1e13
