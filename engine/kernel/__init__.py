"""The way from a system to a compiled library: symbolic expressions, C text, compiler, cache."""
