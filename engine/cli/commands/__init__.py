"""The engine's commands, one a file."""
