"""Loops with bodies of small mass or without mass. As the mass falls, the motion converges in first order to the motion with mass
0. The steps stay the same for every cut of the loop. The loop equations alone would lose as many digits as the mass ratio has."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.default_case_selection import sampled
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.reference.scenes.random_device_scenes import FAMILIES, crossed
from tests.reference.scenes.random_scenes import random_loop
from trunnion import Scene, SceneError, scene_from_dict, simulate
from trunnion.system.construction.spanning_tree import span, span_without_masses
from trunnion.system.construction.system_builder import build

INERTIAS = (1e-3, 1e-6, 1e-8, 1e-12, 0.0)
"""Inertias of the middle wheel, kg m²; the other wheels have 1 and 1.5 kg m²."""
RATIOS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
"""Masses of a light body, relative to the body's own mass."""
SEEDS = (0, 3, 8, 11, 15, 16, 18)
"""Seeds of random loops that determine the motion of their lightened body."""


def shafts(inertia: float) -> Scene:
    """Three shafts with wheels in mesh. The middle wheel has the given inertia, and the mesh loses half of the power. The bearing
    and the teeth slip together as the motor's torque falls. Hand calculation: (1.1875 + J/2) dω/dt = 1.3 − t from t = 1.3 s on."""
    bodies = {n: {"mass": 1, "inertia": [j] * 3} for n, j in (("a", 1.0), ("mid", inertia), ("b", 1.5))}
    ground = {"m": [0, 4, 0], "b": [0, 8, 0]}
    motor = {"ramp": {"start": 3, "end": 1, "duration": 2}}
    rubs = {"mu": 8.48826363156775, "pressure_angle": 0.3}
    joints: dict[str, Any] = {
        "left": {"type": "revolute", "inboard": "ground", "outboard": "a", "friction": {"torque": 0.5}, "effort": motor},
        "middle": {"type": "revolute", "inboard": "ground.m", "outboard": "mid"},
        "right": {"type": "revolute", "inboard": "ground.b", "outboard": "b", "mimic": {"joint": "middle", "ratio": -0.5},
                  "effort": -8.8},
        "mesh": {"type": "gear", "inboard": "a", "outboard": "mid", "teeth": [40, 40], "module": 0.1, "friction": rubs},
    }  # fmt: skip
    joints = {n: {"axis": "x"} | j for n, j in joints.items()}
    return scene_from_dict({"gravity": [0, 0, 0], "ground": {"points": ground}, "bodies": bodies, "joints": joints,
                            "simulation": {"until": 2}})  # fmt: skip


CASES = [(inertia, method) for inertia in INERTIAS for method in ("auto", "rk5", "rk8", "rosenbrock")]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("inertia", "method"), sampled(CASES, lambda c: CASES.index(c) % 5 in (0, 3)))
def test_two_pairs_let_go_together_beside_a_wheel_of_any_inertia(inertia: float, method: str) -> None:
    for kernel in ("parts", "compiled"):
        r = simulate(shafts(inertia), method=method, kernel=kernel)
        assert r.outcome.ok
        assert r["left.qd[1]"][-1] == pytest.approx(-0.5 * 0.7**2 / (1.1875 + inertia / 2), rel=1e-9)
        assert r.stats.steps <= 40


def _times(inertia: Any, ratio: float) -> Any:
    if inertia is None or isinstance(inertia, tuple):
        return inertia and tuple(x * ratio for x in inertia)
    return replace(inertia, axial=inertia.axial * ratio)


def lightened(scene: Scene, body: str, ratio: float) -> Scene:
    """The scene with a body's mass and inertia times a ratio."""
    b = scene.bodies[body]
    inertia = _times(b.inertia, ratio)
    mass, density = (None if x is None else x * ratio for x in (b.mass, b.density))
    return replace(scene, bodies=scene.bodies | {body: replace(b, mass=mass, density=density, inertia=inertia)})


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", SEEDS)
def test_the_motion_converges_in_first_order_and_in_the_same_steps(seed: int) -> None:
    scene = random_loop(seed, laws=("coulomb",)).scene
    body = list(scene.bodies)[np.random.default_rng(seed).integers(len(scene.bodies))]
    places = [f"{b}.position*" for b in scene.bodies]
    runs = [simulate(lightened(scene, body, x), until=0.3, rtol=1e-8, outputs=places) for x in RATIOS]
    assert all(r.outcome.ok for r in runs)
    ends = [np.array([r[n][-1] for n in sorted(c.name for c in r.columns if "position" in c.name)]) for r in runs]
    size = max(1.0, np.abs(ends[-1]).max())
    changes = [np.abs(a - b).max() / size for a, b in pairwise(ends)]
    for ratio, change in zip(RATIOS, changes, strict=False):
        assert change <= 2e2 * ratio + FLOOR, (seed, ratio, changes)
    steps = [r.stats.steps for r in runs]
    assert max(steps) <= 1.5 * min(steps)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("family", "body"), [("drives_that_die", "l2"), ("belts", "p2")])
def test_a_light_body_with_a_heavy_wheel_on_its_axis_moves_like_one_without_mass(family: str, body: str) -> None:
    """The heavy wheel does not change the inertia of the body that carries the wheel."""
    scene = crossed(family, 0)
    runs = [simulate(heavy_parts(scene, body, x), rtol=1e-8) for x in (1e-5, 1e-9, 0.0)]
    assert [r.outcome.name for r in runs] == ["done"] * 3
    turned = [np.array([r[c.name][-1] for c in r.columns if ".q[" in c.name]) for r in runs]
    assert np.abs(turned[0] - turned[2]).max() <= 1e-4
    assert np.abs(turned[1] - turned[2]).max() <= 1e-6
    steps = [r.stats.steps for r in runs]
    assert max(steps) <= 1.5 * min(steps)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("family", "seed", "body"), [
    ("five_bars", 101, "l0"), ("freewheels_in_four_bars", 101, "l2"), ("ratchets_in_loops", 100, "l1"),
    ("ratchets_in_loops", 101, "l2"), ("started_linkages", 100, "l2"), ("grippers", 101, "link_a"),
    ("bevel_differentials", 103, "p1"),
])  # fmt: skip
def test_loads_that_redundant_loops_share_do_not_jump_where_a_mass_reaches_0(family: str, seed: int, body: str) -> None:
    """Joints without friction have contacts by geometry. Otherwise, the size of these contacts would follow from the inertia, and
    motions would differ by 1e-6 to 2e-3."""
    scene = crossed(family, seed)
    runs = [simulate(heavy_parts(scene, body, x), until=0.4, every=0.1, rtol=1e-9, outputs="*.position*") for x in (1e-9, 0.0)]
    assert [r.outcome.name for r in runs] == ["done"] * 2
    places = [c.name for c in runs[0].columns if "position" in c.name]
    assert max(float(np.abs(runs[0][n] - runs[1][n]).max()) for n in places) <= 1e-8


def heavy_parts(scene: Scene, body: str, ratio: float) -> Scene:
    """The scene in which one body has this part of the heaviest mass; its inertia is reduced in proportion."""
    heaviest = max(b.mass or 0.0 for b in scene.bodies.values())
    return lightened(scene, body, ratio * heaviest / (scene.bodies[body].mass or 1.0))


LIGHT = (1e-3, 1e-7, 1e-9, 1e-12, 0.0)
"""Masses of one body of a crossed scene, relative to the heaviest body."""


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_scenes_of_interacting_devices_converge_as_a_body_gets_lighter(family: str) -> None:
    """The test lists allowed ends by name (``-rP``). An end is allowed in three cases: a run with a mass of 1e-3 has it, too; the
    run with mass 0 has it at the time to which lighter bodies converge; nothing determines the motion of a body at mass 0."""
    named, wrong = [], []
    for seed in range(12):
        scene = crossed(family, seed)
        body = list(scene.bodies)[np.random.default_rng([5, seed]).integers(len(scene.bodies))]
        places = [f"{b}.position*" for b in scene.bodies]
        try:
            build(heavy_parts(scene, body, 0.0))
            runs = [simulate(heavy_parts(scene, body, x), rtol=1e-8, outputs=places, max_steps=6000) for x in LIGHT]
        except SceneError:
            named.append((seed, body, "refused"))
            continue
        names = [r.outcome.name for r in runs]
        if names[0] != "done" or names[-1] == "no_inertia":
            named.append((seed, body, names))
            continue
        late = [abs(r.outcome.time - runs[-1].outcome.time) for r in runs]
        if len(set(names[1:])) > 1 or any(t > 1e2 * x + 1e-8 for t, x in zip(late[1:], LIGHT[1:], strict=True)):
            wrong.append((seed, body, names, late))
            continue
        columns = sorted(c.name for c in runs[0].columns if "position" in c.name)  # a lighter body may change the order of bodies
        ends = [np.array([r[n][-1] for n in columns]) for r in runs]
        far = [float(np.abs(e - ends[-1]).max()) for e in ends[:-1]]
        steps = [r.stats.steps for r in runs]
        if names[-1] != "done":
            named.append((seed, body, names, late))
        if far[1] > 1e-3 or far[2] > 1e-5 or (names[-1] == "done" and max(steps) > 1.5 * max(steps[0], 10)):
            wrong.append((seed, body, far, steps))
    print("named:", *named, "wrong:", *wrong, sep="\n")
    assert len(wrong) <= 1


def crank_slider(inertia: float) -> Scene:
    """A crank without mass, but with this inertia (kg m²), a rod, and a slider that pushes the crank towards its dead centre. Only
    the crank's pin has friction."""
    x = ARM * math.cos(1.0) + math.sqrt(ROD**2 - (ARM * math.sin(1.0)) ** 2)
    slide = {"mass": SLIDER, "inertia": [1e-3] * 3, "position": [x, 0, 0]}
    bodies = {"crank": {"mass": 0, "inertia": [inertia] * 3}, "slide": slide}
    rubs = {"mu": 0.3, "radius": 0.02, "half_length": 0.03}
    joints = {
        "pin": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank", "friction": rubs,
                "start": {"q": 1.0, "qd": -2.0}},
        "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "slide", "at": [x, 0, 0]},
        "rod": {"type": "rod", "length": ROD, "inboard": {"body": "crank", "point": [ARM, 0, 0]},
                "outboard": {"body": "slide", "point": [0, 0, 0]}},
    }  # fmt: skip
    return scene_from_dict({"gravity": [0, 0, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1.0}})


ARM, ROD, SLIDER, CIRCLE = 0.1, 0.3, 1.5, 0.02 * 0.3 / math.hypot(1, 0.3)
"""Lengths of crank and rod, m; mass of the slider, kg; radius of the friction circle of the crank's pin, m."""


def reflected_inertia(inertia: float, angle: float) -> float:
    """J + M x′ (x′ − ρ/cos β), kg m²: the factor of the crank's acceleration. x: place of the slider, x′ = −dx/dθ; ρ: radius of
    the friction circle; β: angle of the rod. Hand calculation: J θ̈ = −M ẍ (dx/dθ + ρ/cos β)."""
    across = ARM * math.sin(angle)
    along = math.sqrt(ROD**2 - across**2)
    lever = across * (1.0 + ARM * math.cos(angle) / along)
    return inertia + SLIDER * lever * (lever - CIRCLE * ROD / along)


@pytest.mark.parametrize("method", sampled(("auto", "rk5", "rk8", "rosenbrock"), 1))
@pytest.mark.parametrize("share", sampled((0.0, 1e-6, 1e-3, 0.1, 0.5), (0.0, 0.1)))
def test_a_light_crank_jams_inside_its_friction_circle(method: str, share: float) -> None:
    """Where the factor of the crank's acceleration is 0, friction has no solution. At mass 0 this is the friction circle."""
    inertia = share * SLIDER * CIRCLE**2 / 4
    r = simulate(crank_slider(inertia), method=method, rtol=1e-9, every=0, outputs="pin.q*", kernel="parts")
    assert r.outcome.name == "jammed"
    assert r.outcome.joint == "pin"
    low, high = 0.6 * CIRCLE / ARM, 1.0  # the factor has its minimum below this interval
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if reflected_inertia(inertia, middle) > 0.0 else (middle, high)
    assert r["pin.q[1]"][-1] == pytest.approx(high, abs=1e-8)


@pytest.mark.parametrize("share", sampled((1.2, 2.0, 10.0), 1))
def test_a_crank_of_more_inertia_than_its_friction_circle_takes_passes_the_dead_centre(share: float) -> None:
    r = simulate(crank_slider(share * SLIDER * CIRCLE**2 / 4), rtol=1e-9, outputs="pin.q*", kernel="parts")
    assert r.outcome.ok
    assert r["pin.q[1]"][-1] < 0.0


def test_a_crank_without_mass_ends_by_name_at_its_dead_centre() -> None:
    """Without friction, the crank's inertia about its pin is 0 at the dead centre, and its speed grows without limit."""
    scene = crank_slider(0.0)
    pin = replace(scene.joints["pin"], friction=None)
    r = simulate(replace(scene, joints=scene.joints | {"pin": pin}), rtol=1e-9, every=0, outputs="pin.q*", kernel="parts")
    assert r.outcome.name == "no_inertia"
    assert r.outcome.joint == "pin"
    assert r["pin.q[1]"][-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("family", "seed", "body", "until"), [
    ("hung_frames", 10, "bar", 0.2), ("hung_frames", 1, "bar", 0.2), ("hung_frames", 11, "bar", 0.2),
])  # fmt: skip
def test_a_bar_without_mass_that_carries_a_heavy_body_moves_like_a_light_one(
    family: str, seed: int, body: str, until: float
) -> None:
    """The bar is the only body on its loops. The scene must not jam at its start."""
    scene = crossed(family, seed)
    light = [heavy_parts(scene, body, x) for x in (1e-7, 0.0)]
    runs = [simulate(s, until=until, rtol=1e-8, outputs="*.position*", kernel="parts") for s in light]
    assert [r.outcome.name for r in runs] == ["done"] * 2
    columns = [c.name for c in runs[0].columns if "position" in c.name]
    assert max(float(np.abs(runs[0][n][-1] - runs[1][n][-1])) for n in columns) <= 1e-7


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("seed", "until"), [(3, 0.25), (2, 0.1), (9, 0.3)])
def test_a_light_wheel_between_two_pairs_jams_no_dead_centre_of_the_link_that_drives_it(seed: int, until: float) -> None:
    """The link reverses. The wheel's bearing and its freewheel share one freedom at the dead centre, but not one motion."""
    scenes = [heavy_parts(crossed("ratchets_in_loops", seed), "wheel", x) for x in (1e-5, 1e-7)]
    runs = [simulate(s, until=until, rtol=1e-8, outputs="*.q[1]", kernel="parts") for s in scenes]
    assert [r.outcome.name for r in runs] == ["done"] * 2
    assert runs[0]["j3.q[1]"][-1] == pytest.approx(runs[1]["j3.q[1]"][-1], abs=1e-4)
    assert sorted((e.kind, e.joint) for e in runs[0].events) == sorted((e.kind, e.joint) for e in runs[1].events)


@pytest.mark.parametrize(("family", "seed", "body"), sampled([
    ("five_bars", 100, "l1"), ("five_bars", 2, "l1"), ("grippers", 0, "link_a"), ("five_bars", 1, "l2"),
    ("hooks_in_loops", 1, "l1"),
], 2))  # fmt: skip
def test_start_values_that_nobody_gave_do_not_depend_on_a_mass(family: str, seed: int, body: str) -> None:
    """A mass below 1e-6 of the heaviest changes the cut. The start rates do not change with the cut."""
    scene = crossed(family, seed)
    light = heavy_parts(scene, body, 1e-9)
    assert span(light).cut != span_without_masses(light).cut
    runs = [simulate(s, until=1e-9, every=1e-9, outputs="*.q*", kernel="parts") for s in (scene, light)]
    for name in (f"{j}.{q}[1]" for j in scene.joints for q in ("q", "qd")):
        assert runs[1][name][0] == pytest.approx(runs[0][name][0], rel=1e-9, abs=1e-9), name


FLOOR = 1e-8
"""Relative error of a run with rtol 1e-8. Where a mass differs by 1e-10, the steps differ, and the ends of both runs differ by this
error."""


def four_bar(mass: float, inertia: float, cut: str, rubs: bool) -> Scene:
    """A crank and a rocker of kilograms, and a coupler of this mass and inertia. The loop is cut at one of the joints."""
    friction = {"friction": {"mu": 0.2, "radius": 0.01, "half_length": 0.03}} if rubs else {}
    lengths = {"crank": 0.1, "coupler": 0.35, "rocker": 0.25}

    def link(name: str, m: float, j: float) -> dict[str, Any]:
        x = lengths[name]
        return {"mass": m, "inertia": [0, j, j], "center": [x / 2, 0, 0], "points": {"end": [x, 0, 0]}}

    start, base = 1.0, np.array([0.3, 0.0])
    pin = lengths["crank"] * np.array([math.cos(start), math.sin(start)])
    away = base - pin
    far = np.linalg.norm(away)
    along = (lengths["coupler"] ** 2 - lengths["rocker"] ** 2 + far**2) / (2 * far)
    across = math.sqrt(lengths["coupler"] ** 2 - along**2)
    end = pin + along * away / far + across * np.array([-away[1], away[0]]) / far
    turned = {"coupler": math.atan2(*(end - pin)[::-1]) - start, "rocker": math.atan2(*(end - base)[::-1])}
    bodies = {"crank": link("crank", 1.0, 1e-3), "coupler": link("coupler", mass, inertia), "rocker": link("rocker", 1.5, 8e-3)}
    joints: dict[str, Any] = {
        "A": {"inboard": "ground", "outboard": "crank", "start": {"q": start, "qd": 8.0}},
        "B": {"inboard": "crank.end", "outboard": "coupler", "start": {"q": turned["coupler"]}} | friction,
        "C": {"inboard": "coupler.end", "outboard": "rocker.end"} | friction,
        "D": {"inboard": "ground.base", "outboard": "rocker", "start": {"q": turned["rocker"]}} | friction,
    }
    joints = {n: {"type": "revolute", "axis": "z"} | j | ({"cut": True} if n == cut else {}) for n, j in joints.items()}
    return scene_from_dict({"gravity": [0, -9.81, 0], "ground": {"points": {"base": [0.3, 0, 0]}}, "bodies": bodies,
                            "joints": joints, "simulation": {"until": 1.0}})  # fmt: skip


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("rubs", [False, True])
def test_a_coupler_without_mass_moves_alike_wherever_the_loop_is_cut(rubs: bool) -> None:
    runs = [simulate(four_bar(0.0, 0.0, cut, rubs), rtol=1e-9, method="rk8") for cut in "ABCD"]
    light = simulate(four_bar(1e-9, 1e-12, "C", rubs), rtol=1e-9, method="rk8")
    for r in runs:
        assert r.outcome.ok
        assert r.audit.verdict == "within"
        assert r["rocker.position[1]"][-1] == pytest.approx(runs[0]["rocker.position[1]"][-1], abs=1e-7)
        assert r["rocker.position[1]"][-1] == pytest.approx(light["rocker.position[1]"][-1], abs=1e-7)
        force = [np.array([r[f"{n}.reaction.force[{k}]"] for k in (1, 2, 3)]) for n in ("B", "C")]
        assert np.abs(np.linalg.norm(force[0], axis=0) - np.linalg.norm(force[1], axis=0)).max() <= 1e-6 * np.abs(force[0]).max()


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("redundant", [False, True])
@pytest.mark.parametrize("rubs", [False, True])
def test_every_function_of_a_kernel_is_the_same_compiled_or_made_of_parts(rubs: bool, redundant: bool) -> None:
    scene = four_bar(1e-9, 1e-12, "C", rubs)
    assert build(scene).system.light
    agree(scene, redundant)


def test_a_body_without_mass_that_nothing_determines_is_refused() -> None:
    bodies = {"b": {"mass": 1, "inertia": [1, 1, 1]}, "tip": {"mass": 0, "inertia": [0, 0, 0]}}
    joints = {"j": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b"},
              "k": {"type": "prismatic", "axis": "x", "inboard": "b", "outboard": "tip"}}  # fmt: skip
    with pytest.raises(SceneError, match=r"bodies\.tip\.mass: the mass is 0, and no loop determines freedom 1 of k"):
        simulate(scene_from_dict({"bodies": bodies, "joints": joints}), until=0.1)
