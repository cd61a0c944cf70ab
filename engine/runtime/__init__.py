"""The C that steps a mechanism, by stages, and the Python tables it is generated from: ``abi`` and ``integrators``."""
