"""Exported models as C99 that any compiler takes: runtime, generated units and a shell, without arrays of variable length."""
