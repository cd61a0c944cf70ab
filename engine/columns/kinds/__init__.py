"""Kinds of output columns, each in a file of its own."""
