"""Makes compiled libraries from systems. The stages are symbolic expressions, C text, compiler and cache."""
