"""Report: the folder of a complete run as a page that people read."""
