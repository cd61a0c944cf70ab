"""Request models with their limits."""
