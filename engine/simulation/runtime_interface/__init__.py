"""The runtime's block of memory and its functions in Python."""
