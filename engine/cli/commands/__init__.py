"""The engine's commands, one per file."""
