"""Rods: the distance of two points equals the rod's length, and the rod's force acts along the line between the points."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.engine.mechanisms.rod_ladder import DOWN, LENGTH, MASS, ladder, tension
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.recursion.test_dense_reference import compared
from tests.reference import solve
from tests.reference.scenes.random_scenes import Case, random_loop
from trunnion import Scene, SceneError, hold, scene_from_dict, sensitivity, simulate, sweep
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text

G = 9.81
LAWS = ("regularized", "viscous", "coulomb")
RIGID, ALONG = 1e-9, 1e-8


def random_rods(seed: int, rods: int, **how) -> Case:
    """A random tree whose bodies are joined by rods, at a consistent state."""
    return random_loop(f"rods{seed}", loops=rods, t=0.3, closing=("rod",), **how)


def hung(masses: list[float], lengths: list[float], angles: list[float], rates: list[float], spread: float = 0.1) -> Scene:
    """Point masses in the plane x, y that hang on each other by rods. Angles are from the downward vertical. (Each body has a free
    joint, and no load turns its inertia.)"""
    p, v = np.zeros(3), np.zeros(3)
    bodies, joints, end = {}, {}, "ground"
    for i, (m, length, a, w) in enumerate(zip(masses, lengths, angles, rates, strict=True)):
        p = p + length * np.array([math.sin(a), -math.cos(a), 0.0])
        v = v + length * w * np.array([math.cos(a), math.sin(a), 0.0])
        bodies[f"m{i}"] = {"mass": m, "inertia": [spread] * 3}
        start = {"q": [*p, 1, 0, 0, 0], "qd": [*v, 0, 0, 0]}
        joints[f"fly{i}"] = {"type": "free", "inboard": "ground", "outboard": f"m{i}", "start": start}
        joints[f"rod{i}"] = {"type": "rod", "inboard": end, "outboard": f"m{i}", "length": length}
        end = f"m{i}"
    return scene_from_dict({"gravity": [0, -G, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1, "every": 0.05}})


def test_the_tension_of_a_pendulum_is_its_weight_along_the_rod_and_what_turns_it() -> None:
    m, length = 2.0, 0.7
    r = simulate(hung([m], [length], [1.2], [2.0]), rtol=1e-10)
    x, y = r["m0.position[1]"], r["m0.position[2]"]
    speed = r["m0.velocity[1]"] ** 2 + r["m0.velocity[2]"] ** 2
    assert np.hypot(x, y) == pytest.approx(length, rel=1e-12)
    assert r["rod0.axial_force"] == pytest.approx(m * G * -y / length + m * speed / length, rel=1e-10)
    assert 0.5 * speed + G * y == pytest.approx(0.5 * speed[0] + G * y[0], rel=1e-9)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(12))
def test_two_masses_on_two_rods_are_the_double_pendulum(seed: int) -> None:
    """The reference consists of Lagrange's equations in the two angles. Tensions follow from the balance of each mass."""
    rng = np.random.default_rng(seed)
    (m1, m2), (l1, l2), (a, b), (v, w) = (rng.uniform(*x, 2) for x in ((0.5, 3), (0.3, 1), (-2, 2), (-4, 4)))
    r = simulate(hung([m1, m2], [l1, l2], [a, b], [v, w]), until=0.3, every=0.1, rtol=1e-9)
    for i in range(len(r)):
        p1, p2, v1, v2, a1, a2 = (np.array([r[f"m{k}.{q}[{c}]"][i] for c in (1, 2)])
                                  for q in ("position", "velocity", "acceleration") for k in (0, 1))  # fmt: skip
        s, u = p2 - p1, v2 - v1
        a, b = math.atan2(p1[0], -p1[1]), math.atan2(s[0], -s[1])
        v, w = v1 @ [math.cos(a), math.sin(a)] / l1, u @ [math.cos(b), math.sin(b)] / l2
        c, d = math.cos(a - b), math.sin(a - b)
        M = [[(m1 + m2) * l1, m2 * l2 * c], [l1 * c, l2]]
        alpha, beta = np.linalg.solve(M, [-m2 * l2 * w * w * d - (m1 + m2) * G * math.sin(a), l1 * v * v * d - G * math.sin(b)])
        along = np.array([[math.sin(x), -math.cos(x)] for x in (a, b)])
        across = np.array([[math.cos(x), math.sin(x)] for x in (a, b)])
        e1 = l1 * (alpha * across[0] - v * v * along[0])
        e2 = e1 + l2 * (beta * across[1] - w * w * along[1])
        down = np.array([0, -G])
        second = m2 * (down - e2) @ along[1]
        first = (m1 * (down - e1) + second * along[1]) @ along[0]
        assert np.concatenate([a1, a2]) == pytest.approx(np.concatenate([e1, e2]), rel=1e-8, abs=1e-8)
        assert [r["rod0.axial_force"][i], r["rod1.axial_force"][i]] == pytest.approx([first, second], rel=1e-8, abs=1e-8)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(100))
def test_mechanisms_with_rods_move_and_press_as_one_dense_solve_says(seed: int) -> None:
    """Accelerations, reactions and friction agree to 1e-10. The axial force is compared with the reference's force on the inboard
    part."""
    case = random_rods(seed, 1 + seed % 3)
    row = compared(case)
    state = case.state()
    reaction = solve(state).reaction
    for n in (n for n, j in case.scene.joints.items() if j.type == "rod"):
        pose = state.joint_pose(n)
        along = pose.s / np.linalg.norm(pose.s)
        assert row[f"{n}.axial_force"] == pytest.approx(reaction[n][0] @ along, rel=1e-9, abs=1e-9)


def as_bodies(case: Case) -> Scene:
    """The case with a massless body in place of each rod, between a universal joint and a ball. (Between two balls, the body could
    spin about its own line.)"""
    scene, state = case.scene, case.state()
    bodies, joints = dict(scene.bodies), {}
    for name, j in scene.joints.items():
        if j.type != "rod":
            joints[name] = j
            continue
        along = state.joint_pose(name).s
        # the components of `along` are in the axes of the inboard body, because a rod's side without an axis has the body's frame
        e3 = along / np.linalg.norm(along)
        e1 = np.cross(e3, np.eye(3)[np.argmin(np.abs(e3))])
        e2 = np.cross(e3, e1)
        near = replace(j.inboard, axis=tuple(map(float, e1)), reference=tuple(map(float, e2)))
        bodies[f"{name}_link"] = sm.Body(mass=0.0, inertia=(0.0, 0.0, 0.0), points={"far": (0.0, 0.0, j.length)})
        joints[f"{name}_near"] = sm.Joint("universal", near, f"{name}_link", axis="x", reference="y", start=sm.Start(q=(0.0, 0.0)))
        joints[name] = sm.Joint("spherical", f"{name}_link.far", j.outboard, cut=True)
    return replace(scene, bodies=bodies, joints=joints)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(100))
def test_a_rod_is_a_body_without_mass_between_two_balls(seed: int) -> None:
    """The two scenes agree at the start to 1e-9, and along a run to a hundred times the tolerance of the run."""
    case = random_rods(seed, 1 + seed % 3, friction=0.4, laws=LAWS, drives=0.0)
    places = [f"{b}.{q}*" for b in case.scene.bodies for q in ("position", "acceleration")]
    names = [n for n, j in case.scene.joints.items() if j.type == "rod"]
    rod = simulate(case.scene, outputs=[*places, "*.axial_force"], until=0.1, every=0.05, rtol=1e-10)
    body = simulate(as_bodies(case), outputs=[*places, *(f"{n}.reaction.force*" for n in names)], until=0.1, every=0.05, rtol=1e-10)
    assert rod.outcome.name == body.outcome.name
    for c in rod.columns:
        if not c.name.endswith(".axial_force"):
            size = max(1.0, np.abs(rod[c.name]).max())
            assert body[c.name][0] == pytest.approx(rod[c.name][0], abs=RIGID * size), c.name
            assert body[c.name] == pytest.approx(rod[c.name], abs=ALONG * size), c.name
    for n in names:
        size = np.linalg.norm([body[f"{n}.reaction.force[{k}]"] for k in (1, 2, 3)], axis=0)
        assert size == pytest.approx(np.abs(rod[f"{n}.axial_force"]), rel=ALONG, abs=ALONG)
        assert size[0] == pytest.approx(abs(rod[f"{n}.axial_force"][0]), rel=RIGID, abs=RIGID)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(8))
def test_both_kernels_write_the_same_with_rods(seed: int) -> None:
    agree(random_rods(seed, 1 + seed % 3, friction=0.5, laws=("coulomb", "lugre")).scene, redundant=seed % 2 == 1)


@pytest.mark.parametrize(("kernel", "placed"), [("parts", True), ("compiled", False)])
def test_friction_of_a_guide_feels_the_force_of_a_rod(kernel: str, placed: bool) -> None:
    r = simulate(ladder(placed=placed), rtol=1e-10, kernel=kernel)
    T = tension(r.time, 0.3)
    y = LENGTH * math.sin(0.9) - DOWN * r.time
    assert r["r0.axial_force"] == pytest.approx(T, rel=1e-9)
    assert np.abs(r["guide.friction.force"]) == pytest.approx(0.3 * T * y / LENGTH, rel=1e-9)


@pytest.mark.parametrize(("mu", "stiff"), [(0.0, 1.0), (0.3, 1.0), (0.3, 3.0)])
def test_two_rods_side_by_side_share_their_force_by_their_stiffness(mu: float, stiff: float) -> None:
    """The motion equals the motion with one rod. The result states that the single forces are not unique."""
    scene = ladder(mu, rods=2)
    joints = scene.joints | {"r0": replace(scene.joints["r0"], stiffness=stiff * 1e8)}
    r = simulate(replace(scene, joints=joints), rtol=1e-10)
    assert r.redundancy.joints == ("r0", "r1")
    for k, share in enumerate((stiff / (1 + stiff), 1 / (1 + stiff))):
        assert r[f"r{k}.axial_force"] == pytest.approx(tension(r.time, mu) * share, rel=1e-9)


def test_derivatives_by_a_rods_length_are_those_of_the_closed_form() -> None:
    found = sensitivity(ladder(), ("joints.r0.length", "joints.guide.friction.mu"), ("r0.axial_force",), rtol=1e-10)
    h = 1e-5
    by_length = (tension(found.time, 0.3, LENGTH + h) - tension(found.time, 0.3, LENGTH - h)) / (2 * h)
    by_mu = (tension(found.time, 0.3 + h) - tension(found.time, 0.3 - h)) / (2 * h)
    assert found.d("r0.axial_force", "joints.r0.length") == pytest.approx(by_length, rel=1e-6)
    assert found.d("r0.axial_force", "joints.guide.friction.mu") == pytest.approx(by_mu, rel=1e-6)


def test_a_sweep_over_the_length_of_a_rod_is_its_closed_form() -> None:
    lengths = [0.45, 0.5, 0.55]
    s = sweep(ladder(), {"joints.r0.length": lengths}, reductions=["final:r0.axial_force"], rtol=1e-10)
    assert s.counts == {"done": 3}
    expected = [float(tension(np.array([0.4]), 0.3, x)[0]) for x in lengths]
    assert list(s.to_pandas()["final:r0.axial_force"]) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(("mu", "holds"), [(0.31, True), (0.29, False)])
def test_a_ladder_holds_by_the_friction_of_its_foot(mu: float, holds: bool) -> None:
    """A mass m slides down a wall. A rod leans the mass on a foot of mass M on a rough floor: m cot φ = μ (m + M) at the limit."""
    scene = ladder(mu)
    joints = dict(scene.joints)
    x, y = LENGTH * math.cos(0.9), LENGTH * math.sin(0.9)
    joints["wall"] = replace(joints["wall"], drive=None, start=sm.Start(q=y))
    limit = 0.3
    top = replace(scene.bodies["top"], mass=limit * MASS / (x / y - limit))
    report = hold(replace(scene, gravity=(0.0, -G, 0.0), bodies=scene.bodies | {"top": top}, joints=joints))
    assert report.holds is holds
    assert report.pairs[0].share == pytest.approx(limit / mu, rel=1e-9)


def test_points_that_cannot_have_the_distance_of_a_rod_are_reported_with_its_name() -> None:
    scene = hung([1.0], [0.7], [1.2], [0.0])
    short = replace(scene, joints=scene.joints | {"far": replace(scene.joints["rod0"], inboard=sm.Side("ground", (3.0, 0.0, 0.0)))})
    r = simulate(short, until=0.1)
    assert (r.outcome.name, r.outcome.joint) == ("open_loop", "far")


GOOD = "{type: rod, inboard: ground.a, outboard: m, length: 1 m}"
WRONG = {
    "the length of a rod between bodies without position is missing": GOOD.replace(", length: 1 m", ""),
    "length must be positive": GOOD.replace("1 m", "0 m"),
    "a revolute joint has no length": GOOD.replace("rod", "revolute"),
    "the ends of a rod are ideal": GOOD.replace("length", "friction: {mu: 0.1}, length"),
    "a rod has no damping of its own: points move on other joints": GOOD.replace("length", "damping: 1, length"),
    "a rod has no start of its own": GOOD.replace("length", "start: {q: 1}, length"),
    "the two parts of a rod do not meet in one place": GOOD.replace("length", "at: [0, 0, 0], length"),
    "neither of two points carries a pin": GOOD.replace("length", "pin: outboard, length"),
    "the two points coincide: the rod has the length 0": "{type: rod, inboard: ground, outboard: placed}",
    "there is no body": GOOD.replace("outboard: m", "outboard: n").replace(", length: 1 m", ""),
}  # fmt: skip


@pytest.mark.parametrize("says", WRONG)
def test_impossible_rods_are_refused_with_the_reason(says: str) -> None:
    bodies = "  m: {mass: 1, inertia: [1, 1, 1]}\n  placed: {mass: 1, inertia: [1, 1, 1], position: [0, 0, 0]}\n"
    flies = "".join(f"  {n}_flies: {{type: free, inboard: ground, outboard: {n}}}\n" for n in ("m", "placed"))
    ground = "ground: {points: {a: [0, 0, 0]}}\n"
    with pytest.raises(SceneError, match=re.escape(says)):
        scene_from_text(f"schema: 1\n{ground}bodies:\n{bodies}joints:\n{flies}  r: {WRONG[says]}\n")


def test_the_ladder_of_the_guide_agrees_with_hand_calculation() -> None:
    page = (Path(trunnion.__file__).parent / "docs/guide/scene.md").read_text(encoding="utf-8")
    scene = scene_from_text(page.split("```yaml\n")[1].split("```")[0])
    assert scene.name == "ladder"
    assert hold(scene).pairs[0].share == pytest.approx(0.3125 / 0.32, rel=1e-12)
    assert simulate(scene, until=0.1, every=0.1)["ladder.axial_force"] == pytest.approx(-3 * G * 2.6 / 2.4, rel=1e-9)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("as_rod", [True, False])
def test_a_rubbing_loop_jams_by_every_kernel_with_a_rod_or_a_body(as_rod: bool, kernel: str) -> None:
    """A pair at rest holds the freedom of the pair that jams. Drives move the other joints."""
    case = random_loop("long7", loops=2, t=0.0, closing=("rod",), friction=0.9, laws=("coulomb",), adams=0.0, drives=0.3)
    r = simulate(case.scene if as_rod else as_bodies(case), until=0.5, rtol=1e-7, kernel=kernel, max_steps=300)
    assert (r.outcome.name, r.outcome.joint) == ("jammed", "j3")
    assert r.outcome.time == pytest.approx(0.48002707, abs=1e-7)
