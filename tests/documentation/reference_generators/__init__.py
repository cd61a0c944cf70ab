"""The programs that write the generated pages of the reference, one in each file."""
