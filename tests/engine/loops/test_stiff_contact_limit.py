"""Where loops leave reactions undetermined and joints have friction, the contact forces are the limit of the forces of stiff
contacts.
The references are a model with springs and friction in place of joint rows (``reference.compliant``), and hand statics of doors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.default_case_selection import sampled
from tests.engine.checks.reference_comparison import engine_row, engine_table, take, worst
from tests.reference import forward
from tests.reference.contact_and_friction.stiff_spring_contacts import Compliant
from tests.reference.scenes.frame_changes import rotated
from tests.reference.scenes.random_scenes import Case
from tests.reference.scenes.random_streams import stream
from trunnion.scene.data_classes import scene as sm

FAMILIES = {
    "door": ("revolute", "revolute"),
    "three hinges": ("revolute", "revolute", "revolute"),
    "hinge and ball": ("revolute", "spherical"),
    "shaft in bearings": ("revolute", "cylindrical", "cylindrical"),
    "carriage on rails": ("prismatic", "prismatic"),
    "two crosses": ("universal", "universal"),
}
LIMIT = 1e-9
"""Required agreement, relative to the largest load: round-off times the condition of the springs."""


def _rub(rng: np.random.Generator, kind: str, faced: bool) -> sm.Friction:
    """Contacts of a joint with random numbers. ``faced``: with a thrust face, if the type has a thrust face."""
    sizes = {"radius": rng.uniform(0.005, 0.03), "mu": rng.uniform(0.05, 0.6), "law": "coulomb"}
    if kind != "spherical":
        sizes["half_length"] = rng.uniform(0.02, 0.08)
    if kind == "universal":
        sizes |= {"radius": tuple(rng.uniform(0.005, 0.03, 2)), "half_length": tuple(rng.uniform(0.02, 0.08, 2))}
    if kind == "prismatic":  # the sleeve is long enough not to wedge
        sizes |= {"mu": rng.uniform(0.05, 0.3), "half_length": rng.uniform(0.15, 0.3)}
        sizes |= {"half_width": rng.uniform(0.01, 0.03), "half_height": rng.uniform(0.01, 0.03)}
        del sizes["radius"]
    if kind == "revolute" and faced:
        sizes["thrust_radius"] = 0.01
    return sm.Friction(**sizes)


def _carried(seed: int, family: str) -> Case:
    """Several joints on one axis carry a body: a door on its hinges, a carriage on two rails, a shaft in bearings. Every seed gives
    other numbers. Pins and thrust faces have only two sets of places, so that cases share kernels."""
    kinds, rng, made = FAMILIES[family], stream(seed, family, "stiff"), stream(seed % 2, family, "made")
    rate = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.0))
    rails, crosses = "prismatic" in kinds, "universal" in kinds
    along = np.cumsum(rng.uniform(0.2, 1.0, len(kinds)))
    where = [np.array([0.0, 0.3 * i, 0.1 * i]) if rails else np.array([0.0, 0.0, 0.0 if crosses else s])
             for i, s in enumerate(along)]  # fmt: skip
    body = sm.Body(mass=rng.uniform(5, 30), center=tuple(rng.uniform(-0.3, 0.6, 3)), inertia=(2.0, 2.5, 1.8, 0.1, -0.2, 0.05))
    joints, q, qd = {}, {}, {}
    for i, (kind, at) in enumerate(zip(kinds, where, strict=True)):
        name = f"j{i}"
        axis = {} if kind == "spherical" else {"axis": "x" if rails else "z"}
        joints[name] = sm.Joint(
            type=kind, inboard=sm.Side("ground", tuple(at)), outboard=sm.Side("body", tuple(at)),
            pin=str(made.choice(["inboard", "outboard"])), friction=_rub(rng, kind, bool(made.random() < 0.5)), **axis,
        )  # fmt: skip
        angle = 0.3
        turned = {"spherical": np.r_[np.cos(angle / 2), 0, 0, np.sin(angle / 2)], "cylindrical": np.array([0.0, angle])}
        q[name] = (turned | {"universal": np.array([angle, -0.4])}).get(kind, np.array([0.0 if rails else angle]))
        rates = {"spherical": np.array([0, 0, rate]), "cylindrical": np.array([0.0, rate])}
        qd[name] = (rates | {"universal": np.array([rate, -0.7 * rate])}).get(kind, np.array([rate]))
    scene = sm.Scene({"body": body}, joints, "carried", gravity=tuple(rng.uniform(-8, 8, 3)))
    return Case(scene, q, qd, 0.0, ("j0",))


def _stiffened(case: Case, rng: np.random.Generator, every: bool) -> Case:
    """The case with contacts of unequal stiffness. Unless ``every`` is true, the first joint gives no stiffness."""
    joints = {
        n: replace(j, stiffness=float(10 ** rng.uniform(7, 9)) if every or i else None)
        for i, (n, j) in enumerate(case.scene.joints.items())
    }
    return replace(case, scene=replace(case.scene, joints=joints))


GIVEN = [(family, *g) for family in FAMILIES for g in (("no stiffness",), ("every stiffness",), ("all but one",))]
SOME_GIVEN = [g for k, g in enumerate(GIVEN) if k % 3 == 0 or k % 3 == 1 + k // 3 % 2]
"""Every family without stiffness, and with stiffness of all its joints or of all but one; every third of these cases."""


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("family", "given"), sampled(GIVEN, lambda g: g in SOME_GIVEN))
def test_sliding_contacts_that_loops_leave_open_are_the_limit_of_stiff_ones(family: str, given: str) -> None:
    for seed in range(4) if given == "no stiffness" else (0, 2):
        case = _carried(seed, family)
        case = case if given == "no stiffness" else _stiffened(case, stream(seed, family, given), given == "every stiffness")
        _, mine = engine_row(case, ("*.normal_force", "body.acceleration*"))
        model = Compliant(forward(case.scene, {"j0": case.q["j0"]}, case.qd, 0.0))
        acceleration, _ = model.solve()
        largest = max(max(f) for f in model.normal_force.values())
        assert model.residual <= LIMIT
        for name in case.scene.joints:
            contacts = np.array([v for k, v in mine.items() if k.startswith(f"{name}.contact[")])
            expected = model.normal_force[name]
            assert len(contacts) >= 1
            assert np.abs(contacts - expected[: len(contacts)]).max() <= LIMIT * largest, (seed, name)
        got = take(mine, "body.acceleration")
        assert got == pytest.approx(acceleration[:3], rel=LIMIT, abs=LIMIT * np.abs(acceleration).max())


def test_only_ratios_of_stiffness_count_and_the_default_is_a_hundred_newtons_a_micrometre() -> None:
    case = _carried(0, "door")

    def told(first: float | None, second: float | None) -> dict:
        joints = {n: replace(j, stiffness=k) for (n, j), k in zip(case.scene.joints.items(), (first, second), strict=True)}
        return engine_table(replace(case, scene=replace(case.scene, joints=joints)))

    plain, unequal = told(None, None), told(1e8, 7e8)
    assert worst(plain, told(3e6, 3e6))[0] <= LIMIT
    assert worst(unequal, told(None, 7e8))[0] <= LIMIT
    assert worst(unequal, told(2e5, 14e5))[0] <= LIMIT
    assert worst(plain, unequal)[0] > 1e-3  # the stiffness has an effect


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("family", FAMILIES)
def test_joints_on_one_axis_share_their_load_alike_in_axes_that_are_not_the_worlds(family: str) -> None:
    """On oblique axes, the rows that close the loop hold only round-off. No rank must be derived from round-off."""
    case = _carried(0, family)
    moved = rotated(case, len(family))
    gap, where = worst(engine_table(case), moved.back(engine_table(moved.case)))
    assert gap <= LIMIT, where


HINGES = [f for f, kinds in FAMILIES.items() if set(kinds) == {"revolute"}]
SLOW = 1e-12
"""Rate of a hinge that is about to slip, rad/s: it chooses the sense of friction, and its centripetal force is round-off."""
ROOT = 1e-13
"""Tolerance of the part of the friction that holds, which is at most 1; its error is far below LIMIT."""


def _hung(seed: int, family: str) -> Case:
    """A door at rest without thrust faces, under a lateral pull that its hinges can hold. If all hinges have one friction angle,
    friction has the same proportions for every part of it that the hinges need."""
    case, rng = _carried(seed, family), stream(seed, family, "rest")
    mu = float(rng.uniform(0.3, 0.9))
    joints = {n: replace(j, friction=replace(j.friction, mu=mu, thrust_radius=None)) for n, j in case.scene.joints.items()}
    body = replace(case.scene.bodies["body"], center=(0.6, *case.scene.bodies["body"].center[1:]))
    pull = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.06))
    scene = replace(case.scene, bodies={"body": body}, joints=joints, gravity=(0.0, pull, -9.81))
    q = {n: np.zeros_like(v) for n, v in case.q.items()}
    return replace(case, scene=scene, q=q, qd={n: np.zeros_like(v) for n, v in case.qd.items()})


def _about_to_slip(case: Case, part: float) -> tuple[Compliant, float]:
    """The model of springs, and its angular acceleration. The hinges need the given part of the sine of their friction angle."""
    def rubbing(friction: sm.Friction) -> sm.Friction:
        return replace(friction, mu=math.tan(math.asin(abs(part) * math.sin(math.atan(friction.mu)))))

    joints = {n: replace(j, friction=rubbing(j.friction)) for n, j in case.scene.joints.items()}
    rates = {n: np.full_like(v, math.copysign(SLOW, part)) for n, v in case.qd.items()}
    model = Compliant(forward(replace(case.scene, joints=joints), {"j0": case.q["j0"]}, rates, 0.0))
    return model, float(model.solve()[0][5])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(6), 2))
@pytest.mark.parametrize("family", HINGES)
def test_contacts_at_rest_press_as_those_of_a_mechanism_that_needs_the_same_friction_to_slide(family: str, seed: int) -> None:
    """The friction of a pair at rest also turns the normal of the pair. Therefore loads do not jump when the pair begins to
    slip."""
    case = _hung(seed, family)
    part = brentq(lambda x: _about_to_slip(case, x)[1], -1.0, 1.0, xtol=ROOT)
    model, _ = _about_to_slip(case, part)
    assert 0.02 < abs(part) < 0.98
    assert model.residual <= LIMIT
    _, mine = engine_row(case, ("*.normal_force", "body.acceleration*"))
    assert np.abs(take(mine, "body.acceleration")).max() <= LIMIT
    largest = max(max(f) for f in model.normal_force.values())
    for name in case.scene.joints:
        contacts = np.array([v for k, v in mine.items() if k.startswith(f"{name}.contact[")])
        assert np.abs(contacts - model.normal_force[name][: len(contacts)]).max() <= 10 * LIMIT * largest
