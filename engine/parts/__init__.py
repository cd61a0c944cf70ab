"""Scenes as bytecode: precompiled primitives whose operands are numbers, and programs that call these primitives (theory,
"Parts")."""
