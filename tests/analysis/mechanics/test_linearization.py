"""Linearisations equal the derivatives of the motion and of the reported columns."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.engine.mechanisms.redundant_loops import four_bar
from trunnion.analysis.mechanics.linearization import _Point, _run_to
from trunnion.runtime.abi import Array
from trunnion.scene import scene_from_dict, scene_to_dict
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings

HELD = ("events.", "audit.", "energy.")
STEP = 1e-6
"""Step of central differences in units of order 1. The third derivative causes an error of order 1e-12, round-off one of 1e-10."""


def pushed_chain() -> trunnion.Scene:
    """Two links with friction, an input force and an input torque."""
    bar = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"a": [-0.3, 0, 0], "b": [0.3, 0, 0]}}
    rub = {"mu": 0.2, "radius": 0.01, "half_length": 0.02, "law": "regularized", "v_eps": 1e-3}
    return scene_from_dict({
        "gravity": [0, -9.81, 0], "bodies": {"one": bar, "two": bar},
        "inputs": {"push": {"start": 3, "unit": "N"}, "motor": {"start": 0.5, "unit": "N*m"}},
        "joints": {
            "hip": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "one.a", "friction": rub,
                    "effort": {"input": "motor"}, "start": {"q": 0.3, "qd": 1.0}},
            "knee": {"type": "universal", "axis": "z", "reference": "y", "inboard": "one.b", "outboard": "two.a",
                     "start": {"q": [0.2, 0.1], "qd": [-0.5, 0.4]}},
        },
        "forces": {"wind": {"type": "force", "on": "two.b", "force": [{"input": "push"}, 0, 1]}},
    })  # fmt: skip


def driven_crank() -> trunnion.Scene:
    """Example 8.2 with the crank's angle as an input: a closed, redundant loop with friction."""
    data = scene_to_dict(trunnion.load_scene("crank_slider"))
    data["inputs"] = {"angle": {"start": 0.4, "unit": "rad", "bandwidth": 20.0}}
    data["joints"]["crank_pivot"]["drive"] = {"input": "angle"}
    data["friction"] = {"law": "regularized", "v_eps": 1e-3}
    return scene_from_dict(data)


def differences(model: Model, dy: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(δẋ, δcolumns) along a direction (dy, inputs), by central differences of the block's own evaluation."""
    block = model.block
    y, found = block.y.copy(), []
    count = len(model.system.inputs)
    tables = block._view(Array.TABLES, block._sizes[1])
    kept = tables.copy()
    for sign in (1, -1):
        block.y[: block.ny] = y[: block.ny] + sign * STEP * dy
        for i in range(count):
            at = int(kept[i])
            tables[at + 2] = block.time
            tables[at + 3 : at + 6] = kept[at + 3 : at + 6] + sign * STEP * inputs[4 * i : 4 * i + 3]
        rates = block.evaluate()[0].copy()
        row = np.zeros(block.width)
        block.row(row)
        found.append((rates, row[1:]))
        block.y[:], tables[:] = y, kept
    return tuple((a - b) / (2 * STEP) for a, b in zip(*found, strict=True))


def pushed_four_bar() -> trunnion.Scene:
    """A redundant loop whose friction depends on the reactions that the motion does not determine."""
    data = scene_to_dict(four_bar("regularized"))
    data["inputs"] = {"push": {"start": 3, "unit": "N"}}
    data["forces"] = {"wind": {"type": "force", "on": "coupler", "force": [{"input": "push"}, 0, 1]}}
    return scene_from_dict(data)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("make", [pushed_chain, driven_crank, pushed_four_bar])
@pytest.mark.parametrize("at", [0.0, 0.13])
def test_directions_are_those_of_differences(make, at: float) -> None:
    model = Model(make())
    settings = Settings(rtol=1e-9)
    _run_to(model, at, settings)
    point = _Point(model)
    rng = np.random.default_rng(3)
    ny, ni = model.block.ny, 4 * len(model.system.inputs)
    directions = [np.zeros(ny)] if model.system.cuts else [rng.normal(size=ny), np.zeros(ny)]
    for dy in directions:
        seed = rng.normal(size=ni)
        seed[3::4] = 0.0
        # in a loop, a change of a single displacement or rate would open the loop; a change of a single acceleration or force is
        # allowed
        if model.system.cuts:
            seed[:] = 0.0
            seed[0 if model.built.scene.forces else 2 :: 4] = 1.0
        exact, expected = point.along(seed, dy), differences(model, dy, seed)
        for got, want, names in zip(exact, expected, ([], [c.name for c in model.columns]), strict=True):
            size = np.abs(want).max()
            held = [i for i, n in enumerate(names) if n.startswith(HELD) or ".state" in n or n.endswith(".work")]
            error = np.abs(np.delete(got - want, held)).max()
            assert error <= 2e-6 * size, (error, size)


def test_a_pendulum_is_linearised_as_by_hand() -> None:
    """A compound pendulum about its lower position has A = [[0, 1], [−m g l/I, −c/I]] and the input matrix 1/I for a torque."""
    scene = scene_from_dict({
        "gravity": [0, -9.81, 0], "bodies": {"bar": {"mass": 2, "inertia": [0.1, 0.2, 0.3], "center": [0.5, 0, 0]}},
        "inputs": {"motor": {"unit": "N*m"}},
        "joints": {"pin": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "bar", "damping": 0.4,
                           "effort": {"input": "motor"}, "start": {"q": -np.pi / 2, "qd": 0}}},
    })  # fmt: skip
    linear = trunnion.linearize(scene, outputs=["pin.q[1]", "pin.qdd*"])
    inertia = 0.3 + 2 * 0.25
    assert linear.states == ("pin.q[1]", "pin.qd[1]")
    assert linear.inputs == ("motor",)
    lower = [-2 * 9.81 * 0.5 / inertia, -0.4 / inertia]
    assert np.allclose(linear.A, [[0, 1], lower], atol=1e-13)
    assert np.allclose(linear.B, [[0], [1 / inertia]], atol=1e-13)
    assert linear.outputs == ("pin.q[1]", "pin.qdd[1]")
    assert np.allclose(linear.C, [[1, 0], lower], atol=1e-13)
    assert np.allclose(linear.D, [[0], [1 / inertia]], atol=1e-13)


def test_a_linearisation_predicts_a_small_change(tmp_path: Path) -> None:
    """Over 20 ms, the linear system predicts the effect of a small push on the motion. The error is of second order in the push."""
    scene = pushed_chain()
    linear = trunnion.linearize(scene, outputs=["two.b.position*"])
    h, push = 0.002, 0.1
    ends = [trunnion.simulate(scene, until=h, rtol=1e-12, overrides={"inputs.push.start": 3 + p}).data[-1] for p in (push, -push)]
    names = trunnion.simulate(scene, until=h, rtol=1e-12).names
    expected = linear.C @ (0.5 * h * h * linear.A @ linear.B[:, 0] * push)
    got = [(ends[0][names.index(n)] - ends[1][names.index(n)]) / 2 for n in linear.outputs]
    assert np.allclose(got, expected, rtol=0.05, atol=1e-3 * np.abs(expected).max())
    written = json.loads(linear.save(tmp_path / "linear.json").read_text())
    assert np.array_equal(written["A"], linear.A)
    with np.load(linear.save(tmp_path / "linear.npz")) as data:
        assert np.array_equal(data["D"], linear.D)
