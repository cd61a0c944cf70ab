"""Runs of a scene: settings, the simulation block, the run, the result."""
