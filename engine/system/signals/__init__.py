"""Signals as tables, and frequencies of signals."""
