"""Certificates: proofs that `verify()` re-checks from the data alone; nothing here imports a solver."""
