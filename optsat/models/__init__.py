"""Models: frozen parameters with methods that return generated functions; one file, one model."""
