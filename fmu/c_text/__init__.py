"""Transformations of C source text."""
