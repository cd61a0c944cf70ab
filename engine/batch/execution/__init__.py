"""Execution of cases on this machine's processors."""
