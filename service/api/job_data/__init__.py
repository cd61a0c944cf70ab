"""Access to the rows, plans and tallies of jobs."""
