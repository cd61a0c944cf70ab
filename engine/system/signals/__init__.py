"""Signals as tables, profiles of moves, and frequencies of signals."""
