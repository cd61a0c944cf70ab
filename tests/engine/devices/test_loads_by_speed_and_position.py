"""Loads that depend on speed and position, with friction: at rest, in batches, in FMUs, and in long chains."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict

MASS, MU, G = 2.0, 0.3, 9.81
RUB = {"mu": MU, "half_width": 0.01, "half_height": 0.01, "half_length": 0.5}
CURVE = {"at": [0.0, 0.1, 0.2, 0.3], "effort": [-5.0, 1.0, 4.0, 30.0]}
"""Two adjacent chords have the slopes 60 and 30, so the curve passes 1 N at 0.1 m and 4 N at 0.2 m exactly."""


def block(**keys: Any) -> dict[str, Any]:
    """A block with friction on a rail along x."""
    forces = keys.pop("forces", {})
    rail = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "b", "pin": "outboard", "friction": RUB, **keys}
    body = {"mass": MASS, "inertia": [0.1, 0.1, 0.1]}
    return {"name": "block", "bodies": {"b": body}, "joints": {"rail": rail}, "forces": forces}


HOLDS = {
    "spring curve": lambda f: block(nonlinear={"spring_curve": {"at": [0, 0.1, 0.2], "effort": [0, f, 3 * f]}}, start={"q": 0.1}),
    "strut": lambda f: block(start={"q": 0.1}, forces={"s": {
        "type": "spring_damper", "between": ["b", "ground"], "nonlinear": {"spring_curve": {"at": [0, 0.1], "effort": [0, f]}}}}),
    "field": lambda f: block(start={"q": 0.1}, forces={"s": {"type": "field", "on": "b", "fx": f"{f!r} N*(x/(0.1 m))^2"}}),
    "attraction": lambda f: block(start={"q": 0.1}, forces={"s": {
        "type": "point_gravity", "on": "b", "towards": "ground", "gm": f * 0.01 / MASS}}),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOLDS)
def test_friction_holds_up_to_its_limit(kind: str) -> None:
    """Static friction holds a load of μ m g less one millionth. It does not hold a load of μ m g plus one millionth."""
    limit = MU * MASS * G
    for share, stays in ((1 - 1e-6, True), (1 + 1e-6, False)):
        scene = scene_from_dict(HOLDS[kind](limit * share))
        assert trunnion.hold(scene).holds == stays
        r = trunnion.simulate(scene, until=0.1, every=0.1)
        assert (abs(r["rail.q[1]"][-1] - 0.1) < 1e-12) == stays


def everything() -> trunnion.Scene:
    """A block with friction under every load, and a second body in the air."""
    law = {"spring_curve": CURVE, "quadratic_damping": 1.5, "damping_curve": {"speed": [0, 1, 2], "effort": [0, 2, 3]}}
    forces = {
        "strut": {"type": "spring_damper", "between": ["ball", "ground"],
                  "nonlinear": law | {"spring_curve": {"at": [3, 4, 5], "effort": [-1, 1, 5]}}},
        "air": {"type": "drag", "on": "ball", "area": 0.2, "coefficient": 0.9, "density": 1.2},
        "sun": {"type": "point_gravity", "on": "ball", "towards": "b", "gm": 1.0},
        "magnet": {"type": "field", "on": "ball", "fy": "-3 N/m*y*exp(-(x/1 m)^2)", "fz": "k*z"},
    }
    data = block(nonlinear=law, start={"q": 0.25, "qd": 1.0}, forces=forces)
    data["bodies"]["ball"] = data["bodies"]["b"]
    data["joints"]["free"] = {"type": "free", "inboard": "ground", "outboard": "ball", "start": {"q": [1, 2, 3, 1, 0, 0, 0]}}
    return scene_from_dict({**data, "parameters": {"k": "2 N/m"}})


NAMES = ["rail.q[1]", *(f"free.q[{i}]" for i in (1, 2, 3))]


@pytest.mark.slow
def test_an_fmu_moves_as_the_run_also_with_other_values() -> None:
    file = FOLDER / "loads.fmu"
    export(everything(), file, kind="cs", kernel="parts")
    for change in ({}, {"forces.air.area": 0.9, "parameters.k": 5.0, "joints.rail.nonlinear.quadratic_damping": 9.0}):
        host = Host(file, solver__tolerance=1e-11, **change)
        expected = trunnion.simulate(everything(), until=1.0, every=0.5, rtol=1e-11, overrides=change)
        for k in range(2):
            host.fmu.doStep(0.5 * k, 0.5)
            found = np.array([host.get(n) for n in NAMES]).ravel()
            assert found == pytest.approx([expected[n][k + 1] for n in NAMES], abs=1e-8)


def test_four_cases_at_once_in_vector_lanes_have_the_results_of_single_runs() -> None:
    values, name = [0.5, 1.0, 2.0, 4.0], "joints.rail.nonlinear.quadratic_damping"
    table = trunnion.sweep(everything(), {name: values}, until=0.5, kernel="compiled",
                           reductions=[f"final:{n}" for n in NAMES]).table  # fmt: skip
    for i, c in enumerate(values):
        one = trunnion.simulate(everything(), until=0.5, overrides={name: c}, kernel="compiled")
        for n in NAMES:
            assert table[f"final:{n}"].to_numpy()[i] == pytest.approx(one[n][-1], rel=1e-12)


@pytest.mark.slow
def test_long_chains_have_nonlinear_springs_and_dampers_in_both_kernels() -> None:
    """Bodies of a long tree share code, and each body has its own numbers."""
    bodies, joints, forces = {}, {}, {}
    for i in range(20):
        bodies[f"b{i}"] = {"mass": 1.0 + i, "inertia": [0.1, 0.1, 0.1], "points": {"end": [0.3, 0, 0]}}
        nonlinear = {"spring_curve": {"at": [0.0, 0.1 + i], "effort": [0.0, 2.0]}, "quadratic_damping": 0.1 * i}
        inboard = f"b{i - 1}.end" if i else "ground"
        joints[f"j{i}"] = {"type": "revolute", "axis": "y", "inboard": inboard, "outboard": f"b{i}", "nonlinear": nonlinear}
        forces[f"air{i}"] = {"type": "drag", "on": f"b{i}.end", "area": 1.0 + i, "coefficient": 1, "density": 1.2}
        forces[f"field{i}"] = {"type": "field", "on": f"b{i}", "fx": f"-{i + 1} N/m*x*z/(1 m)"}
    scene = scene_from_dict({"name": "chain", "bodies": bodies, "joints": joints, "forces": forces})
    parts, compiled = (trunnion.simulate(scene, until=0.05, every=0.05, rtol=1e-11, kernel=k) for k in ("parts", "compiled"))
    for name in parts.names:
        if ".q[" in name or ".force" in name or ".effort" in name:
            assert parts[name] == pytest.approx(compiled[name], rel=1e-9, abs=1e-9)
    assert abs(parts["j19.nonlinear.effort[1]"][-1]) > 1e-3
