"""Output columns. Both kernels use the same definition of each column."""
