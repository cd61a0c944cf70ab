"""Nonlinear springs and dampers: one file per law, and the list of all laws."""
