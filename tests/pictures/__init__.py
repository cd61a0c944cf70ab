"""The pictures of bundled models and of the paper."""
