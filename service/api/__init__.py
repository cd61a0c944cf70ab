"""The REST interface under /v1, health and metrics, and the web page."""
