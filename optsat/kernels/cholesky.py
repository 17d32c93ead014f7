"""Cholesky: linear equations of a symmetric positive definite matrix, of a size fixed when the kernel is built."""

from optsat.kernels.instantiate import instantiate
from optsat.kernels.sizes import LANES, check_size, padded
from optsat.kernels.source import KernelSource
from optsat.kernels.twins import cholesky_solve as twin_of_solve
from optsat.port import Port

LARGEST = 64
"""Unknowns above which the work memory no longer belongs on a stack."""


def cholesky_solve(n: int, name: str = "cholesky_solve") -> KernelSource:
    """Return the kernel (A, b) -> (x, pivot_ratio) of A x = b, A symmetric positive definite.

    A : (n, n), of which the upper triangle is read; b, x : (n,)
    pivot_ratio : least pivot over its diagonal entry, what remains of it in the worst case; 0 where A is not positive
        definite to rounding, n times the spacing of numbers at 1

    Status: OS_E_RANGE where it is not, OS_E_NOT_FINITE for an argument that is not, OS_E_OUTPUT for overflow; x is then
    NaN.

    Raises
    ------
    InputError : n is not from 1 to 64.
    """
    check_size(name, "n", n, 1, LARGEST)
    return instantiate(
        "cholesky_solve",
        name,
        leaves={},
        sizes={"N": n, "PADDED": padded(n), "LANES": LANES},
        inputs=(Port("A", (n, n), "-"), Port("b", (n,), "-")),
        outputs=(Port("x", (n,), "-"), Port("pivot_ratio", (), "-")),
        twin=twin_of_solve.twin(n),
        operations=n * (n + 1) * (n + 2) // 3 + 4 * n * n,
    )
