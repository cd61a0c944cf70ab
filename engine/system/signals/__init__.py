"""Signals as tables, and how fast they change."""
