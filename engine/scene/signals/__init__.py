"""Kinds of signals: one file for each kind, and a registry."""
