"""Output columns: each is defined once, for both kernels."""
