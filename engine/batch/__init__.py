"""Batches of runs of one scene: cases, their parameters, the C loop over them, tables and statistics of their results."""
