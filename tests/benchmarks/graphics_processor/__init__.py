"""Ensembles on a graphics processor: a prototype that builds the C library of a mechanism for it, checks its results and measures
its time."""
