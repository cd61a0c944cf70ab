"""Columns against time."""
