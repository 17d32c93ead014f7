"""Attitude: representations, conversions and the algebra, for NumPy arrays and CasADi columns by the same code."""
