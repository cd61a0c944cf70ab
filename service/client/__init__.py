"""The service's client in Python."""
