"""Friction laws as tests name them: changes to a scene (a bundled paper scene names none)."""

PAPER = {"friction.law": "regularized", "friction.v_eps": 1e-4}
"""The paper's regularised law (104) with the v_eps that the paper uses, 1e-4 m/s."""
