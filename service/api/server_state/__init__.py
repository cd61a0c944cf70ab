"""Components of a running server."""
