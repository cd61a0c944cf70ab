"""The friction law of the paper, as overrides of a scene. Bundled scenes of the paper's examples do not name a law."""

PAPER = {"friction.law": "regularized", "friction.v_eps": 1e-4}
"""The paper's regularised law (104) with the v_eps that the paper uses, 1e-4 m/s."""
