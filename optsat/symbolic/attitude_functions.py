"""Attitude functions: the attitude algebra as generated functions, for batches, Jacobians and flight code.

Quaternions are scaled to length one first, so that one which a sensor rounded gives a rotation all the same; one of
length zero, which flight code refuses, becomes the identity. Results keep the sign rule w >= 0.
"""

from optsat.attitude import dcm, euler321, mrp, quaternion, rotation_vector
from optsat.attitude.backend import Value, components, dot, reciprocal, scale, sqrt, stack
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

UNIT_NORM = 1e-3
"""How far from one the length of a quaternion may be: what single precision and telemetry leave of it."""

TINY = 1e-300
"""Least divisor in double precision."""

QUATERNION = Port("q_BN", (4,), "-", unit_norm=UNIT_NORM)
"""Attitude of B relative to N."""

_DCM = Port("dcm_BN", (3, 3), "-", unit_norm=UNIT_NORM, safe=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))
_MRP = Port("sigma_BN", (3,), "-")
_ROTATION = Port("phi_BN", (3,), "rad")
_ANGLES = Port("yaw_pitch_roll", (3,), "rad")


def unit_quaternion(q: Value, tiny: float = TINY) -> Value:
    """Return a quaternion (CasADi column) scaled to length one; zero becomes the identity."""
    import casadi as ca

    length = sqrt(dot(q, q))
    x, y, z, w = components(scale(reciprocal(ca.fmax(length, tiny)), q))
    return stack((x, y, z, w + (length <= tiny)))


def dcm_from_quaternion(tiny: float = TINY) -> GeneratedFunction:
    """Return `dcm_from_quaternion`: A(q_BN), which maps N components to B components.

    tiny : least divisor of the arithmetic it runs in
    """
    q = _symbol(QUATERNION)
    return generate("dcm_from_quaternion", [(QUATERNION, q)], [(_DCM, dcm.from_quaternion(unit_quaternion(q, tiny)))])


def quaternion_from_dcm() -> GeneratedFunction:
    """Return `quaternion_from_dcm`: by the largest column of 4 q q^T, so that half turns are no special case."""
    import casadi as ca

    A = ca.SX.sym("dcm_BN", 3, 3)
    return generate("quaternion_from_dcm", [(_DCM, A)], [(QUATERNION, dcm.to_quaternion(A))])


def mrp_from_quaternion(tiny: float = TINY) -> GeneratedFunction:
    """Return `mrp_from_quaternion`: the set with |sigma| <= 1.

    tiny : least divisor of the arithmetic it runs in
    """
    q = _symbol(QUATERNION)
    inside = Port("sigma_BN", (3,), "-", lower=-1.0 - UNIT_NORM, upper=1.0 + UNIT_NORM)
    return generate("mrp_from_quaternion", [(QUATERNION, q)], [(inside, mrp.from_quaternion(unit_quaternion(q, tiny)))])


def quaternion_from_mrp() -> GeneratedFunction:
    """Return `quaternion_from_mrp`: the same from a set and from its shadow."""
    sigma = _symbol(_MRP)
    return generate("quaternion_from_mrp", [(_MRP, sigma)], [(QUATERNION, mrp.to_quaternion(sigma))])


def mrp_switch() -> GeneratedFunction:
    """Return `mrp_switch`: the shadow set where |sigma| > 1, else the set itself."""
    sigma = _symbol(_MRP)
    return generate("mrp_switch", [(_MRP, sigma)], [(_MRP, mrp.canonical(sigma))])


def rotation_vector_from_quaternion(tiny: float = TINY) -> GeneratedFunction:
    """Return `rotation_vector_from_quaternion`: phi_BN [rad] of length at most pi.

    tiny : least divisor of the arithmetic it runs in
    """
    q = _symbol(QUATERNION)
    phi = rotation_vector.from_quaternion(unit_quaternion(q, tiny))
    return generate("rotation_vector_from_quaternion", [(QUATERNION, q)], [(_ROTATION, phi)])


def quaternion_from_rotation_vector() -> GeneratedFunction:
    """Return `quaternion_from_rotation_vector`: of any length, also beyond pi."""
    phi = _symbol(_ROTATION)
    return generate(
        "quaternion_from_rotation_vector", [(_ROTATION, phi)], [(QUATERNION, rotation_vector.to_quaternion(phi))]
    )


def euler321_from_quaternion(tiny: float = TINY) -> GeneratedFunction:
    """Return `euler321_from_quaternion`: (yaw, pitch, roll) [rad]; at gimbal lock roll is 0 and yaw carries all.

    tiny : least divisor of the arithmetic it runs in
    """
    q = _symbol(QUATERNION)
    angles = euler321.from_quaternion(unit_quaternion(q, tiny))
    return generate("euler321_from_quaternion", [(QUATERNION, q)], [(_ANGLES, angles)])


def quaternion_from_euler321() -> GeneratedFunction:
    """Return `quaternion_from_euler321`: of (yaw, pitch, roll) [rad]."""
    angles = _symbol(_ANGLES)
    return generate("quaternion_from_euler321", [(_ANGLES, angles)], [(QUATERNION, euler321.to_quaternion(angles))])


def quaternion_compose(tiny: float = TINY) -> GeneratedFunction:
    """Return `quaternion_compose`: q_CN = q_CB (x) q_BN, so that A(q_CN) = A(q_CB) A(q_BN).

    tiny : least divisor of the arithmetic it runs in
    """
    first, result = (Port(name, (4,), "-", unit_norm=UNIT_NORM) for name in ("q_CB", "q_CN"))
    p, q = _symbol(first), _symbol(QUATERNION)
    product = quaternion.compose(unit_quaternion(p, tiny), unit_quaternion(q, tiny))
    return generate("quaternion_compose", [(first, p), (QUATERNION, q)], [(result, quaternion.canonical(product))])


def quaternion_error_angle(tiny: float = TINY) -> GeneratedFunction:
    """Return `quaternion_error_angle`: the angle [rad] in [0, pi] between two attitudes, accurate where it is small.

    tiny : least divisor of the arithmetic it runs in
    """
    reference = Port("q_ref_BN", (4,), "-", unit_norm=UNIT_NORM)
    q, q_ref = _symbol(QUATERNION), _symbol(reference)
    angle = quaternion.error_angle(unit_quaternion(q, tiny), unit_quaternion(q_ref, tiny))
    return generate(
        "quaternion_error_angle", [(QUATERNION, q), (reference, q_ref)], [(Port("angle", (), "rad"), angle)]
    )


def _symbol(port: Port) -> Value:
    import casadi as ca

    return ca.SX.sym(port.name, port.size)
