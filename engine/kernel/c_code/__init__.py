"""C text from symbolic expressions."""
