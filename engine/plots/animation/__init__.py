"""A run as a page to turn and play, or as a film."""
