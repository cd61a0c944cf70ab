"""Parameter estimation from measured curves: intervals, identifiability, model comparison, experiment design."""
