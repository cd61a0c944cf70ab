"""Statistics of samples: quantiles, bins, Sobol indices."""
