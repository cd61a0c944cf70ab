"""The shared libraries of an FMU, for each platform and flavour."""
