"""The programs that write the generated pages of the reference, one a file."""
