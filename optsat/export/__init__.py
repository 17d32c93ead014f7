"""Export: kernels as freestanding C for flight computers."""
