"""Running a scene: the block of a simulation, the run, its result."""
