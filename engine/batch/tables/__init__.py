"""Tables of cases: reductions, trajectories, data sets."""
