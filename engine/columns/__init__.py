"""Output columns: declarations that both kernels use."""
