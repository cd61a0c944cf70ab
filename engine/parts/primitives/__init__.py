"""Primitives: C functions compiled once for all scenes, and their cache."""
