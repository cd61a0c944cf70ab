"""A run as an interactive page, or as a film."""
