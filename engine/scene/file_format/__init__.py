"""Scenes as YAML, their schema and the page of their keys."""
