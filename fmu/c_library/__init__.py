"""Exported models as C99 for any compiler. The sources hold the runtime, the generated C files and the functions that the user
calls. The sources use no variable-length arrays."""
