"""Gearboxes: in motion, the catalogue's efficiencies give the ratio of the shafts' torques. At rest, the ratio lies between the
ratios for the two directions of power."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.engine.mechanisms.gear_pairs import flying
from tests.engine.mechanisms.geared_hoist import Hoist, random_hoist
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from trunnion import SceneError, equilibrium, hold, scene_from_dict, sensitivity, simulate, sweep
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text

ANGLE = "drum_bearing.q[1]"
LIFTING = Hoist(20.0, 0.001, 0.5, 1.1, -15.0, 0.9, 0.6, 0.02)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_hoist_lifts_holds_lowers_and_reverses_by_its_efficiencies(seed: int) -> None:
    """Angles of the drum agree with the closed form. Efficiencies are 0.9, 0.6 or random forward, and 0.9, 0.6 or 0 backward.
    Every fortieth case uses the compiled kernel."""
    h = random_hoist(seed)
    r = simulate(h.scene(), rtol=1e-10, outputs=[ANGLE], kernel=("compiled" if seed % 40 == 2 else "parts"))
    assert r.outcome.name == "done"
    assert r[ANGLE] == pytest.approx(h.angles(r.time), abs=1e-9)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(60))
def test_a_hoist_at_rest_has_the_share_of_the_closed_form_and_bounds_are_exact(seed: int) -> None:
    h = replace(random_hoist(seed), rate=0.0)
    found = hold(h.scene(), bounds=True)
    assert found.answer.pairs[0].share == pytest.approx(1 - h.spare, rel=1e-9, abs=1e-9)
    assert found.holds == ("certain" if h.spare > 0 else "no")
    if h.spare > 0:
        assert found.pairs[0].share.largest.value == pytest.approx(1 - h.spare, abs=1e-8)
        motor = next(x for x in found.loads if "rotor" in x.name)
        limits = [x.guaranteed.value for x in (motor.less, motor.more) if x.guaranteed.value is not None]
        for limit in limits:
            assert replace(h, motor=limit).spare == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize("backward", [0.9, 0.6, 0.0])
def test_a_hoist_starts_just_beyond_the_band_between_lowering_and_lifting(backward: float) -> None:
    for lifting in (True, False):
        edge = 15.0 / 20.0 * (1 / 0.9 if lifting else backward)
        for more in (1e-6, -1e-6):
            outward = more if lifting else -more
            h = replace(LIFTING, motor=edge + outward, backward=backward, no_load=0.0)
            r = simulate(h.scene(), outputs=[ANGLE])
            assert bool(abs(r[ANGLE][-1]) > 1e-9) == (more > 0), (lifting, more)


def test_a_self_locking_gear_unit_holds_its_load_without_a_motor_and_lowers_it_with_the_motors_torque_alone() -> None:
    h = replace(LIFTING, motor=0.0, backward=0.0, no_load=0.0)
    assert hold(h.scene()).holds
    assert abs(simulate(h.scene())[ANGLE][-1]) < 1e-12
    r = simulate(replace(h, motor=-0.1).scene(), rtol=1e-10)
    assert r["rotor_bearing.qdd[1]"] == pytest.approx(-0.1 / h.rotor, rel=1e-9)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(20))
def test_a_gearbox_is_a_pair_of_torques_at_the_joints_of_its_shafts(seed: int) -> None:
    """Shafts about any two axes, out of balance, in a housing in free flight. In a second scene, efforts at the joints of the
    shafts replace the gearbox. The efforts equal the gearbox's two torques, and give the same accelerations."""
    f, rng = flying(seed, ("gear",)), np.random.default_rng(seed)
    ratio, efficiency, backward = float(rng.uniform(-9, 9)), 0.8, float(rng.choice([0.7, 0.0]))
    rubs = sm.Friction(efficiency=efficiency, efficiency_backward=backward)
    box = sm.Joint("gearbox", sm.Side("w0"), sm.Side("w1"), ratio=ratio, friction=rubs)
    scene = replace(f.scene, joints=f.scene.joints | {"m0": box})
    accelerations = ["*.qdd[*]", "*.acceleration*"]
    r = simulate(scene, until=1e-3, every=1e-3)
    taken, given = r["m0.input_torque"][0], r["m0.output_torque"][0]
    forward = given * r["on_w1.qd[1]"][0] > 0
    assert ratio * taken == pytest.approx(given / efficiency if forward else given * backward, rel=1e-9, abs=1e-9)
    assert r["on_w0.qd[1]"][0] == pytest.approx(ratio * r["on_w1.qd[1]"][0], rel=1e-12)
    joints = dict(scene.joints)
    del joints["m0"]
    for n, torque in (("on_w0", -taken), ("on_w1", given)):
        joints[n] = replace(joints[n], effort=float(torque), start=sm.Start(qd=float(r[f"{n}.qd[1]"][0])))
    alone = simulate(replace(scene, joints=joints), until=1e-3, every=1e-3, outputs=accelerations)
    for c in alone.columns[1:]:
        assert r[c.name][0] == pytest.approx(alone[c.name][0], rel=1e-8, abs=1e-8), c.name


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(6))
def test_both_kernels_write_the_same_with_a_gearbox(seed: int) -> None:
    f = flying(seed, ("gear", "belt"))
    rubs = sm.Friction(efficiency=0.8, no_load_torque=0.1)
    box = sm.Joint("gearbox", sm.Side("w0"), sm.Side("w1"), ratio=-3.0, friction=rubs)
    agree(replace(f.scene, joints=f.scene.joints | {"m0": box}), redundant=seed % 2 == 1)


def test_derivatives_of_a_run_are_those_of_the_closed_form() -> None:
    keys = {"ratio": "ratio", "friction.efficiency": "forward", "friction.no_load_torque": "no_load"}
    found = sensitivity(LIFTING.scene(), tuple(f"joints.box.{k}" for k in keys), (ANGLE,), rtol=1e-10)
    lowering = replace(LIFTING, motor=0.2)
    back = sensitivity(lowering.scene(), ("joints.box.friction.efficiency_backward",), (ANGLE,), rtol=1e-10)
    cases = [*((LIFTING, found, *x) for x in keys.items()), (lowering, back, "friction.efficiency_backward", "backward")]
    for h, s, key, name in cases:
        step = 1e-5 * getattr(h, name)
        up, down = (replace(h, **{name: getattr(h, name) + x}).angles(s.time) for x in (step, -step))
        assert s.d(ANGLE, f"joints.box.{key}")[1:] == pytest.approx((up - down)[1:] / (2 * step), rel=1e-6), key


def test_a_sweep_over_efficiencies_is_the_closed_form() -> None:
    values = [0.5, 0.8, 0.9]
    s = sweep(LIFTING.scene(), {"joints.box.friction.efficiency": values}, reductions=[f"final:{ANGLE}"], rtol=1e-10)
    expected = [float(replace(LIFTING, forward=v).angles(np.array([1.0]))[0]) for v in values]
    assert list(s.to_pandas()[f"final:{ANGLE}"]) == pytest.approx(expected, rel=1e-9)


def test_the_default_backward_efficiency_is_that_of_equal_friction_both_ways() -> None:
    for forward in (0.9, 0.6, 0.3):
        given = replace(LIFTING, forward=forward, motor=0.1, backward=max(0.0, 2 - 1 / forward))
        both = [simulate(given.scene(**more), rtol=1e-10)[ANGLE] for more in ({}, {"efficiency_backward": None})]
        assert both[0] == pytest.approx(both[1], abs=1e-12)


@pytest.mark.parametrize(("over", "unit"), [("torque", 5.0), ("speed", 1.0)])
def test_a_table_gives_the_efficiency_at_the_torque_or_speed_of_the_output_shaft(over: str, unit: float) -> None:
    """At the points of the table, the gearbox has the efficiency of the table."""
    at, value = [unit * k for k in range(1, 6)], [0.5, 0.7, 0.8, 0.85, 0.87]
    for x, efficiency in zip(at, value, strict=True):
        load, rate = (x, 2.0) if over == "torque" else (7.0, x)
        h = replace(LIFTING, load=-load, motor=load / efficiency / 20, no_load=0.0, rate=rate)
        r = simulate(h.scene(efficiency={over: at, "value": value}), until=0.1, every=0.1)
        # with this efficiency the torques balance, and the drum's rate is constant
        assert r["drum_bearing.qdd[1]"] == pytest.approx(0.0, abs=1e-9)
        assert r["box.input_torque"] * 20 == pytest.approx(load / efficiency, rel=1e-9)


def test_a_spring_on_the_motor_has_the_band_of_the_closed_form() -> None:
    scene = LIFTING.scene()
    shaft = replace(scene.joints["rotor_bearing"], effort=None, spring=sm.Spring(stiffness=2.0, rest=0.0), damping=0.01)
    found = equilibrium(replace(scene, joints=scene.joints | {"rotor_bearing": shaft}))
    band = next(b for b in found.bands if b.coordinate == "rotor_bearing.q[1]")
    assert (band.low, band.high) == pytest.approx((-(15 / 0.9 / 20 + 0.02) / 2, -(15 * 0.6 / 20 - 0.02) / 2), rel=1e-9)


def test_two_gearboxes_in_a_row_multiply_their_ratios_and_efficiencies() -> None:
    names = ("a", "b", "c")
    joints = {f"on_{n}": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": n} for n in names}
    joints["on_a"]["drive"] = {"constant": {"rate": 50}}
    for k, (ratio, efficiency) in enumerate(((5.0, 0.9), (-4.0, 0.8))):
        joints[f"box{k}"] = {"type": "gearbox", "inboard": names[k], "outboard": names[k + 1], "ratio": ratio,
                             "friction": {"efficiency": efficiency}}  # fmt: skip
    bodies = {n: {"mass": 1, "inertia": [0.01] * 3} for n in names}
    for load, efficiency in ((30.0, 0.72), (-30.0, 1 / ((2 - 1 / 0.9) * (2 - 1 / 0.8)))):
        joints["on_c"]["effort"] = load  # the drum turns backward, so a positive torque opposes its rotation
        r = simulate(scene_from_dict({"gravity": [0, 0, 0], "bodies": bodies, "joints": joints}), until=0.1, every=0.05)
        assert r["on_a.drive.effort[1]"][1:] == pytest.approx(load / 20 / efficiency, rel=1e-9)
        assert r["on_c.qd[1]"] == pytest.approx(-2.5, rel=1e-12)


WRONG = {
    "the ratio of a gearbox is missing": ("ratio: 20, ", ""),
    "ratio must not be 0": ("ratio: 20", "ratio: 0"),
    "efficiency must lie between 0 and 1 (it is 90)": ("efficiency: 0.9", "efficiency: 90"),
    "efficiency must lie between 0 and 1 (it is 0)": ("efficiency: 0.9", "efficiency: 0"),
    "friction of a gearbox joint needs efficiency": ("efficiency: 0.9", "no_load_torque: 1"),
    "efficiency_backward must lie between 0 and 1 (it is -0.1)": ("0.9", "0.9, efficiency_backward: -0.1"),
    "3 entries of torque but 2 values": ("0.9", "{torque: [1, 2, 3], value: [0.5, 0.6]}"),
    "efficiency is a table over torque or over speed": ("0.9", "{value: [0.5, 0.6]}"),
    "a table needs the law coulomb": ("0.9", "{torque: [1, 2], value: [0.5, 0.6]}, law: viscous, viscosity: 1"),
    "friction of a gearbox joint has no radius": ("0.9", "0.9, radius: 1 mm"),
    'no joint carries the shaft "rotor"': ("on_rotor: {type: revolute", "on_rotor: {type: cylindrical"),
    'several joints carry the shaft "rotor": on_rotor, more': (
        "  box", "  more: {type: revolute, axis: x, inboard: ground, outboard: rotor}\n  box"),
    "a revolute joint has no ratio": ("outboard: rotor, axis: x", "outboard: rotor, axis: x, ratio: 3"),
    "a gearbox has no damping of its own: shafts turn on other joints": ("ratio: 20", "ratio: 20, damping: 1"),
    "drives prescribe the motion of both shafts": ("axis: x", "axis: x, drive: {constant: {rate: 1}}"),
}  # fmt: skip
RIGHT = """\
schema: 1
bodies: {rotor: {mass: 1, inertia: [1, 1, 1]}, drum: {mass: 1, inertia: [1, 1, 1]}}
joints:
  on_rotor: {type: revolute, inboard: ground, outboard: rotor, axis: x}
  on_drum: {type: revolute, inboard: ground, outboard: drum, axis: x}
  box: {type: gearbox, inboard: rotor, outboard: drum, ratio: 20, friction: {efficiency: 0.9}}
"""


@pytest.mark.parametrize("says", WRONG)
def test_impossible_gearboxes_are_refused_with_the_reason(says: str) -> None:
    scene_from_text(RIGHT)
    old, new = WRONG[says]
    with pytest.raises(SceneError, match=re.escape(says)):
        scene_from_text(RIGHT.replace(old, new))


def test_the_winch_of_the_guide_agrees_with_hand_calculation() -> None:
    page = (Path(trunnion.__file__).parent / "docs/guide/friction.md").read_text(encoding="utf-8")
    scene = scene_from_text(page.split("```yaml\n")[1].split("```")[0])
    assert scene.name == "winch"
    assert hold(scene).pairs[0].share == pytest.approx((115 - 98.1) / (98.1 * (1 / 0.9 - 1) + 10), rel=1e-12)
