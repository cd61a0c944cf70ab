"""A file for each kind of output column."""
