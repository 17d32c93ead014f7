"""Studies: one file, one table, figure or comparison with its claims; run with `optsat study run NAME`."""

if __name__ != "optsat.studies":
    raise ImportError(f"import optsat.studies, not {__name__}")
