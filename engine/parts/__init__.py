"""Scenes as bytecode: precompiled primitives with numbers as operands, and programs that call them (theory, "Parts")."""
