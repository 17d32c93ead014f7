"""The catalogue of kernels: every entry is built, named, documented, and refuses what it does not know."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from optsat.errors import InputError, UnknownOptionError
from optsat.export.catalogue import CATALOGUE, build, describe
from optsat.kernels.lowering import lower
from optsat.kernels.program import Constant
from optsat.kernels.source import KernelSource

# of one sample, after folding, a libm call counted as one: an upper bound, so that growth is noticed
OPERATIONS = {
    "dcm_from_quaternion": 47,
    "quaternion_from_dcm": 101,
    "mrp_from_quaternion": 47,
    "quaternion_from_mrp": 40,
    "mrp_switch": 16,
    "rotation_vector_from_quaternion": 80,
    "quaternion_from_rotation_vector": 66,
    "euler321_from_quaternion": 78,
    "quaternion_from_euler321": 49,
    "quaternion_compose": 86,
    "quaternion_error_angle": 71,
    "rigid_body_step": 215,
    "magnetic_field": 35,
    "sun": 44,
    "certified_two_vector": 1350,
    "extended_filter_7": 4462,
    "unscented_filter_7": 5516,
    **{f"wahba_{n}": 403 + 21 * n for n in range(2, 11)},
}


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_kernel_carries_its_public_name(name: str) -> None:
    assert build(name).name == name


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_parameter_is_explained(name: str) -> None:
    entry = CATALOGUE[name]
    assert entry.says
    assert not entry.says.endswith(".")
    for parameter in entry.parameters():
        assert parameter.says, f"{entry.definition} says nothing of `{parameter.name}`"


@pytest.mark.parametrize("name", OPERATIONS)
def test_size(name: str) -> None:
    assert describe(name).operations <= OPERATIONS[name]


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_constant_of_a_float_kernel_is_a_float(name: str) -> None:
    kernel = build(name, "float")
    if isinstance(kernel, KernelSource):
        pytest.skip("a template: its constants are in its C text")
    nodes = lower(kernel.casadi).nodes
    sizes = [abs(node.value) for node in nodes if isinstance(node, Constant) and node.value != 0]
    assert all(np.finfo(np.float32).tiny <= size <= np.finfo(np.float32).max for size in sizes)


def test_a_description_holds_ports_and_operations() -> None:
    text = str(describe("rigid_body_step"))
    assert text.startswith("rigid_body_step: attitude and angular velocity")
    assert "omega_BN_B (3,) [rad/s]" in text
    assert "operations" in text


def test_parameters_reach_the_definition() -> None:
    one, two = (describe("rigid_body_step", substeps=substeps).operations for substeps in (1, 2))
    assert one < two < 2 * one


def test_unknown_names_offer_the_nearest() -> None:
    with pytest.raises(InputError, match="Did you mean `rigid_body_step`"):
        build("rigid_bodystep")
    with pytest.raises(UnknownOptionError, match=r"no parameter `inertia`\. Did you mean `inertia_B`"):
        build("rigid_body_step", inertia=1)
    with pytest.raises(InputError, match="'double' or 'float', got 'single'"):
        build("sun", "single")  # type: ignore[arg-type]


def test_listing_builds_nothing(root: Path) -> None:
    program = (
        "import sys\nfrom optsat.export.catalogue import CATALOGUE\n"
        "for entry in CATALOGUE.values(): entry.parameters()\nassert 'casadi' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], cwd=root, check=True)
