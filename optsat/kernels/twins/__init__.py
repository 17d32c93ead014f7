"""Twins: each template once more in plain Python, the oracle of its tests and what runs without a compiler."""
