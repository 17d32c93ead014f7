"""Plots: figures as objects, rendered to bytes; no window is opened and no global state is touched."""
