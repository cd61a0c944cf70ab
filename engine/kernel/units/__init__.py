"""The C units of a compiled kernel."""
