"""Handling of all requests: keys, limits and formats."""
