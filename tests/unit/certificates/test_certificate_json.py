"""Certificate files: read back exactly, and a damaged one names its field."""

import json
from typing import Any

import numpy as np
import pytest

import optsat
from optsat.certificates.attitude_certificate import AttitudeCertificate
from optsat.errors import CertificateFormatError

R_N = np.array([(1.0, 0, 0), (0.6, 0.8, 0), (0, 0.28, 0.96), (0.48, 0.6, -0.64)])
EPS = np.array([0.05, 0.03, 0.1, 0.06])
# measured a little off, so that a refinement is worth its while
B_B = R_N + np.array([(0.01, -0.01, -0.03), (-0.03, 0.02, 0.02), (0.01, 0.01, 0), (0.03, 0.02, -0.03)])
CUTS = (np.eye(3)[:1], np.eye(3)[:1], (0.5,))


def certificate(**options: Any) -> AttitudeCertificate:
    return optsat.certify_attitude(B_B, R_N, EPS, **options).certificate


KINDS: dict[str, dict[str, Any]] = {
    "plain": {},
    "cuts": {"cuts": CUTS},
    "cells": {"refine": "cells"},
    "subpaving": {"refine": "subpaving"},
}


@pytest.mark.parametrize("kind", KINDS)
def test_round_trip_is_exact(kind: str) -> None:
    first = certificate(**KINDS[kind])
    assert (first.refinement is not None) == (kind in ("cells", "subpaving"))
    second = AttitudeCertificate.from_json(first.to_json())
    assert second.to_json() == first.to_json()
    assert second.verify()
    assert second.verify() == first.verify()
    assert second.claim == first.claim
    for name in ("b_B", "r_N", "angle_bound_rad", "cut_B", "cut_N", "cut_level"):
        np.testing.assert_array_equal(getattr(second.admissible, name), getattr(first.admissible, name))


def test_an_inconsistent_pair_survives() -> None:
    first = optsat.certify_attitude(B_B, R_N[[1, 0, 2, 3]], EPS).certificate
    assert first.pair is not None
    second = AttitudeCertificate.from_json(first.to_json())
    assert second.pair == first.pair
    assert second.verify()


def damaged(content: dict[str, Any], path: str, value: Any) -> str:
    """Return the JSON text with one field (dotted path) replaced, or removed when the value is `...`."""
    *folders, last = path.split(".")
    place = content
    for folder in folders:
        place = place[folder]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return json.dumps(content)


FIELDS = ["q_BN", "bound_rad", "weights", "b_B", "r_N", "angle_bound_rad", "cuts.u_B", "cuts.w_N", "cuts.level"]
CELL_FIELDS = [
    f"refinement.{name}"
    for name in ("pivot_BN", "pivot_weights", "scale", "centre", "tau", "low", "high", "multipliers")
]
SUBPAVING_FIELDS = [
    f"refinement.{name}"
    for name in ("pivot_BN", "pivot_weights", "scale", "levels", "second_scale", "centre_BN", "bound_rad")
]
ALL = (
    [("cuts", path) for path in FIELDS]
    + [("cells", path) for path in CELL_FIELDS]
    + [("subpaving", path) for path in SUBPAVING_FIELDS]
)


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    return {kind: certificate(**options).to_json() for kind, options in KINDS.items()}


@pytest.mark.parametrize(("kind", "path"), ALL)
@pytest.mark.parametrize("value", [..., "north", [[1.0, 2.0]], [[[1.0]]], {"a": 1}], ids=str)
def test_a_damaged_field_is_named(texts: dict[str, str], kind: str, path: str, value: Any) -> None:
    with pytest.raises(CertificateFormatError, match=f"`{path}`"):
        AttitudeCertificate.from_json(damaged(json.loads(texts[kind]), path, value))


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        ("format", "optsat-attitude-certificate/0", "format"),
        ("format", ..., "format"),
        ("status", "fine", "status"),
        ("status", ..., "status"),
        ("pair", [0, 7], "pair"),
        ("pair", [0, 1.0], "pair"),
        ("pair", [0, True], "pair"),
        ("pair", "0, 1", "pair"),
        ("cuts", ..., "cuts"),
        ("cuts", [], "cuts"),
        ("refinement", [], "refinement"),
        ("refinement.kind", "voids", "refinement"),
        ("refinement.second_BN", "north", "refinement.second_BN"),
        ("refinement.second_BN", [1, 0, 0], "refinement.second_BN"),
        ("refinement.levels", [5, 99], "refinement.levels"),
        ("refinement.levels", [5, 1.5], "refinement.levels"),
        ("b_B", [[1, 0, 0]], "b_B"),
        ("weights", [1.0], "weights"),
        ("q_BN", [0, 0, 0, None], "q_BN"),
    ],
)
def test_a_field_that_makes_no_sense_is_named(texts: dict[str, str], path: str, value: Any, named: str) -> None:
    with pytest.raises(CertificateFormatError, match=f"`{named}`"):
        AttitudeCertificate.from_json(damaged(json.loads(texts["subpaving"]), path, value))


@pytest.mark.parametrize("text", ["", "{", "null", "[]", "7", "{}"])
def test_what_is_no_certificate_at_all(text: str) -> None:
    with pytest.raises(CertificateFormatError, match="certificate"):
        AttitudeCertificate.from_json(text)


def test_numbers_that_json_does_not_know_are_refused(texts: dict[str, str]) -> None:
    text = damaged(json.loads(texts["plain"]), "bound_rad", float("nan"))
    with pytest.raises(CertificateFormatError, match="`bound_rad` must be finite"):
        AttitudeCertificate.from_json(text)
