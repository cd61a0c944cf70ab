"""Angles of joints at which a loop is cut. The columns of these angles count whole turns at any spacing of rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trunnion import simulate
from trunnion.scene.data_classes import scene as sm

PINS = ("main", "crankpin", "gudgeon")


def slider_crank(seed: int, driven: bool) -> sm.Scene:
    """A slider-crank that turns several times a second. A drive turns it at constant rate, or it is thrown, with friction at the
    guide."""
    rng = np.random.default_rng(seed)
    crank, rod = rng.uniform(0.05, 0.15), rng.uniform(0.3, 0.6)
    rate = float(rng.choice([-1, 1]) * rng.uniform(15.0, 40.0))
    drive = sm.Drive(constant=sm.Constant(rate=rate)) if driven else None
    start = None if driven else sm.Start(q=0.0, qd=rate)
    pin, rub = {"axis": "z", "reference": "x"}, None if driven else sm.Friction(force=0.5)
    joints = {
        "main": sm.Joint("revolute", "ground", "crank", **pin, drive=drive, start=start),
        "crankpin": sm.Joint("revolute", sm.Side("crank", (crank, 0.0, 0.0)), "rod", **pin),
        "gudgeon": sm.Joint("revolute", sm.Side("rod", (rod, 0.0, 0.0)), "slider", **pin),
        "guide": sm.Joint("prismatic", "ground", "slider", axis="x", reference="y", friction=rub),
    }
    bodies = {n: sm.Body(mass=1.0, inertia=(0.01, 0.01, 0.01)) for n in ("crank", "rod", "slider")}
    return sm.Scene(bodies, joints, "crank", gravity=(0.0, 0.0, 0.0))


def cut_at(scene: sm.Scene, pin: str) -> sm.Scene:
    """The scene with its loop cut at this joint."""
    return replace(scene, joints={n: replace(j, cut=n == pin) for n, j in scene.joints.items()})


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("driven", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_turns_are_counted_between_rows_and_are_those_of_other_cuts(seed: int, driven: bool) -> None:
    """Rows are half a turn apart or more, so that turns cannot be counted from row to row."""
    scene = slider_crank(seed, driven)
    cuts = PINS[1:] if driven else PINS
    ends = {}
    for pin in cuts:
        for rows in (1, 7, 400):
            r = simulate(cut_at(scene, pin), until=1.0, every=1.0 / rows, rtol=1e-8)
            assert r.outcome.ok
            ends[pin, rows] = [r[f"{n}.q[1]"][-1] for n in PINS]
    first = ends[cuts[0], 400]
    assert abs(first[0]) > 4.0 * np.pi
    for end in ends.values():
        assert end == pytest.approx(first, abs=1e-5)  # the runs have rtol 1e-8, and the angles are tens of radians
