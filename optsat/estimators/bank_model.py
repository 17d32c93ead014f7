"""Bank model: what a hypothesis bank is made of, from its motion and sensors to the kernel of one step."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.attitude.backend import Value
from optsat.errors import InputError
from optsat.estimators.bank_samples import BankSamples
from optsat.kernels.hypothesis_bank import BankStructure, hypothesis_bank
from optsat.kernels.source import KernelSource
from optsat.models.parts import Part
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction

Fault = tuple[Part, ...]
"""Parts that fail together, as one bit of a mode's number."""


@dataclass(frozen=True, eq=False)
class BankModel:
    """The functions and ports of `optsat.kernels.hypothesis_bank.hypothesis_bank`, with what its bits and states mean.

    samples : what its devices send; faults : parts of each bit
    states : names of the error states with their units
    spread : deviation of each state that no actuator drives, at the start and after a long gap
    sample_time : that noises and chances per step belong to [s]
    example : reference, carried values and inputs that belong together, by port, from a generator
    """

    structure: BankStructure
    predict: GeneratedFunction
    observe: GeneratedFunction
    shift: GeneratedFunction
    reference: tuple[Port, ...]
    carried: tuple[Port, ...]
    inputs: tuple[Port, ...]
    samples: BankSamples
    faults: tuple[Fault, ...]
    states: tuple[str, ...]
    spread: tuple[float, ...]
    sample_time: float
    example: Callable[[np.random.Generator], Mapping[str, Array]]

    def kernel_source(self, name: str, floor: float = 1e-60) -> KernelSource:
        """Return the kernel of one step.

        Raises
        ------
        InputError : the floor of probabilities is above 1e-30.
        """
        return hypothesis_bank(
            name,
            self.structure,
            self.predict,
            self.observe,
            self.shift,
            self.reference,
            self.carried,
            self.inputs,
            floor,
            self._example,
        )

    def covariance_at_start(self, spread: Sequence[float] | Array | None = None) -> Array:
        """Return the packed covariances (states (states + 1) / 2, modes) by the spread and the faults' priors.

        spread : deviation of each state that no actuator drives; that of the model unless given
        """
        structure = self.structure
        failed = np.arange(structure.modes) >> np.arange(structure.bits)[:, None] & 1 == 1
        covariance = np.zeros((structure.packed, structure.modes))
        for e, deviation in enumerate(self.spread if spread is None else spread):
            covariance[e * (e + 1) // 2 + e] = deviation**2
        for a, (bit, variance) in enumerate(structure.actuated):
            e = len(self.spread) + a
            covariance[e * (e + 1) // 2 + e] = np.where(failed[bit], variance, 0.0)
        return covariance

    def state_at_start(
        self, known: Mapping[str, Array], fault_prior: ArrayLike, spread: ArrayLike | None = None
    ) -> dict[str, Array]:
        """Return the kernel's state of N runs by port: `known` values (N, ...), zero deviations, independent faults.

        fault_prior : probability of every fault, or (bits,) of each
        spread : deviation of each state that no actuator drives; that of the model unless given

        Raises
        ------
        InputError : a probability is not in (0, 1), a deviation negative, or their number is another one.
        """
        prior_of = finite_array("fault_prior", fault_prior)
        wide = None if spread is None else finite_array("spread", spread, (len(self.spread),))
        if prior_of.shape not in ((), (self.structure.bits,)):
            raise InputError(f"`fault_prior` must be one number or ({self.structure.bits},), got {prior_of.shape}.")
        if not ((prior_of > 0.0) & (prior_of < 1.0)).all():
            raise InputError(f"`fault_prior` must lie between 0 and 1, ends excluded, got {prior_of.tolist()}.")
        if wide is not None and wide.min() < 0.0:
            raise InputError(f"`spread` must not be negative, got {wide.min():.6g} at index {wide.argmin()}.")
        structure, runs = self.structure, len(next(iter(known.values())))
        failed = np.arange(structure.modes) >> np.arange(structure.bits)[:, None] & 1 == 1
        each = np.broadcast_to(prior_of, structure.bits)[:, None]
        prior = np.where(failed, each, 1.0 - each).prod(axis=0)
        shared = {
            "probability": prior,
            "mean": np.zeros((structure.states, structure.modes)),
            "covariance": self.covariance_at_start(wide),
            **{port.name: np.zeros(port.shape) for port in (*self.reference, *self.carried)},
        }
        return {
            name: known[name].copy() if name in known else np.broadcast_to(value, (runs, *value.shape)).copy()
            for name, value in shared.items()
        }

    def _example(self, rng: np.random.Generator) -> Array:
        modes, n = self.structure.modes, self.structure.states
        spread = np.array([*self.spread, *(variance**0.5 for _, variance in self.structure.actuated)])
        covariance = self.covariance_at_start() * rng.uniform(0.5, 1.0, modes)
        known = {
            "probability": rng.dirichlet(np.ones(modes)),
            "mean": 0.05 * spread[:, None] * rng.normal(size=(n, modes)),
            "covariance": covariance,
            **self.example(rng),
        }
        order = ["probability", "mean", "covariance"]
        order += [port.name for port in (*self.reference, *self.carried, *self.inputs)]
        return np.concatenate([np.ravel(known[name]) for name in order])


def checked_faults(faults: Sequence[Part | Sequence[Part]], known: Sequence[Part]) -> tuple[Fault, ...]:
    """Return the parts of each bit as tuples.

    Raises
    ------
    InputError : none, more than ten, a part that this bank has not, a part named twice, or sensors that share a bit.
    """
    found = tuple((each,) if isinstance(each, Part) else tuple(each) for each in faults)
    if not 1 <= len(found) <= 10:
        raise InputError(f"`faults` must name 1 to 10 faults, got {len(found)}: a bank of n faults has 2^n modes.")
    listed = [part for fault in found for part in fault]
    for part in listed:
        if part not in known:
            names = ", ".join(each.value for each in known)
            raise InputError(f"`faults`: {getattr(part, 'value', part)!r} is no part of this bank. Known: {names}.")
        if listed.count(part) > 1:
            raise InputError(f"`faults` names {part.value} twice.")
    for fault in found:
        if not fault or (len(fault) > 1 and not all(part.is_thruster for part in fault)):
            names = ", ".join(part.value for part in fault)
            raise InputError(f"`faults`: only thrusters can share a fault, got ({names}). Name sensors one by one.")
    return found


def check_chances(name: str, chances: Sequence[float]) -> None:
    """Accept the chances per step to fail and to recover, in [0, 1], with a sum above 0 and below 1.

    Raises
    ------
    InputError : others.
    """
    fail, recover = finite_array(name, chances, (2,), "-")
    if not (fail >= 0.0 and recover >= 0.0 and 0.0 < fail + recover < 1.0):
        raise InputError(
            f"`{name}` must be two chances per step, to fail and to recover, in [0, 1], with a sum above 0 and below "
            f"1, got ({fail:.6g}, {recover:.6g})."
        )


def pattern_of(matrix: Value) -> tuple[tuple[tuple[int, int], ...], Value]:
    """Return the places (row, column) of the structural non-zeros of a CasADi matrix, by rows, and their values."""
    import casadi as ca

    rows, columns = matrix.sparsity().get_triplet()
    places = tuple(sorted(zip(map(int, rows), map(int, columns), strict=True)))
    return places, ca.vertcat(*(matrix[i, j] for i, j in places))


def chain_over(fail: float, recover: float, steps: Value) -> tuple[Value, Value]:
    """Return the chances to fail and to recover over a number of steps, not always whole; see `check_chances`."""
    import casadi as ca

    total = fail + recover
    changed = (1.0 - ca.exp(float(ca.log(1.0 - total)) * steps)) / total
    return fail * changed, recover * changed
