"""Rows, plans and tallies of jobs."""
