"""A note reports when a contact of a sliding part leaves its guide. The test compares this instant with motion at constant
acceleration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate


def made(seed: int) -> tuple[sm.Scene, float | None]:
    """A constant force drives a block without weight along a rail; the friction is 0. The contacts are at the ends of the short
    part. Also returns the first instant at which a contact is beyond the long part, from the quadratic equation."""
    rng = np.random.default_rng(seed)
    half, length, travel = rng.uniform(0.02, 0.05), rng.uniform(0.3, 0.5), rng.uniform(0.2, 0.6)
    short_moves, rail_on = bool(rng.random() < 0.5), rng.uniform(-0.05, 0.05, 2)
    long_bar = sm.Body(box=(float(length), 0.02, 0.02), mass=1.0, center=(float(rail_on[0]), 0.0, 0.0))
    short_bar = sm.Body(box=(float(2 * half), 0.02, 0.02), mass=1.0)
    parts = (long_bar, short_bar) if short_moves else (short_bar, long_bar)
    points = [(float(rail_on[1]), 0.0, 0.0), (0.0, 0.0, 0.0)]
    rail, block = points if short_moves else points[::-1]
    speed, force = float(rng.uniform(-1, 1)), float(rng.uniform(-3, 3))
    rub = sm.Friction(mu=0.1, half_length=float(half), half_width=0.01, half_height=0.01)
    guide = sm.Joint("prismatic", sm.Side("rail", rail), sm.Side("block", block), axis="x", friction=rub, effort=force,
                     ends="outboard" if short_moves else "inboard", start=sm.Start(qd=speed))  # fmt: skip
    bodies = dict(zip(("rail", "block"), parts, strict=True))
    scene = sm.Scene(bodies, {"foot": sm.Joint("fixed", "ground", "rail"), "guide": guide}, gravity=(0.0, 0.0, 0.0))
    middle = float(rail_on[0] - rail_on[1]) * (1 if short_moves else -1)
    until, times = float(travel), []
    for end in (middle - length / 2 + half, middle + length / 2 - half):
        roots = np.roots([force / 2, speed, -end])
        times += [float(t.real) for t in roots if abs(t.imag) < 1e-12 and 0 < t.real < until]
    return replace(scene, simulation=sm.Simulation(until=until, every=until / 7)), min(times, default=None)


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("seed", range(110))
def test_a_note_reports_when_a_contact_leaves_its_guide(seed: int) -> None:
    scene, wanted = made(seed)
    notes = [n for n in simulate(scene).notes if n.startswith("guide: from t")]
    told = [float(n.split(" s ")[0].rpartition(" ")[2]) for n in notes]
    assert told == ([] if wanted is None else [pytest.approx(wanted, abs=1e-9)])
