"""Construction of a system from a scene."""
