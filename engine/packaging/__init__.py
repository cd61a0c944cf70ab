"""Building of wheels."""
