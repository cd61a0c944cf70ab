"""The components of a running server."""
