"""From a system to a compiled library: symbolic build, C, compiler, cache."""
