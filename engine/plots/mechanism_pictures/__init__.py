"""A mechanism at one instant."""
