"""Settings, JSON and metrics, which all folders of the service use."""
