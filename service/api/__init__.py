"""The REST interface under /v1, and the endpoints for health and metrics."""
