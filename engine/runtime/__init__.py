"""The C runtime that steps a mechanism, by stages, and the Python declarations from which C code is generated: ``abi`` and
``integrators``."""
