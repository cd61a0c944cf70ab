"""Every friction law in every joint type with friction, on random scenes. Each run reaches its end, and the balance of energy is
closed."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tests.reference.scenes.random_scenes import random_tree
from trunnion.elements.friction import REGISTRY
from trunnion.elements.joints import REGISTRY as JOINTS
from trunnion.simulation.run import simulate

TYPES = tuple(kind.name for kind in JOINTS.values() if kind.friction and not kind.bodiless)
ACCOUNT = 1e-6
"""Allowed residual as a part of the largest energy or work, for runs at rtol 1e-8 with events."""


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("law", "kind"), list(product(REGISTRY, TYPES)))
def test_energy_is_accounted_for(law: str, kind: str) -> None:
    """Each scene has one joint of the type. The test runs each law and each type with exact contacts and with Adams' normal
    force."""
    adams = float((list(REGISTRY).index(law) + TYPES.index(kind)) % 2)
    case = random_tree(7, 1, types=(kind,), friction=1.0, devices=0.0, drives=0.0, laws=(law,), adams=adams)
    assert all(j.friction is not None for j in case.scene.joints.values())
    r = simulate(case.scene, until=0.4, every=0.01, rtol=1e-8, outputs=("energy.*", "*.friction.work"))
    assert r.outcome.ok
    size = np.abs(r["energy.kinetic"]).max() + np.abs(r["energy.potential"]).max() + np.abs(r["energy.dissipated"]).max()
    assert np.abs(r["energy.residual"]).max() <= ACCOUNT * size
    for name in case.scene.joints:
        work = r[f"{name}.friction.work"]
        assert work[-1] < 0.0
        if not REGISTRY[law].bristles:  # bristles return energy that they have stored
            assert np.diff(work).max() <= ACCOUNT * size
