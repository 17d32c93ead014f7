"""Templates: loops written by hand in C, with the printed leaves in their slots."""
