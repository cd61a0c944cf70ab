"""Either part of a sliding joint may have the ends that its contacts sit at, whichever is inside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engine.scene import model as sm
from engine.simulation.run import simulate
from engine.system.build import build
from tests.engine.test_against_dense import TIME, compared
from tests.reference.random_scenes import Case, random_loop, random_tree

SLIDING = ("prismatic", "cylindrical")
ENDS = ("inboard", "outboard")
SLOPE, MU, HALF = 0.9, 0.2, 0.05


def with_ends(case: Case) -> Case:
    """The case with the ends of every sliding joint on the part that does not carry the pin."""
    other = {"inboard": "outboard", "outboard": "inboard"}
    joints = {n: replace(j, ends=other[j.pin]) if j.type in SLIDING else j for n, j in case.scene.joints.items()}
    return replace(case, scene=replace(case.scene, joints=joints))


@pytest.mark.parametrize("seed", range(6))
def test_ends_on_the_other_part_are_those_of_one_dense_solve(seed: int) -> None:
    how = {"t": TIME, "friction": 1.0, "types": SLIDING}
    compared(with_ends(random_tree(f"ends{seed}", **how)))


@pytest.mark.parametrize("kind", SLIDING)
def test_so_are_those_of_a_joint_that_is_cut(kind: str) -> None:
    how = {"bodies": 3, "closing": (kind,), "cut": True, "friction": 1.0, "laws": ("regularized",), "adams": 0.0}
    case = random_loop(f"ends {kind}", t=TIME, **how)
    assert [j.type for j in build(case.scene).system.cuts and case.scene.joints.values()].count(kind)
    compared(with_ends(case))


def test_they_are_the_same_where_parts_do_not_slide() -> None:
    made = [
        build(replace(c.scene, joints={n: replace(j, ends=e) for n, j in c.scene.joints.items()})).system
        for c in [random_tree("hinges", types=("revolute",), friction=1.0)]
        for e in (None, *ENDS)
    ]
    assert made[0] == made[1] == made[2]


def slid(kind: str, pin: str, ends: str | None, kernel: str) -> object:
    """A short sleeve that slides down a long inclined rod of the ground, with its mass in its middle."""
    size = {"half_width": 0.01, "half_height": 0.01} if kind == "prismatic" else {"radius": 0.01}
    rub = sm.Friction(mu=MU, half_length=HALF, **size)
    down = (float(np.cos(SLOPE)), 0.0, -float(np.sin(SLOPE)))
    side = sm.Side("ground", axis=down, reference="y")
    joint = sm.Joint(kind, side, "sleeve", axis="x", reference="y", pin=pin, ends=ends, friction=rub)
    body = sm.Body(box=(0.1, 0.05, 0.05), mass=2.0)
    scene = sm.Scene({"sleeve": body}, {"guide": joint}, "rod", gravity=(0.0, 0.0, -9.81))
    return simulate(scene, until=1.0, kernel=kernel)


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("pin", ENDS)
@pytest.mark.parametrize("kind", SLIDING)
def test_a_short_sleeve_on_a_long_rod_presses_alike_at_both_its_ends_wherever_it_is(kind: str, pin: str, kernel: str) -> None:
    """Each end carries half the weight across the rod, less what friction's moment about the axis's middle moves from one to the
    other: on its surface, at the radius."""
    r = slid(kind, pin, "outboard", kernel)
    across, rate = 2.0 * 9.81 * np.cos(SLOPE), 9.81 * (np.sin(SLOPE) - MU * np.cos(SLOPE))
    assert r["guide.q[1]"][-1] == pytest.approx(rate / 2, rel=1e-9)
    places = (1, 2) if kind == "cylindrical" else (3, 4)
    forces = [r[f"guide.contact[{i}].normal_force"] for i in places]
    assert sum(forces) == pytest.approx(np.full(len(r), across), rel=1e-9)
    moved = MU * across * 0.01 / (2 * HALF)
    assert abs(forces[0] - forces[1])[5:] == pytest.approx(np.full(len(r) - 5, 2 * moved), rel=1e-9)


@pytest.mark.parametrize("kind", SLIDING)
@pytest.mark.parametrize("pin", ENDS)
def test_ends_on_the_pin_are_what_is_meant_where_nothing_is_said(kind: str, pin: str) -> None:
    a, b = (slid(kind, pin, ends, "parts") for ends in (pin, None))
    assert all(np.array_equal(a[n], b[n]) for n in a.names)
