"""Bodies of negligible mass on loops have the freedoms, the redundancy and the motion of bodies without mass."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from trunnion.cli.output.scene_report import examined
from trunnion.scene.overrides import scene_given
from trunnion.simulation.run import simulate

MASSES = (1e-6, 1e-9, 1e-12)
"""Masses of the light body, kg; the other bodies have kilograms."""
TORQUE = 1.0
"""Driving torque, N m."""


def gears(nut: float, inertia: float, ratios: tuple[float, ...] = (2.0,)) -> dict[str, Any]:
    """Wheels in mesh, modelled as screws on one nut of mass `nut`, kg; a torque drives the first."""
    bodies: dict[str, Any] = {"nut": {"mass": nut, "inertia": [inertia] * 3}}
    joints: dict[str, Any] = {"way": {"type": "prismatic", "axis": "z", "inboard": "ground", "outboard": "nut"}}
    for i, ratio in enumerate((1.0, *ratios)):
        place = [0.15 * i, 0, 0]
        bodies[f"w{i}"] = {"cylinder": {"radius": 0.05 * ratio, "length": 0.02, "axis": "z"}, "mass": 1.0 + i}
        joints[f"A{i}"] = {"type": "revolute", "axis": "z", "inboard": {"body": "ground", "point": place}, "outboard": f"w{i}"}
        there = {"body": "nut", "point": place}
        joints[f"M{i}"] = {"type": "screw", "axis": "z", "pitch": ratio * (-1) ** i, "inboard": f"w{i}", "outboard": there}
    joints["A0"]["effort"] = TORQUE
    lasts = {"gravity": [0, 0, 0], "simulation": {"until": 0.5, "every": 0.1}}
    return {"schema": 1, "name": "gears", "bodies": bodies, "joints": joints, **lasts}


def four_bar(coupler: float, point: bool) -> dict[str, Any]:
    """A crank and a rocker with masses of kilograms, and a coupler of `coupler` kg. The coupler is a rod or, with ``point``, a mass
    at its pin. There is no drive."""

    def link(length: float, mass: float) -> dict[str, Any]:
        j = mass * length**2 / 12
        return {"mass": mass, "inertia": [0, j, j], "center": [length / 2, 0, 0], "points": {"end": [length, 0, 0]}}

    light = link(1.2, coupler) if not point else {"mass": coupler, "inertia": [0, 0, 0], "points": {"end": [1.2, 0, 0]}}
    pivot = {"body": "ground", "point": [1.3, 0.3, 0]}
    joints: dict[str, Any] = {
        "A": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank", "start": {"q": 1.05}},
        "B": {"type": "revolute", "axis": "z", "inboard": "crank.end", "outboard": "coupler"},
        "C": {"type": "revolute", "axis": "z", "inboard": "coupler.end", "outboard": "rocker.end"},
        "D": {"type": "revolute", "axis": "z", "inboard": pivot, "outboard": "rocker", "start": {"q": 1.7}},
    }
    bodies = {"crank": link(1.0, 5.0), "coupler": light, "rocker": link(0.9, 3.0)}
    down = {"gravity": [0, -9.81, 0], "simulation": {"until": 2, "every": 0.01}}
    return {"schema": 1, "name": "four_bar", "bodies": bodies, "joints": joints, **down}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("nut", MASSES)
@pytest.mark.parametrize("inertia", [0.0, 1e-15])
def test_freedoms_are_counted_beside_a_body_without_weight(nut: float, inertia: float) -> None:
    for ratios in ((2.0,), (2.0, 0.5)):
        start = examined(scene_given(gears(nut, inertia, ratios)))[0]["start"]
        assert start["moving_freedoms"] == 1
        assert start["redundant_rows"] == 4 + 4 * len(ratios)  # each loop has five rows; one is needed, four are redundant


@pytest.mark.parametrize("nut", MASSES)
def test_wheels_on_a_nut_without_weight_turn_as_in_mesh(nut: float) -> None:
    r = simulate(gears(nut, 0.0, (2.0, 0.5)), rtol=1e-9)
    inertias = [0.5 * (1.0 + i) * (0.05 * k) ** 2 for i, k in enumerate((1.0, 2.0, 0.5))]
    whole = sum(j / k**2 for j, k in zip(inertias, (1.0, 2.0, 0.5), strict=True))
    whole += nut / (2 * np.pi) ** 2
    assert r["A0.q[1]"][-1] == pytest.approx(0.5 * TORQUE / whole * 0.5**2, rel=1e-7)
    assert r["A1.q[1]"][-1] == pytest.approx(-r["A0.q[1]"][-1] / 2.0, rel=1e-9)


@pytest.mark.parametrize("point", [False, True])
def test_a_coupler_without_weight_only_ties_the_others(point: bool) -> None:
    """A coupler of 1 mg changes the motion by 1e-6, which is its mass relative to the other masses. Lighter couplers cause no
    change."""
    runs = [simulate(four_bar(m, point), rtol=1e-8, outputs=["*.q[1]", "energy.*"]) for m in MASSES]
    for m, r in zip(MASSES, runs, strict=True):
        assert r.outcome.ok
        energy = r["energy.kinetic"] + r["energy.potential"]
        assert np.ptp(energy) <= 1e-5 * r["energy.kinetic"].max()
        assert abs(r["A.q[1]"] - runs[-1]["A.q[1]"]).max() <= 3.0 * m + 3e-6
