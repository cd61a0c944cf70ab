"""What only files have: includes, assemblies, copies and expressions, which become a plain scene before it is read."""
