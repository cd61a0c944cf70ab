"""What a mechanism at rest can hold: all statically admissible states, not only one (METHOD, "Bounds at rest")."""
