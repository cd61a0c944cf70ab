"""A scene made into a system."""
