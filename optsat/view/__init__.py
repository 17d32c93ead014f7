"""View: an attitude series as an interactive page."""
