"""Symbolic layer: named, shaped, unit-carrying functions whose derivatives, batches and compositions are exact."""
