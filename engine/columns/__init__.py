"""Output columns. Both kernels use the same declarations of the columns."""
