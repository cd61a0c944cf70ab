"""Bundled scenes and starters."""
