"""Exported models as C99 for any compiler: runtime, generated units and a shell, without arrays of variable length."""
