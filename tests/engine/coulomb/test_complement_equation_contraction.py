"""The reported contraction of the complement equations is their spectral radius."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from trunnion import simulate

FRICTION = {"mu": 0.3, "radius": 0.05, "half_length": 0.05}
SWINGS: dict[str, dict[str, Any]] = {
    "short": {"box": [0.3, 0.06, 0.04], "density": 2700, "center": [0.15, 0, 0.02]},
    "long": {"box": [0.31, 0.06, 0.04], "density": 2700, "center": [0.155, 0, 0.02]},
}


def contraction(names: list[str], kernel: str) -> np.ndarray:
    joints = {f"on_{n}": {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": n, "friction": FRICTION} for n in names}
    scene = {"schema": 1, "gravity": [0, 0, -9.81], "bodies": {n: SWINGS[n] for n in names}, "joints": joints}
    return simulate(scene, until=0.2, every=0.02, rtol=1e-10, kernel=kernel, outputs="audit.contraction")["audit.contraction"]


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_independent_mechanisms_have_the_largest_of_their_contractions(kernel: str) -> None:
    """The spectral radii of the two mechanisms differ little, so that power iteration converges slowly to the larger radius."""
    short, long = (contraction([n], kernel) for n in SWINGS)
    assert short[1:].min() > 1e-3
    assert np.abs(short / long - 1.0).max() < 0.2
    assert contraction(["short", "long"], kernel) == pytest.approx(np.maximum(short, long), rel=1e-6)
