"""Kernels: symbolic functions as straight-line programs, printed as C and as NumPy with the same bits."""
