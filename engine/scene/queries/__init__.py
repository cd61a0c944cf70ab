"""Queries: information that follows from a scene without building the system."""
