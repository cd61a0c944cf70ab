"""Batches of runs of one scene: the cases, their parameters, the C loop over the cases, and tables and statistics of the
results."""
