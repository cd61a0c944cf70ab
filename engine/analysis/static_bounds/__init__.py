"""Statics with friction: one admissible state, or bounds over all admissible states (theory, "Bounds at rest")."""
