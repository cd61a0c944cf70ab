"""Facts that follow from a scene alone."""
