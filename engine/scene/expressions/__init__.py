"""Expressions of parameters in scenes."""
