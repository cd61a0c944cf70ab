"""Exported models as C99 for any compiler. The sources hold the runtime, the generated units and a shell, and use no
variable-length arrays."""
