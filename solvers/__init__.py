"""Solvers: one file, one back end or method; the ordered table below is the whole registry."""

if __name__ != "optsat.solvers":
    raise ImportError(f"import optsat.solvers, not {__name__}")

SOLVERS = ()
