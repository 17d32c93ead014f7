"""Linear: equations and least squares of a size fixed when the kernel is built."""

from optsat.kernels.instantiate import instantiate
from optsat.kernels.sizes import GROUP, LANES, check_size, padded
from optsat.kernels.source import KernelSource
from optsat.kernels.twins import cholesky_solve as cholesky_twin
from optsat.kernels.twins import gmres as gmres_twin
from optsat.kernels.twins import ldl_solve as ldl_twin
from optsat.kernels.twins import recursive_least_squares as recursive_twin
from optsat.port import Port

LARGEST = 64
"""Unknowns above which the work memory no longer belongs on a stack."""


def cholesky_solve(n: int, name: str = "cholesky_solve") -> KernelSource:
    """Return the kernel (A, b) -> (x, pivot_ratio) of A x = b, A symmetric positive definite.

    A : (n, n), of which the upper triangle is read; b, x : (n,)
    pivot_ratio : least pivot over its diagonal entry; 0 where A is not positive definite to rounding, which is n times
        the spacing of numbers at 1

    Status: OS_E_RANGE where it is not, OS_E_NOT_FINITE for such an argument, OS_E_OUTPUT for overflow; x is then NaN.

    Raises
    ------
    InputError : n is not from 1 to 64.
    """
    check_size(name, "n", n, 1, LARGEST)
    return instantiate(
        "cholesky_solve",
        name,
        leaves={},
        sizes={"N": n, "PADDED": padded(n), "LANES": LANES, "GROUP": GROUP},
        inputs=(Port("A", (n, n), "-"), Port("b", (n,), "-")),
        outputs=(Port("x", (n,), "-"), Port("pivot_ratio", (), "-")),
        twin=cholesky_twin.twin(n),
        operations=n * (n + 1) * (n + 2) // 3 + 4 * n * n,
    )


def ldl_solve(n: int, name: str = "ldl_solve") -> KernelSource:
    """Return the kernel (A, b) -> (x, residual, negative_pivots) of A x = b, A symmetric, definite or not.

    A = U^T D U without interchanges, as quasi-definite matrices of interior points allow; the answer is refined once
    and checked.

    A : (n, n), of which the upper triangle is read; b, x : (n,)
    residual : largest entry of b - A x over (largest row sum of |A|) max |x| + max |b|
    negative_pivots : negative eigenvalues of A

    Status: OS_E_RANGE for a pivot within n roundings of the largest entry of its row, OS_E_NOT_CONVERGED where the
    residual exceeds 4 n roundings (x is kept), OS_E_NOT_FINITE for such an argument, OS_E_OUTPUT for overflow.

    Raises
    ------
    InputError : n is not from 1 to 64.
    """
    check_size(name, "n", n, 1, LARGEST)
    return instantiate(
        "ldl_solve",
        name,
        leaves={},
        sizes={"N": n, "PADDED": padded(n), "LANES": LANES},
        inputs=(Port("A", (n, n), "-"), Port("b", (n,), "-")),
        outputs=(Port("x", (n,), "-"), Port("residual", (), "-"), Port("negative_pivots", (), "-")),
        twin=ldl_twin.twin(n),
        operations=n * (n + 1) * (n + 2) // 3 + 15 * n * n,
    )


def recursive_least_squares(n: int, name: str = "recursive_least_squares") -> KernelSource:
    """Return the kernel that brings z = h . theta + noise into an estimate theta of n parameters.

    (theta, P, h, z, variance, forgetting) -> (theta, P, innovation, innovation_variance)

    P : (n, n) covariance, symmetric, and so it stays to the bit
    variance : of the noise, positive; forgetting : in (0, 1], the weight that all older measurements lose

    Status: OS_E_RANGE for a variance or forgetting outside its range, OS_E_STATE where P is or becomes indefinite,
    OS_E_NOT_FINITE for such an argument, OS_E_OUTPUT for overflow; all results are then NaN.

    Raises
    ------
    InputError : n is not from 1 to 64.

    Source: Ljung, System Identification, 11.2.
    """
    check_size(name, "n", n, 1, LARGEST)
    theta, P = Port("theta", (n,), "-"), Port("P", (n, n), "-")
    return instantiate(
        "recursive_least_squares",
        name,
        leaves={},
        sizes={"N": n, "PADDED": padded(n), "LANES": LANES},
        inputs=(
            *(theta, P, Port("h", (n,), "-"), Port("z", (), "-")),
            Port("variance", (), "-", lower=0.0),
            Port("forgetting", (), "-", lower=0.0, upper=1.0),
        ),
        outputs=(
            *(theta, P),
            *(Port("innovation", (), "-"), Port("innovation_variance", (), "-")),
        ),
        twin=recursive_twin.twin(n),
        operations=5 * n * n + 8 * n,
    )


def gmres(n: int, restart: int | None = None, cycles: int = 4, name: str = "gmres") -> KernelSource:
    """Return the kernel (A, b, tolerance) -> (x, residual, iterations) of A x = b by GMRES(restart).

    A : (n, n); b, x : (n,); restart : columns of one cycle, n unless given; cycles : at most so many
    residual : |b - A x| / |b|, computed from x and not by the recurrence
    Status: OS_OK only where residual <= tolerance, OS_E_NOT_CONVERGED with the best x found otherwise, OS_E_RANGE for
    a tolerance that is not positive, OS_E_NOT_FINITE for an argument that is not finite, OS_E_OUTPUT for overflow.

    Raises
    ------
    InputError : n or restart is not from 1 to 64, or restart exceeds n, or cycles is not from 1 to 1000.

    Source: Saad & Schultz, SIAM J. Sci. Stat. Comput. 7 (1986), with modified Gram-Schmidt and Givens rotations.
    """
    check_size(name, "n", n, 1, LARGEST)
    m = n if restart is None else check_size(name, "restart", restart, 1, n)
    check_size(name, "cycles", cycles, 1, 1000)
    return instantiate(
        "gmres",
        name,
        leaves={},
        sizes={"N": n, "PADDED": padded(n), "LANES": LANES, "GROUP": GROUP, "M": m, "CYCLES": cycles},
        inputs=(Port("A", (n, n), "-"), Port("b", (n,), "-"), Port("tolerance", (), "-", lower=0.0)),
        outputs=(Port("x", (n,), "-"), Port("residual", (), "-"), Port("iterations", (), "-")),
        twin=gmres_twin.twin(n, m, cycles),
        operations=m * (2 * n * n + 2 * n * (m + 1) + 3 * m) + 2 * n * n,
    )
