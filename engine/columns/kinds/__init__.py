"""Kinds of output columns, one file for each kind."""
