"""Positions of a scene's numbers in memory."""
