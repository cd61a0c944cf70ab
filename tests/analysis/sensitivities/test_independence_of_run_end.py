"""Derivatives up to a time do not depend on the rest of the run, in random mechanisms with pairs that stick and with contacts that
begin and end."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from tests.default_case_selection import sampled
from tests.reference.scenes.random_device_scenes import CONTACTS, FAMILIES, crossed

PRECISION = 1e-6
"""Allowed difference relative to the largest derivative. A run that ends elsewhere has other steps before its end."""
LEAST = 1e-9
"""Least size with which derivatives are compared, in the units of coordinates and rates for a kilogram. Where a mechanism does not
depend on the mass, derivatives are round-off."""
BRIEF = {(family, 0) for family in ("belts", "cams", "dropped_levers", "braked_wheels", "drives_that_die")}


@pytest.mark.parametrize(("family", "seed"), sampled([(f, seed) for f in FAMILIES | CONTACTS for seed in range(3)], BRIEF))
def test_derivatives_up_to_a_time_do_not_depend_on_the_rest_of_the_run(family: str, seed: int) -> None:
    scene = crossed(family, seed)
    mass = [f"bodies.{next(iter(scene.bodies))}.mass"]
    try:
        runs = [trunnion.sensitivity(scene, mass, ["*.q[*]", "*.qd[*]"], until, 0.01) for until in (0.05, 0.1, 0.15)]
    except trunnion.SimulationError as refusal:
        if "no derivative" not in str(refusal):
            raise
        return
    whole = runs[-1].derivatives
    for shorter in runs[:-1]:
        inside = len(shorter.time) - 1
        scale = max(np.abs(whole[:inside]).max(), LEAST)
        assert np.abs(shorter.derivatives[:inside] - whole[:inside]).max() <= PRECISION * scale
