"""C text that every kernel stands on."""
