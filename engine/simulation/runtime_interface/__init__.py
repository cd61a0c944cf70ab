"""Python interface to the runtime's simulation blocks and functions."""
