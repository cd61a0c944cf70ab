"""Either part of a sliding joint may have the ends at which the contacts are. The choice does not depend on which part is
inside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.recursion.test_dense_reference import TIME, compared
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from trunnion import sensitivity
from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.plots.geometry.mechanism_geometry import scenery
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

SLIDING = ("prismatic", "cylindrical")
ENDS = ("inboard", "outboard")
SLOPE, MU, HALF = 0.9, 0.2, 0.05


def with_ends(case: Case) -> Case:
    """The case with the ends of every sliding joint on the part that does not carry the pin."""
    other = {"inboard": "outboard", "outboard": "inboard"}
    joints = {n: replace(j, ends=other[j.pin]) if j.type in SLIDING else j for n, j in case.scene.joints.items()}
    return replace(case, scene=replace(case.scene, joints=joints))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(6))
def test_ends_on_the_other_part_are_those_of_one_dense_solve(seed: int) -> None:
    how = {"t": TIME, "friction": 1.0, "types": SLIDING}
    compared(with_ends(random_tree(f"ends{seed}", **how)))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", SLIDING)
def test_ends_of_a_cut_joint_equal_those_of_one_dense_solve(kind: str) -> None:
    how = {"bodies": 3, "closing": (kind,), "cut": True, "friction": 1.0, "laws": ("regularized",), "adams": 0.0}
    case = random_loop(f"ends {kind}", t=TIME, **how)
    assert [j.kind_name for j in build(case.scene).system.cuts] == [kind]
    compared(with_ends(case))


def test_the_part_with_the_ends_does_not_matter_without_travel() -> None:
    made = [
        build(replace(c.scene, joints={n: replace(j, ends=e) for n, j in c.scene.joints.items()})).system
        for c in [random_tree("hinges", types=("revolute",), friction=1.0)]
        for e in (None, *ENDS)
    ]
    assert made[0] == made[1] == made[2]


def slid(kind: str, pin: str, ends: str | None, kernel: str, **lengths: float) -> Result:
    """A short sleeve slides down a long inclined rod of the ground. The mass centre is in the middle of the sleeve."""
    size = {"half_width": 0.01, "half_height": 0.01} if kind == "prismatic" else {"radius": 0.01}
    rub = sm.Friction(mu=MU, **(lengths or {"half_length": HALF}), **size)
    down = (float(np.cos(SLOPE)), 0.0, -float(np.sin(SLOPE)))
    side = sm.Side("ground", axis=down, reference="y")
    joint = sm.Joint(kind, side, "sleeve", axis="x", reference="y", pin=pin, ends=ends, friction=rub)
    body = sm.Body(box=(0.1, 0.05, 0.05), mass=2.0)
    scene = sm.Scene({"sleeve": body}, {"guide": joint}, "rod", gravity=(0.0, 0.0, -9.81))
    return simulate(scene, until=1.0, kernel=kernel)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("pin", ENDS)
@pytest.mark.parametrize("kind", SLIDING)
def test_a_short_sleeve_on_a_long_rod_presses_alike_at_both_its_ends_wherever_it_is(kind: str, pin: str, kernel: str) -> None:
    """Each end carries half of the weight component across the rod. Friction acts on the rod's surface. The moment of friction
    moves part of the load from one end to the other end."""
    r = slid(kind, pin, "outboard", kernel)
    across, rate = 2.0 * 9.81 * np.cos(SLOPE), 9.81 * (np.sin(SLOPE) - MU * np.cos(SLOPE))
    assert r["guide.q[1]"][-1] == pytest.approx(rate / 2, rel=1e-9)
    places = (1, 2) if kind == "cylindrical" else (3, 4)
    forces = [r[f"guide.contact[{i}].normal_force"] for i in places]
    assert sum(forces) == pytest.approx(np.full(len(r), across), rel=1e-9)
    moved = MU * across * 0.01 / (2 * HALF)
    assert abs(forces[0] - forces[1])[5:] == pytest.approx(np.full(len(r) - 5, 2 * moved), rel=1e-9)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("kind", SLIDING)
@pytest.mark.parametrize("pin", ENDS)
def test_the_ends_are_on_the_pin_by_default(kind: str, pin: str) -> None:
    a, b = (slid(kind, pin, ends, "parts") for ends in (pin, None))
    assert all(np.array_equal(a[n], b[n]) for n in a.names)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("pin", ENDS)
@pytest.mark.parametrize("kind", SLIDING)
def test_contacts_within_a_long_part_are_at_the_ends_of_the_short_part(kind: str, pin: str, kernel: str) -> None:
    for short in ENDS:
        lengths = {f"{part}_length": 2 * HALF if part == short else 20.0 for part in ENDS}
        a, b = slid(kind, pin, OVERLAP, kernel, **lengths), slid(kind, pin, short, kernel)
        assert [e.kind for e in a.events] == [e.kind for e in b.events]
        for n in (n for n in b.names if ".q" in n or "normal_force" in n or "reaction" in n):
            assert np.abs(a[n] - b[n]).max() <= 1e-8 * max(1.0, np.abs(b[n]).max()), n


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_two_parts_that_slide_apart_press_at_the_ends_of_what_is_left(kernel: str) -> None:
    """A drawer is pulled out against its weight. Forces follow from the lever of the remaining overlap. The run ends with a named
    outcome when the drawer has slid out."""
    drawer = sm.Body(box=(0.4, 0.3, 0.1), mass=2.0)
    rub = sm.Friction(mu=0.0, half_width=0.01, half_height=0.01, inboard_length=0.5, outboard_length=0.4)
    rail = sm.Joint("prismatic", "ground", "drawer", axis="x", ends=OVERLAP, friction=rub, start=sm.Start(qd=0.2))
    r = simulate(sm.Scene({"drawer": drawer}, {"rail": rail}, "drawer", gravity=(0.0, 0.0, -9.81)), until=5.0, kernel=kernel)
    assert (r.outcome.name, r.outcome.joint) == ("overlap_lost", "rail")
    assert r.outcome.time == pytest.approx(0.45 / 0.2, abs=1e-4)
    q = r["rail.q[1]"]
    left, right = np.maximum(-0.25, q - 0.2), np.minimum(0.25, q + 0.2)
    middle, half = (left + right) / 2, (right - left) / 2
    some = half > 1e-3
    weight, lever = 2.0 * 9.81, q - middle
    for number, sign in ((3, -1), (4, 1)):
        expected = weight * (0.5 + sign * lever / (2 * half))
        assert r[f"rail.contact[{number}].normal_force"][some] == pytest.approx(np.abs(expected)[some], rel=1e-9)


def overlapping(case: Case, seed: int) -> Case:
    """The case in which the parts of every sliding joint have finite lengths and overlap."""
    rng, joints = np.random.default_rng(seed), {}
    for n, j in case.scene.joints.items():
        if j.type in SLIDING and j.friction is not None:
            away = abs(float(case.q[n][0]))
            both = {f"{part}_length": float(2 * away + rng.uniform(0.8, 1.6)) for part in ENDS}
            j = replace(j, ends=OVERLAP, friction=replace(j.friction, half_length=None, **both))
        joints[n] = j
    return replace(case, scene=replace(case.scene, joints=joints))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_overlaps_are_those_of_one_dense_solve(seed: int) -> None:
    how = {"t": TIME, "friction": 1.0, "types": SLIDING}
    compared(overlapping(random_tree(f"ends{seed}", **how), seed))


def test_an_overlap_in_a_joint_that_is_cut_is_that_of_one_dense_solve() -> None:
    how = {"bodies": 3, "closing": ("cylindrical",), "cut": True, "friction": 1.0, "laws": ("regularized",), "adams": 0.0}
    compared(overlapping(random_loop("ends cylindrical", t=TIME, **how), 0))


def test_contacts_of_an_overlap_are_drawn_where_it_ends() -> None:
    r = slid("cylindrical", "inboard", OVERLAP, "parts", inboard_length=0.5, outboard_length=0.4)
    marks = next(j for j in scenery(r.scene).joints if j.name == "guide").contacts
    first, second = (m.bases(r) for m in marks)
    assert np.linalg.norm(second - first, axis=1) == pytest.approx(np.minimum(0.4, 0.45 - r["guide.q[1]"]), abs=1e-12)


def test_derivatives_know_how_an_overlap_changes() -> None:
    scene = slid("prismatic", "inboard", OVERLAP, "parts", inboard_length=0.5, outboard_length=0.4).scene
    path, column, h = "joints.guide.friction.inboard_length", "guide.contact[4].normal_force", 1e-6
    s = sensitivity(scene, [path], [column], until=0.3, rtol=1e-10)
    a, b = (simulate(scene, until=0.3, rtol=1e-10, overrides={path: 0.5 + x})[column][-1] for x in (-h, h))
    assert s.derivatives[-1, 0, 0] == pytest.approx((b - a) / (2 * h), rel=1e-5)
