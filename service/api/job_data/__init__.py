"""Access to the rows and plans of jobs."""
