"""PLACEHOLDER"""

if __name__ != "optsat.solvers":
    raise ImportError(f"import optsat.solvers, not {__name__}")
