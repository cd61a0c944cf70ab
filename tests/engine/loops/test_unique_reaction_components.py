"""In redundant loops, some components of reactions and some efforts of drives are not unique. The test compares the reported
components with the left null space of all constraint rows of free bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.engine.mechanisms.redundant_loops import four_bar
from tests.reference.dynamics import loose
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.mechanics.rotation import random_rotation
from tests.reference.states_from_columns import state_at
from tests.scalable_mechanisms import n_four_bar
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.simulation.run import Model, run, simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings

DETERMINED, OPEN = 1e-9, 1e-5
"""Changes of a component relative to the largest component of its joint. Below the first number, a change is round-off; above the
second number, the component is open. Random mechanisms have no changes between these numbers."""


class Draft:
    """A random mechanism of rigid links, turned in space. At the start, the axes of all link frames are parallel to the axes of the
    world."""

    def __init__(self, seed: int):
        self.rng = np.random.default_rng(seed)
        self.turn, self.bodies, self.joints = random_rotation(self.rng), {}, {}

    def link(self, name: str) -> str:
        if name != "ground":
            place = self.turn @ self.rng.uniform(-0.5, 0.5, 3)
            sizes = {"mass": self.rng.uniform(0.5, 2.0), "inertia": self.rng.uniform(0.02, 0.03, 3).tolist()}
            self.bodies.setdefault(name, {**sizes, "center": place.tolist()})
        return name

    def join(self, a: str, b: str, at: Any, axis: Any = (0, 0, 1), kind: str = "revolute", **more: Any) -> str:
        name = f"j{len(self.joints)}"
        place = (self.turn @ at).tolist()
        sides = {side: {"body": self.link(x), "point": place} for side, x in (("inboard", a), ("outboard", b))}
        ways = {} if kind == "spherical" else {"axis": (self.turn @ axis).tolist()}
        self.joints[name] = {"type": kind, **sides, **ways, **more}
        return name

    def ring(self, first: str, last: str, points: Iterator[Any], tag: str = "l", **kinds: Any) -> list[str]:
        """Links between two parts. The joints turn about the z axis at the given points, which lie at any height."""
        places = [np.array([*p, self.rng.uniform(-0.2, 0.2)]) for p in points]
        chain = [first, *(f"{tag}{i}" for i in range(len(places) - 1)), last]
        ends = enumerate(zip(pairwise(chain), places, strict=True))
        return [self.join(a, b, p, **kinds.get(str(i), {})) for i, ((a, b), p) in ends]

    def circle(self, count: int) -> list[np.ndarray]:
        angles = np.arange(count) * 2 * math.pi / count + self.rng.uniform(-0.3, 0.3, count)
        return [r * np.array([math.cos(a), math.sin(a)]) for r, a in zip(self.rng.uniform(0.3, 0.6, count), angles, strict=True)]

    def scene(self) -> Scene:
        gravity = self.rng.uniform(-9, 9, 3).tolist()
        return scene_from_dict({"schema": 1, "gravity": gravity, "bodies": self.bodies, "joints": self.joints})


def planar(d: Draft) -> None:
    slide = {"kind": "prismatic", "axis": (*d.rng.normal(size=2), 0.0)}
    kinds = {"1": [{}, {"kind": "cylindrical"}, slide][d.rng.integers(3)]}
    d.ring("ground", "ground", d.circle(int(d.rng.integers(4, 7))), **kinds)


def loops(d: Draft) -> None:
    planar(d)
    d.ring(f"l{d.rng.integers(2)}", "ground", d.circle(3), "m")


def spherical(d: Draft) -> None:
    count = int(d.rng.integers(4, 6))
    chain = ["ground", *(f"l{i}" for i in range(count - 1)), "ground"]
    for a, b in pairwise(chain):
        axis = d.rng.normal(size=3)
        d.join(a, b, 0.4 * axis / np.linalg.norm(axis), axis)


def parallelogram(d: Draft) -> None:
    crank = 0.3 * np.array([math.cos(1.0), math.sin(1.0)])
    for i in range(3):
        foot = np.array([0.4 * i + d.rng.uniform(0, 0.1), d.rng.uniform(-0.1, 0.1)])
        d.join("ground", f"crank{i}", [*foot, d.rng.uniform(-0.1, 0.1)])
        d.join(f"crank{i}", "rod", [*(foot + crank), d.rng.uniform(-0.1, 0.1)])


def hinges(d: Draft) -> None:
    for height in np.cumsum(d.rng.uniform(0.1, 0.3, int(d.rng.integers(2, 4)))):
        d.join("ground", "door", [0.0, 0.0, height], kind="cylindrical" if d.rng.random() < 0.4 else "revolute")


def driven(d: Draft) -> None:
    planar(d)
    loop = list(d.joints)
    for name in d.rng.choice(loop, min(len(loop) - 3 + int(d.rng.integers(1, 3)), len(loop) - 1), replace=False):
        if d.joints[name]["type"] != "cylindrical":
            d.joints[name]["drive"] = {"constant": {"rate": 0.0}}


def driven_loops(d: Draft) -> None:
    """Two loops without a common joint. Drives hold all joints of each loop except one."""
    for tag in "lm":
        for name in d.ring("ground", "ground", d.circle(4), tag)[1:]:
            d.joints[name]["drive"] = {"constant": {"rate": 0.0}}


FAMILIES = [planar, loops, spherical, parallelogram, hinges, driven, driven_loops]


@pytest.mark.default_cases(8)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(20))
def test_components_reported_as_unique_do_not_change_with_internal_forces_and_the_others_do(family: Any, seed: int) -> None:
    draft = Draft(seed)
    family(draft)
    result = simulate(draft.scene(), until=1e-6)
    found, eq = result.redundancy, Equations(state_at(result, 0))
    assert found.count == len(eq.rows) - eq.rank
    amounts = np.random.default_rng(seed).normal(size=found.count)
    named = set(found.columns)
    for joint in result.scene.joints:
        change = loose(eq, joint) @ amounts
        largest = np.abs(loose(eq, joint)).max(initial=0.0)
        for k, size in enumerate(np.abs(change)):
            name = f"{joint}.reaction.{'force' if k < 3 else 'torque'}[{k % 3 + 1}]"
            if name in named:
                assert size > OPEN * largest, name
            else:
                assert size <= DETERMINED * max(largest, 1.0), name
    _check_drives(eq, found.drives, found.determined)


def _check_drives(eq: Equations, drives: tuple[str, ...], determined: tuple[dict[str, float], ...]) -> None:
    rows = {f"{r.joint}.drive.effort[{r.k + 1}]": eq.redundant[i] for i, r in enumerate(eq.rows) if r.role == "drive"}
    assert set(drives) == {n for n, row in rows.items() if np.abs(row).max(initial=0.0) > OPEN}
    if drives:
        changes = np.array([rows[n] for n in drives])
        assert len(determined) == len(drives) - np.linalg.matrix_rank(changes, tol=OPEN)
        weights = np.array([[c.get(n, 0.0) for n in drives] for c in determined]).reshape(-1, len(drives))
        assert np.linalg.matrix_rank(weights) == len(determined)
        assert np.abs(weights @ changes).max(initial=0.0) <= DETERMINED * np.abs(weights).max(initial=1.0)


@pytest.mark.parametrize("law", ["", "regularized"])
def test_a_moving_four_bar_has_unique_forces_in_its_plane(law: str) -> None:
    """The note names the open components at the start and at the end of the run, for every choice of columns."""
    result = simulate(four_bar(law) if law else n_four_bar(2), until=0.05, outputs=["*.q*"])
    assert result.redundancy.columns == tuple(f"{j}.reaction.{c}" for j in result.redundancy.joints for c in
                                              ("force[1]", "torque[2]", "torque[3]"))  # fmt: skip
    assert any(f"force[1], torque[2,3] of {', '.join(result.redundancy.joints)}" in n for n in result.notes)


def test_the_power_of_two_drives_of_one_crank_is_unique() -> None:
    """Two drives turn a parallelogram at one speed. The closed form of the sum is the torque on a crank with only one drive."""
    cranks = {n: {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": f"{n}_crank", "at": [x, 0, 0],
                  "drive": {"constant": {"rate": 2.0}}} for n, x in (("a", 0), ("b", 1))}  # fmt: skip
    pins = {f"{n}_pin": {"type": "revolute", "axis": "z", "inboard": f"{n}_crank", "outboard": "rod",
                        "at": [x, 0.3, 0]}
            for n, x in (("a", 0), ("b", 1))}  # fmt: skip
    body = {"mass": 2.0, "inertia": [0.1, 0.1, 0.1]}
    bodies = {n: {**body, "position": p} for n, p in (("a_crank", [0, 0, 0]), ("b_crank", [1, 0, 0]), ("rod", [0, 0.3, 0]))}
    result = simulate({"schema": 1, "gravity": [3.0, 0, 0], "bodies": bodies, "joints": cranks | pins}, until=0.1, every=0.1)
    assert result.redundancy.determined == ({"a.drive.effort[1]": 1.0, "b.drive.effort[1]": pytest.approx(1.0)},)
    assert any("a.drive.effort[1] + b.drive.effort[1]" in n for n in result.notes)
    total = result["a.drive.effort[1]"] + result["b.drive.effort[1]"]
    assert total == pytest.approx(2.0 * 3.0 * 0.3 * np.cos(2.0 * result.time), rel=1e-9)


def test_loops_without_drives_are_examined_together() -> None:
    """The loops are examined together, so that the work grows with the number of loops, not with its square."""
    model = Model(n_four_bar(5), ("*",), "parts")
    assert run(model, 0.001, 0.001, Settings()).redundancy.columns
    assert all(len(masks) == 1 for _, groups in model.columns_of_loops.values() for masks in groups)
