"""Ensembles on a graphics processor: a prototype that builds, checks and times the C library of a mechanism there."""
