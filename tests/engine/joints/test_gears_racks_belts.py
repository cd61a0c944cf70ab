"""Gears, racks and belts: rolling surfaces do not slide. Forces of teeth and strands balance every part."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.engine.mechanisms.gear_pairs import Row, flying
from tests.reference.mechanics.rotation import cross
from trunnion.basics.errors import SceneError
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

SEEDS = range(6)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("seed", "kernel"), [*((seed, "parts") for seed in SEEDS), (0, "compiled"), (1, "compiled")])
def test_every_part_is_in_balance_with_what_is_reported_of_its_joints(seed: int, kernel: str) -> None:
    f = flying(seed)
    r = simulate(f.scene, rtol=1e-10, kernel=kernel)
    assert r.outcome.name == "done"
    for i in range(len(r)):
        row = Row(f, r, i)
        for body in f.inertia:
            force, torque = row.balance(body)
            size = 10.0 * f.inertia[body][0]
            assert np.abs(np.concatenate([force, torque])).max() < 1e-9 * size, body


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", SEEDS)
def test_surfaces_do_not_slide_where_they_touch(seed: int) -> None:
    f = flying(seed)
    r = simulate(f.scene, rtol=1e-10)
    for i in range(len(r)):
        row = Row(f, r, i)
        for k, one in enumerate(f.pairs):
            if one.what in ("belt", "crossed"):
                continue  # the pulleys of a belt do not touch each other
            place, way = row.touch(one)
            slip = (row.velocity(f"w{2 * k}", place) - row.velocity(f"w{2 * k + 1}", place)) @ way
            assert abs(slip) < 1e-11, one.what


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", SEEDS)
def test_teeth_push_along_their_way_where_they_touch(seed: int) -> None:
    f = flying(seed)
    r = simulate(f.scene, rtol=1e-10)
    for i in range(len(r)):
        row = Row(f, r, i)
        for k, one in enumerate(f.pairs):
            force, torque, at = row.reported(f"m{k}")
            place, way = row.touch(one)
            if one.what in ("belt", "crossed"):
                # the torque on each pulley is the difference of the strands' forces, which act at the pulley's surface, times the
                # radius
                R = row.turned("carrier")
                turning = torque @ (R @ one.a1) / one.r1
                gap = np.linalg.norm(np.cross(one.p2 - one.p1, one.a1))
                assert np.linalg.norm(force) == pytest.approx(abs(turning) * abs(one.r1 + one.r2) / gap, rel=1e-9)
                continue
            assert np.abs(cross(force, way)).max() < 1e-9 * (1 + np.linalg.norm(force)), one.what
            about = torque + cross(at - place, force)
            assert np.abs(about).max() < 1e-9 * (1 + np.linalg.norm(force)), one.what


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_flying_gear_unit_keeps_its_momentum_and_energy(seed: int) -> None:
    f = flying(seed)
    r = simulate(f.scene, rtol=1e-10)
    total = sum(m for m, _, _ in f.inertia.values())
    found = []
    for i in range(len(r)):
        row = Row(f, r, i)
        middle = sum((m * row(f"{b}.position") for b, (m, _, _) in f.inertia.items()), np.zeros(3)) / total
        moved = sum((m * row(f"{b}.velocity") for b, (m, _, _) in f.inertia.items()), np.zeros(3)) / total
        spin = np.zeros(3)
        for b, (m, _, tensor) in f.inertia.items():
            R = row.turned(b)
            spin += R @ tensor @ R.T @ row(f"{b}.angular_velocity")
            spin += m * cross(row(f"{b}.position") - middle, row(f"{b}.velocity") - moved)
        found.append(spin)
    assert np.abs(found[-1] - found[0]).max() < 1e-8 * np.abs(found[0]).max()
    assert np.abs(r["energy.residual"]).max() < 1e-8 * r["energy.kinetic"].max()


def planetary() -> sm.Scene:
    """A sun (24 teeth), three planets (24) on an arm, and a ring (72) on the ground. A drive turns the sun, and a load acts on the
    arm."""
    arm, gears = {}, {}
    for k in range(3):
        x, y = 0.048 * np.cos(2 * np.pi * k / 3), 0.048 * np.sin(2 * np.pi * k / 3)
        arm[f"a{k}"] = f"{{type: revolute, inboard: {{body: arm, point: [{x}, {y}, 0]}}, outboard: p{k}}}"
        gears[f"s{k}"] = f"{{type: gear, inboard: sun, outboard: p{k}, teeth: [24, 24], module: 2 mm}}"
        gears[f"r{k}"] = f"{{type: gear, inboard: p{k}, outboard: ground, teeth: [24, 72], module: 2 mm, internal: true}}"
    hinges = {
        "in": "{type: revolute, inboard: ground, outboard: sun, drive: {constant: {rate: 100}}}",
        "out": "{type: revolute, inboard: ground, outboard: arm, effort: -3}",
    }
    lines = [f"  {n}: {t[:-1]}, axis: z}}" for n, t in (hinges | arm | gears).items()]
    bodies = "".join(f"  {b}: {{mass: 0.3, inertia: [1e-4, 1e-4, 2e-4]}}\n" for b in ("sun", "arm", "p0", "p1", "p2"))
    run = "\nsimulation: {until: 10 s, every: 1 s}\n"
    return scene_from_text(f"schema: 1\nbodies:\n{bodies}joints:\n" + "\n".join(lines) + run)


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_planetary_train_turns_and_loads_by_its_numbers_of_teeth(kernel: str) -> None:
    r = simulate(planetary(), kernel=kernel)
    ratio = 24 / (24 + 72)  # Willis: ω_arm = ω_sun z_s/(z_s + z_r)
    assert r["out.q[1]"] == pytest.approx(100 * ratio * r.time, rel=1e-12, abs=1e-12)
    assert r["a0.q[1]"] == pytest.approx((-72 / 24 - 0) * 100 * ratio * r.time, rel=1e-12, abs=1e-12)
    assert r["in.drive.effort[1]"] == pytest.approx(3 * ratio, rel=1e-9)
    for k in range(3):  # planets share the load evenly, and both teeth of a planet have equal forces
        assert r[f"s{k}.reaction.torque[1]"] == pytest.approx(-3 * ratio / 3, rel=1e-9)
        assert r[f"r{k}.reaction.torque[1]"] == pytest.approx(3 * ratio / 3, rel=1e-9)


def made(joints: str, more: str = "", bodies: str = "ab") -> sm.Scene:
    """Bodies on joints of the ground, and one pair of gears, rack or belt."""
    each = "".join(f"  {b}: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}\n" for b in bodies)
    text = f"schema: 1\ngravity: [0, 0, 0]\nbodies:\n{each}joints:\n{joints}\n{more}simulation: {{until: 1 s, every: 0.1 s}}\n"
    return scene_from_text(text)


ON_A = "  on_a: {type: revolute, axis: z, inboard: ground, outboard: a, effort: 0.3}\n"
ON_B = "  on_b: {type: revolute, axis: z, inboard: {body: ground, point: [60 mm, 0, 0]}, outboard: b}\n"
MESH = "  m: {type: gear, axis: z, inboard: a, outboard: b, teeth: [20, 40], module: 2 mm}\n"


def test_a_differential_shares_speeds_and_torques_between_its_sides() -> None:
    side = "{type: revolute, axis: x, inboard: ground, outboard: %s, effort: %s}"
    joints = f"""\
  cage: {{type: revolute, axis: x, inboard: ground, outboard: c, effort: 0.9}}
  left: {side % ("a", "-0.1")}
  right: {side % ("b", "0.2")}
  pin: {{type: revolute, axis: y, inboard: c, outboard: d}}
  one: {{type: bevel_gear, inboard: {{body: a, axis: x}}, outboard: {{body: d, axis: y}}, teeth: [16, 10], module: 4 mm}}
  two: {{type: bevel_gear, inboard: {{body: b, axis: -x}}, outboard: {{body: d, axis: y}}, teeth: [16, 10], module: 4 mm}}"""
    r = simulate(made(joints, bodies="abcd"))
    assert r["left.qd[1]"] + r["right.qd[1]"] == pytest.approx(2 * r["cage.qd[1]"], rel=1e-12, abs=1e-12)
    assert np.ptp(r["pin.q[1]"]) > 0.1
    # Lagrange's equations with ω = (ω_l + ω_r)/2 and the spin (z_s/z_p)(ω_l − ω_r)/2 of the pin; c and d turn together
    same, other = 0.01 + 0.02 / 4 + 0.01 * 0.64, 0.02 / 4 - 0.01 * 0.64
    found = np.linalg.solve([[same, other], [other, same]], [-0.1 + 0.45, 0.2 + 0.45])
    assert [r["left.qdd[1]"][0], r["right.qdd[1]"][0]] == pytest.approx(list(found), rel=1e-9)


def test_a_rack_goes_by_the_turns_of_its_wheel_and_is_pushed_by_its_torque() -> None:
    joints = ON_A + "  on_b: {type: prismatic, axis: x, inboard: {body: ground, point: [0, -20 mm, 0]}, outboard: b, damping: 3}\n"
    joints += "  m: {type: rack, inboard: {body: a, axis: z}, outboard: {body: b, axis: x}, teeth: [20], module: 2 mm}"
    r = simulate(made(joints))
    assert r["on_b.q[1]"] == pytest.approx(0.02 * r["on_a.q[1]"], rel=1e-12, abs=1e-12)
    push = r["on_b.qdd[1]"] + 3 * r["on_b.qd[1]"]
    assert r["m.reaction.torque[1]"] == pytest.approx(-0.02 * push, rel=1e-9)


@pytest.mark.parametrize(("crossed", "sign"), [(False, 1), (True, -1)])
def test_a_belt_turns_its_pulleys_by_their_radii_and_pulls_them_together_by_none(crossed: bool, sign: int) -> None:
    mesh = f"  m: {{type: belt, axis: z, inboard: a, outboard: b, radii: [10 mm, 25 mm], crossed: {str(crossed).lower()}}}\n"
    r = simulate(made(ON_A + ON_B + mesh))
    assert r["on_b.q[1]"] == pytest.approx(sign * 10 / 25 * r["on_a.q[1]"], rel=1e-12, abs=1e-12)
    # the forces of the two strands cancel along the line of centres and add across this line
    assert r["on_a.reaction.force[2]"] == pytest.approx(0, abs=1e-12)
    tooth = 0.02 * r["on_b.qdd[1]"] / 0.025
    assert np.abs(r["on_a.reaction.force[3]"]) == pytest.approx(np.abs(tooth) * (0.025 - sign * 0.010) / 0.06, rel=1e-9)


def test_a_start_between_two_teeth_moves_to_the_nearest_with_a_note() -> None:
    tooth = 2 * np.pi / 40
    still, turned = ", start: {q: 0}}\n", f", start: {{q: {3.2 * tooth}}}}}\n"
    r = simulate(made(ON_A.replace("}\n", still) + ON_B.replace("b}\n", "b" + turned) + MESH))
    teeth = (40 * r["on_b.q[1]"][0] + 20 * r["on_a.q[1]"][0]) / (2 * np.pi)
    assert teeth == pytest.approx(3, abs=1e-9)
    assert sum("so that the loops close" in note for note in r.notes) == 2


def test_wheels_follow_a_parameter_of_the_scene() -> None:
    more = "parameters: {n: 20}\n"
    mesh = MESH.replace("[20, 40]", '["{n}", "{60 - n}"]')
    scene = made(ON_A + ON_B + mesh, more)
    found = [simulate(scene, overrides={"parameters.n": n}) for n in (15, 20, 24)]
    for n, r in zip((15, 20, 24), found, strict=True):
        assert r["on_b.q[1]"] == pytest.approx(-n / (60 - n) * r["on_a.q[1]"], rel=1e-12, abs=1e-12)


WRONG = {
    "the axes of its wheels are 0.06 m apart; teeth and module require 0.066 m": MESH.replace("[20, 40]", "[20, 46]"),
    "needs its teeth or radii": MESH.replace(", teeth: [20, 40], module: 2 mm", ""),
    "a gear with teeth needs a module": MESH.replace(", module: 2 mm", ""),
    "20.5 is not a valid number of teeth": MESH.replace("[20, 40]", "[20.5, 40]"),
    "a gear has two wheels, not 1": MESH.replace("[20, 40]", "[20]"),
    "a gear has no belt that could be crossed": MESH.replace("module", "crossed: true, module"),
    "is not a ratio of whole numbers": MESH.replace("teeth: [20, 40], module: 2 mm", "radii: [20.00712 mm, 39.99288 mm]"),
    "the axes of its two wheels are not parallel": MESH.replace("outboard: b", "outboard: {body: b, axis: y}"),
    "a revolute joint has no wheels": MESH.replace("type: gear", "type: revolute"),
}


@pytest.mark.parametrize("says", WRONG)
def test_wheels_that_cannot_roll_are_refused_with_the_reason(says: str) -> None:
    with pytest.raises(SceneError, match=re.escape(says)):
        build(made(ON_A + ON_B + WRONG[says]))
