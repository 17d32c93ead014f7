"""Commands: one file a command, thin: parse, call, print; whatever is slow to import is imported inside."""
