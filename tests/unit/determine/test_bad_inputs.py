"""Inputs of the robust Wahba specification, section 11, and a newcomer's mistakes: who is named, where, what cures."""

import inspect
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import optsat
from optsat.errors import InfeasibleBoxError, InputError, UnknownOptionError
from optsat.records.record import Record, VectorChannel

AXES = np.eye(3)
PAIR = AXES[:2]
POSES = np.stack((PAIR, PAIR, PAIR))
BOX = optsat.ComponentBox.from_half_width(PAIR, 0.02)

Call = Callable[..., Any]
BOUND: dict[str, Any] = {"angle_bound_rad": 0.1}


def certify(b_B: Any, r_N: Any, **options: Any) -> Any:
    return optsat.certify_attitude(b_B, r_N, **(BOUND | options))


def certify_batch(b_B: Any, r_N: Any, **options: Any) -> Any:
    return optsat.certify_attitude_batch(b_B, r_N, **(BOUND | options))


def isolate(b_B: Any, r_N: Any, **options: Any) -> Any:
    return optsat.isolate(b_B, r_N, **(BOUND | options))


def refused(expected: str, call: Call, *args: Any, **options: Any) -> str:
    """Call, demand an InputError with the given pieces (split at |) in its message, and return the message."""
    with pytest.raises(InputError) as caught:
        call(*args, **options)
    message = str(caught.value)
    for piece in expected.split("|"):
        assert piece in message, f"{piece!r} is not in {message!r}"
    return message


def changed(array: Any, index: Any, value: float) -> Any:
    copy = np.array(array, dtype=float)
    copy[index] = value
    return copy


SINGLE = pytest.mark.parametrize("call", [optsat.wahba, certify, isolate], ids=["wahba", "certify_attitude", "isolate"])

DIRECTIONS = {
    "transposed": (np.ones((3, 4)), np.ones((3, 4)), "`b_B` and `r_N`|(m, 3)|(3, 4)|columns|.T"),
    "one transposed": (np.ones((3, 2)), PAIR, "`b_B`|(m, 3)|(3, 2)|.T"),
    "one vector": (AXES[0], AXES[0], "`b_B`|(m, 3)|(3,)"),
    "four components": (np.ones((2, 4)), PAIR, "`b_B`|(m, 3)|(2, 4)"),
    "different counts": (PAIR, AXES, "`b_B` and `r_N`|got 2 and 3"),
    "none": ([], [], "`b_B`|no vectors|(m, 3)"),
    "NaN": (changed(PAIR, (1, 2), np.nan), PAIR, "`b_B`|row 1|nan|Drop or repair"),
    "infinite": (PAIR, changed(PAIR, (0, 2), -np.inf), "`r_N`|row 0|-inf"),
    "zero vector": (PAIR, changed(PAIR, (0, 0), 0.0), "`r_N`|row 0|zero vector"),
    "complex": (PAIR * 1j, PAIR, "`b_B`|real|complex"),
    "ragged": ([[1, 0, 0], [0, 1]], PAIR, "`b_B`|rectangular"),
    "text": ([["north", 0, 0], [0, 1, 0]], PAIR, "`b_B`|numbers|'north'"),
    "text among objects": (np.array([["x", 0, 0], [0, 1, 0]], dtype=object), PAIR, "`b_B`|numbers|entry (0, 0)|'x'"),
    "a word": ("north", PAIR, "`b_B`|numbers|'north'"),
    "truth values": (PAIR.astype(bool), PAIR, "`b_B`|numbers|bool"),
    "masked": (np.ma.masked_equal(PAIR, 1), PAIR, "`b_B`|masked|(0, 0)"),
}


@SINGLE
@pytest.mark.parametrize("case", DIRECTIONS)
def test_directions_that_cannot_be_used(call: Call, case: str) -> None:
    b_B, r_N, expected = DIRECTIONS[case]
    refused(expected, call, b_B, r_N)


WEIGHTS = {
    "negative": ((1, -1), "`weights`|>= 0|index 1|-1|weight 0"),
    "all zero": ((0, 0), "`weights`|all zero"),
    "NaN": ((1, np.nan), "`weights`|finite|index 1"),
    "infinite": ((np.inf, 1), "`weights`|finite|index 0"),
    "too many": ((1, 1, 1), "`weights`|(2,)|(3,)"),
    "a column": ([[1], [1]], "`weights`|(2,)|(2, 1)"),
}


@pytest.mark.parametrize("call", [optsat.wahba, certify], ids=["wahba", "certify_attitude"])
@pytest.mark.parametrize("case", WEIGHTS)
def test_weights_that_cannot_be_used(call: Call, case: str) -> None:
    weights, expected = WEIGHTS[case]
    refused(expected, call, PAIR, PAIR, weights=weights)


BOUNDS = {
    "degrees": (5.0, "`angle_bound_rad`|pi|5|degrees|numpy.deg2rad"),
    "degrees in one row": ((0.1, 12.0), "`angle_bound_rad`|index 1|12|degrees|numpy.deg2rad"),
    "pi": (np.pi, "`angle_bound_rad`|below pi"),
    "negative": ((0.1, -0.1), "`angle_bound_rad`|>= 0|index 1|-0.1"),
    "NaN": ((np.nan, 0.1), "`angle_bound_rad`|finite|index 0"),
    "too few": ((0.1,), "`angle_bound_rad`|(2,)|(1,)"),
    "text": ("wide", "`angle_bound_rad`|numbers|'wide'"),
}


@pytest.mark.parametrize("call", [certify, isolate], ids=["certify_attitude", "isolate"])
@pytest.mark.parametrize("directions", [PAIR, BOX], ids=["vectors", "box"])
@pytest.mark.parametrize("case", BOUNDS)
def test_bounds_that_cannot_be_used(call: Call, directions: Any, case: str) -> None:
    bound, expected = BOUNDS[case]
    refused(expected, call, directions, PAIR, angle_bound_rad=bound)


BATCH: dict[str, tuple[Any, Any, dict[str, Any], str]] = {
    "two axes": (PAIR, PAIR, {}, "`b_B`|(n, m, 3)|(2, 3)"),
    "transposed": (POSES.swapaxes(1, 2), POSES.swapaxes(1, 2), {}, "`b_B`|(n, m, 3)|(3, 3, 2)|columns|swapaxes"),
    "different shapes": (POSES, POSES[:1], {}, "`b_B` and `r_N`|(n, m, 3)|(3, 2, 3)|(1, 2, 3)"),
    "no vectors": (POSES[:, :0], POSES[:, :0], {}, "`b_B`|no vectors"),
    "NaN": (changed(POSES, (1, 0, 0), np.nan), POSES, {}, "`b_B`|row 1|nan"),
    "zero vector": (POSES, changed(POSES, (2, 1, 1), 0), {}, "`r_N`|(2, 1)|zero vector"),
    "degrees": (POSES, POSES, {"angle_bound_rad": 7.0}, "`angle_bound_rad`|the value is 7|degrees|deg2rad"),
    "degrees in one": (POSES, POSES, {"angle_bound_rad": (0.1, 7)}, "`angle_bound_rad`|index 1|7|degrees"),
    "negative": (POSES, POSES, {"angle_bound_rad": -np.ones((3, 2))}, "`angle_bound_rad`|(0, 0)|-1"),
    "bounds of another shape": (POSES, POSES, {"angle_bound_rad": (1, 1, 1)}, "`angle_bound_rad`|(2,)|(3,)"),
    "norm": (POSES * 2, POSES, {"norm_policy": "error"}, "`b_B`|(0, 0)|norm 2"),
}


@pytest.mark.parametrize("case", BATCH)
def test_batches_that_cannot_be_used(case: str) -> None:
    b_B, r_N, options, expected = BATCH[case]
    refused(expected, certify_batch, b_B, r_N, **options)


def test_lengths_are_scaled_with_one_warning() -> None:
    for call in (optsat.wahba, certify):
        with pytest.warns(UserWarning, match=re.escape("`b_B` row 1 has norm 2; vectors are scaled to length 1")):
            call(changed(PAIR, (1, 1), 2.0), PAIR)
    certify(PAIR * 3.0, PAIR, norm_policy="silent")
    certify(PAIR * 1.04, PAIR)
    refused("`b_B`|unit vectors|row 0|norm 1.01|norm_policy", certify, PAIR * 1.01, PAIR, norm_policy="error")
    certify(PAIR * 1.0001, PAIR, norm_policy="error")
    refused("`norm_policy`|'warn', 'error' or 'silent'|'loud'", optsat.wahba, PAIR, PAIR, norm_policy="loud")


def test_choices_offer_the_nearest() -> None:
    refused("`method`|'davenprt'|Did you mean `davenport`?", optsat.wahba, PAIR, PAIR, method="davenprt")
    refused("`refine`|'cell'|Did you mean `cells`?", certify, PAIR, PAIR, refine="cell")
    refused("`refine`|'zzz'|Known: cells, subpaving.", certify, PAIR, PAIR, refine="zzz")


@pytest.mark.parametrize(
    ("call", "args", "typo", "meant"),
    [
        (optsat.wahba, (PAIR, PAIR), "wieghts", "weights"),
        (optsat.certify_attitude, (PAIR, PAIR, 0.1), "refin", "refine"),
        (optsat.certify_attitude_batch, (POSES, POSES, 0.1), "norm_polcy", "norm_policy"),
        (optsat.isolate, (PAIR, PAIR, 0.1), "mots", "most"),
        (optsat.statistical_angle_bound, ((0.1,),), "probabilty", "probability"),
    ],
)
def test_misspelt_options_offer_the_nearest(call: Call, args: tuple[Any, ...], typo: str, meant: str) -> None:
    with pytest.raises(UnknownOptionError, match=f"no option `{typo}`. Did you mean `{meant}`?"):
        call(*args, **{typo: 1})


# what optsat returns and raises, and nobody calls
NOT_CALLED = {"AttitudeSeries", "AttitudeStatus", "CertifiedAttitude", "CertifiedBatch", "Export"} | {
    *("Attainment", "Isolability", "Isolation", "Kernel", "ParetoFront", "ParetoPoint", "Proof", "WorstCase"),
    # their options are those of the definition, and refused with it
    *("kernel", "open_kernel"),
    *("Solution", "Termination", "WahbaAttitude"),
    *(name for name in optsat.__all__ if name.endswith("Error") or name.startswith("__")),
}


@pytest.mark.parametrize("name", sorted(set(optsat.__all__) - NOT_CALLED))
def test_every_public_call_offers_the_nearest_option(name: str) -> None:
    call = getattr(optsat, name)
    meant = list(inspect.signature(call).parameters)[-1]
    typo = f"{meant}s"
    with pytest.raises(UnknownOptionError, match=f"{name} has no option `{typo}`. Did you mean `{meant}`?"):
        call(**{typo: 1})


def test_cuts_that_cannot_be_used() -> None:
    refused("`angle_bound_rad` is missing|component boxes", certify, PAIR, PAIR, angle_bound_rad=None)
    refused("`cuts`|tuple|u . A(q) w >= c", certify, PAIR, PAIR, cuts=(PAIR, PAIR))
    refused("`cuts[0]`|(m, 3)", certify, PAIR, PAIR, cuts=(AXES[0], AXES[0], 0.5))
    refused("`cuts[1]`|(2, 3)|(3, 3)", certify, PAIR, PAIR, cuts=(PAIR, AXES, (0, 0)))
    refused("`cuts[2]`|finite|index 1", certify, PAIR, PAIR, cuts=(PAIR, PAIR, (0, np.nan)))


def test_boxes_that_cannot_be_used() -> None:
    box = optsat.ComponentBox
    refused("`low` and `high`|(2, 3)|(3, 3)", box, PAIR, AXES)
    refused("`low` must not exceed `high`|row 1", box, PAIR, PAIR - [[0], [1]])
    refused("`low`|finite|row 1", box, changed(PAIR, (1, 1), np.nan), PAIR)
    refused("`low`|(m, 3)|(3,)", box, AXES[0], AXES[0])
    refused("`half_width`|>= 0|-0.1", box.from_half_width, PAIR, -0.1)
    for fraction in (1.0, -0.1, np.nan, "a fifth", True):
        refused("`fraction`|[0, 1)", box.from_relative, PAIR, fraction)
    refused("`mode`|'safe' or 'paper'|'papr'", box.from_relative, PAIR, 0.1, mode="papr")
    refused("`u`|(3,)|(2,)", BOX.support, 0, (1, 2))
    with pytest.raises(InfeasibleBoxError, match=r"Box 1 lies inside the unit sphere.*Widen the box"):
        box([(1, 0, 0), (0.1, 0.1, 0.1)], [(1, 0, 0), (0.2, 0.2, 0.2)])
    with pytest.raises(InfeasibleBoxError, match="Box 0 lies outside the unit sphere"):
        box([(1, 1, 1)], [(2, 2, 2)])


def test_boxes_beside_directions_that_cannot_be_used() -> None:
    refused("`b_B` and `r_N`|got 2 and 3", certify, BOX, AXES)
    refused("`r_N`|row 1|zero vector", certify, BOX, changed(PAIR, (1, 1), 0.0))
    refused("`b_B`|row 0|zero vector", certify, changed(PAIR, (0, 0), 0.0), BOX)
    refused("`r_N`|(m, 3)|.T", certify, BOX, PAIR.T)
    refused("Box 0 is centred at zero|Drop it", certify, optsat.ComponentBox([(-1, -1, -1)], [(1, 1, 1)]), AXES[:1])
    with pytest.raises(InputError, match="`b_B` must hold numbers"):
        optsat.wahba(BOX, PAIR)  # type: ignore[arg-type] # a newcomer's mistake


def test_isolation_limits() -> None:
    many = np.tile(AXES, (5, 1))
    refused("`b_B`|15 pairs|12", isolate, many, many)
    for most in (-1, 1.5, True, "two"):
        refused("`most`|integer >= 0", isolate, AXES, AXES, most=most)


def test_statistical_bounds_that_cannot_be_used() -> None:
    bound = optsat.statistical_angle_bound
    for probability in (0.0, 1.0, -0.5, np.nan, "most"):
        refused("`probability`|(0, 1)", bound, (0.1,), probability)
    refused("`sigma_rad`|no deviations", bound, (), 0.9)
    refused("`sigma_rad`|>= 0|index 1|-0.1", bound, (0.1, -0.1), 0.9)
    refused("`sigma_rad`|(m,)", bound, 0.1, 0.9)
    refused("`sigma_rad`|finite|index 0", bound, (np.nan,), 0.9)
    refused("`sigma_rad` index 1 is 5 rad|degrees|numpy.deg2rad", bound, (0.1, 5.0), 0.99)


@pytest.mark.parametrize("value", [0, -1.0, np.nan, np.inf, "a minute", True])
def test_windows_that_cannot_be_used(value: Any) -> None:
    refused("`length_s`|positive time [s]", optsat.Window, value, 1.0)
    refused("`spacing_s`|positive time [s]", optsat.Window, 1.0, value)


def test_windows_with_too_many_epochs() -> None:
    refused("`spacing_s` = 0.1 s|10000 epochs|at most 1000|wider spacing", optsat.Window, 1000.0, 0.1)


def test_a_window_needs_a_gyro_and_its_bound() -> None:
    channel = VectorChannel("sun", "B", PAIR, PAIR, np.array([0.1, 0.1]), np.array([True, True]))
    record = Record(np.array([0.0, 1.0]), (channel,))
    refused("gyro rate|leave out `window`", optsat.certify_record, record, optsat.Window(10.0, 1.0))
    unbounded = Record(np.array([0.0, 1.0]), (channel,), omega_BN_B=np.zeros((2, 3)))
    refused("bound of the gyro error", optsat.certify_record, unbounded, optsat.Window(10.0, 1.0))


def test_covariances_that_do_not_exist() -> None:
    answer = optsat.wahba(PAIR, PAIR).answer
    refused("`sigma_rad`|(2,)|(1,)", answer.covariance_B, (0.1,))
    refused("`sigma_rad`|[0, pi)|index 0|-0.1", answer.covariance_B, -0.1)
    refused("`sigma_rad`|5|degrees|deg2rad", answer.covariance_B, 5.0)
    refused("`sigma_rad`|finite", answer.covariance_B, np.nan)
    refused("collinear|rotation about [1. 0. 0.]", optsat.wahba(PAIR[:1], PAIR[:1]).answer.covariance_B, 0.1)
    refused("does not exist|rotation about [1. 0. 0.]", certify(PAIR[:1], PAIR[:1]).covariance_B)
    contradicting = certify(PAIR, [(1, 0, 0), (0.6, 0.8, 0)], angle_bound_rad=0.01)
    refused("does not exist|contradict each other", contradicting.covariance_B)
