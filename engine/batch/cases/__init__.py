"""Cases of a batch: grids, lists, samples, distributions."""
