"""Programs of a kernel's functions."""
