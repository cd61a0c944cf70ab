"""Keys, limits and formats of all requests."""
