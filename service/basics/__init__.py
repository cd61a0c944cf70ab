"""Settings, JSON and metrics, used by all folders of the service."""
