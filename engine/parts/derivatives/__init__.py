"""Forward-mode derivatives of programs."""
