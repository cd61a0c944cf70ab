"""Friction laws as tests name them: changes to a scene (a bundled paper scene names none)."""

PAPER = {"friction.law": "regularized", "friction.v_eps": 1e-4}
"""(104) at the paper's own speed."""
