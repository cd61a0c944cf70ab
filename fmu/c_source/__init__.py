"""The C sources of an exported model."""
