"""Models of requests, and checks of their limits."""
