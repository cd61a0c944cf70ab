"""Settings of runs: reading, defaults, checks, choice of the kernel."""
