"""Problems: one file, one problem: frozen data that lowers itself to a form and reads the answer back."""

if __name__ != "optsat.problems":
    raise ImportError(f"import optsat.problems, not {__name__}")
