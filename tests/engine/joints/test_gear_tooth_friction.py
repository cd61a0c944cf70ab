"""Teeth of gears press along their pressure angle and have friction. A flank loses its load before the other flank is loaded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.engine.mechanisms.gear_pairs import Pair, Row, flying
from tests.reference.mechanics.rotation import cross
from trunnion import equilibrium, sensitivity
from trunnion.analysis.mechanics.wear import wear
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict, scene_from_text
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

ANGLE, MU, MODULE = np.radians(20.0), 0.08, 0.004
RUBBING = sm.Friction(mu=MU, pressure_angle=float(ANGLE))
ARM = np.pi * MODULE * np.cos(ANGLE) / 4
ROUND = ("gear", "internal", "gear", "internal")
OTHERS = ("bevel_gear", "rack", "bevel_gear", "rack")
RUNS = [*((ROUND, seed, "parts") for seed in range(5)), (ROUND, 0, "compiled"), *((OTHERS, seed, "parts") for seed in range(4)),
        (OTHERS, 0, "compiled")]  # fmt: skip


def meshing(row: Row, one: Pair) -> tuple[np.ndarray, np.ndarray]:
    """The axis about which the wheels turn relative to each other at their mesh, and the vector from the inboard to the outboard
    wheel."""
    R = row.turned("carrier")
    a, b, between = R @ one.a1, R @ one.a2, R @ (one.p2 - one.p1)
    if one.what == "bevel_gear":
        line = one.r2 * a + one.r1 * b
        line /= np.linalg.norm(line)
        out = b - (b @ line) * line
        return line, out / np.linalg.norm(out)
    out = between - a * (a @ between)
    if one.what == "rack":
        out = out - b * (b @ out)
    return a, out / np.linalg.norm(out)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("pairs", "seed", "kernel"), RUNS)
def test_a_tooth_pushes_wheels_apart_and_rubs_by_what_it_drives(pairs: tuple[str, ...], seed: int, kernel: str) -> None:
    f = flying(seed, pairs, RUBBING)
    r = simulate(f.scene, rtol=1e-10, kernel=kernel)
    assert r.outcome.name == "done"
    for i in range(1, len(r)):
        row = Row(f, r, i)
        for body in f.inertia:
            force, torque = row.balance(body)
            assert np.abs(np.concatenate([force, torque])).max() < 1e-8 * f.inertia[body][0], body
        for k, one in enumerate(f.pairs):
            force, torque, at = row.reported(f"m{k}")
            place, way = row.touch(one)
            axis, outward = meshing(row, one)
            drives, apart = force @ way, force @ outward
            inside = one.what == "internal"  # the pinion, which is the inboard wheel, is pushed to the middle of its ring
            assert apart == pytest.approx((1 if inside else -1) * np.tan(ANGLE) * abs(drives), rel=1e-9)
            assert r[f"m{k}.contact[1].normal_force"][i] == pytest.approx(np.hypot(drives, apart), rel=1e-12)
            about = torque + cross(at - place, force)
            turning = (row(f"w{2 * k + 1}.angular_velocity") - row(f"w{2 * k}.angular_velocity")) @ axis
            rubs = MU * ARM * np.hypot(drives, apart) * np.sign(turning)
            assert about == pytest.approx(rubs * axis, rel=1e-8, abs=1e-12)
    assert np.abs(r["energy.residual"]).max() < 1e-8 * r["energy.kinetic"].max()


def pair(one: str, two: str, internal: bool = False) -> sm.Scene:
    """Two wheels of 20 and 40 teeth on the ground. ``one`` and ``two`` are the loads and devices of the wheels."""
    distance = MODULE * (40 - 20 if internal else 40 + 20) / 2
    return scene_from_text(f"""\
schema: 1
gravity: [0, 0, 0]
bodies:
  a: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}
  b: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}
joints:
  on_a: {{type: revolute, axis: z, inboard: ground, outboard: a, {one}}}
  on_b: {{type: revolute, axis: z, inboard: {{body: ground, point: [{distance}, 0, 0]}}, outboard: b, {two}}}
  m:
    {{type: gear, axis: z, inboard: a, outboard: b, teeth: [20, 40], module: {MODULE}, internal: {str(internal).lower()},
     friction: {{mu: {MU}, pressure_angle: {ANGLE}}}}}
simulation: {{until: 2 s, every: 0.05 s}}
""")


R1, R2, ROLL = 20 * MODULE / 2, 40 * MODULE / 2, MU * np.pi * MODULE / 4
"""Radii of the wheels, m; the last number is the torque of friction over the driving force."""


@pytest.mark.parametrize(("internal", "out"), [(False, R2 - ROLL), (True, R2 + ROLL)])
def test_the_torque_that_a_load_takes_is_that_of_its_efficiency(internal: bool, out: float) -> None:
    # outside wheels turn in opposite directions, and friction brakes the two wheels; the friction that brakes a pinion drives its
    # ring
    load = 7.0 * (1 if not internal else -1)
    r = simulate(pair("drive: {constant: {rate: 30}}", f"effort: {load}", internal), rtol=1e-10)
    assert r["on_a.drive.effort[1]"][1:] == pytest.approx((R1 + ROLL) / out * 7.0, rel=1e-9)
    efficiency = -load * r["on_b.qd[1]"] / (r["on_a.drive.effort[1]"] * r["on_a.qd[1]"])
    assert efficiency[1:] == pytest.approx(R1 / R2 * out / (R1 + ROLL), rel=1e-9)
    lost = 1 - np.pi * MU / 2 * (1 / 20 - 1 / 40 if internal else 1 / 20 + 1 / 40)
    assert efficiency[1] == pytest.approx(lost, abs=2 * (1 - lost) ** 2)  # limit by the textbooks' first-order formula


@pytest.mark.parametrize("side", [1, -1])
def test_teeth_hold_between_raising_and_lowering(side: int) -> None:
    ratio = (R1 + ROLL) / (R2 - ROLL) if side > 0 else (R1 - ROLL) / (R2 + ROLL)
    for more, moves in ((1e-6, True), (-1e-6, False)):
        torque = 5.0 * ratio * (1 + side * more)
        r = simulate(pair(f"effort: {torque}", "effort: 5"))
        # in 2 s, the excess of the load turns the wheel by 1e-4 rad, and round-off in a loop turns it by 1e-13 rad
        moved = np.abs(r["on_a.q[1]"]).max()
        assert bool(moved > 1e-9) == moves, (side, more)


@pytest.mark.parametrize("lifts", [True, False])
def test_a_pinion_lifts_its_rack_and_is_turned_back_by_it_by_its_efficiency(lifts: bool) -> None:
    weight, rate = 30.0, 5.0 if lifts else -5.0
    scene = scene_from_text(f"""\
schema: 1
gravity: [0, 0, 0]
bodies: {{a: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}, b: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}}}
joints:
  on_a: {{type: revolute, axis: z, inboard: ground, outboard: a, drive: {{constant: {{rate: {rate}}}}}}}
  on_b: {{type: prismatic, axis: y, inboard: {{body: ground, point: [{R1}, 0, 0]}}, outboard: b, effort: -{weight}}}
  m:
    {{type: rack, inboard: {{body: a, axis: z}}, outboard: {{body: b, axis: y}}, teeth: [20], module: {MODULE},
     friction: {{mu: {MU}, pressure_angle: {ANGLE}}}}}
simulation: {{until: 0.5 s, every: 0.05 s}}
""")
    r = simulate(scene, rtol=1e-10)
    assert r["on_b.q[1]"] == pytest.approx(R1 * rate * r.time, rel=1e-12, abs=1e-13)
    assert r["on_a.drive.effort[1]"][1:] == pytest.approx(weight * (R1 + (ROLL if lifts else -ROLL)), rel=1e-9)
    # one of the two components is along the wheel's axis and is zero
    push = np.abs(r["on_b.reaction.force[3]"][1:]) + np.abs(r["on_b.reaction.force[2]"][1:])
    assert push == pytest.approx(weight * np.tan(ANGLE), rel=1e-9)


def test_a_bevel_gear_drives_by_the_efficiency_of_its_equivalent_spur_gears() -> None:
    load = 7.0
    scene = scene_from_text(f"""\
schema: 1
gravity: [0, 0, 0]
bodies: {{a: {{mass: 1, inertia: [0.01, 0.01, 0.01]}}, b: {{mass: 1, inertia: [0.01, 0.01, 0.01]}}}}
joints:
  on_a: {{type: revolute, axis: z, inboard: ground, outboard: a, drive: {{constant: {{rate: 30}}}}}}
  on_b: {{type: revolute, axis: x, inboard: ground, outboard: b, effort: {load}}}
  m:
    {{type: bevel_gear, inboard: {{body: a, axis: z}}, outboard: {{body: b, axis: x}}, teeth: [20, 40], module: {MODULE},
     friction: {{mu: {MU}, pressure_angle: {ANGLE}}}}}
simulation: {{until: 0.5 s, every: 0.05 s}}
""")
    r = simulate(scene, rtol=1e-10)
    # Tredgold's radii of spur gears that mesh like the bevel gears
    one, two = R1 / np.cos(np.arctan(20 / 40)), R2 / np.cos(np.arctan(40 / 20))
    wanted = R1 / R2 * (1 + ROLL / one) / (1 - ROLL / two) * load
    assert r["on_a.drive.effort[1]"][1:] == pytest.approx(wanted, rel=1e-9)


def reversing() -> Result:
    """A wheel that a drive turns to and fro."""
    return simulate(pair("effort: {harmonic: {amplitude: 2, frequency: 1 Hz, phase: 17 deg}}", "start: {qd: 0.001}"), rtol=1e-9)


def test_flanks_change_at_the_instants_at_which_the_load_turns_round() -> None:
    r = reversing()
    turned = [e.time for e in r.events if e.kind == "separation" and e.joint == "m"]
    # the drive moves only inertia: the load of a tooth and the torque pass zero together
    assert turned == pytest.approx([(k - 17 / 180) / 2 for k in (1, 2, 3, 4)], abs=1e-7)


def test_derivatives_of_a_run_with_teeth_are_those_by_differences() -> None:
    scene = pair("damping: 0.1, effort: 3", "damping: 0.2, effort: 1")
    values = {"joints.m.friction.mu": MU, "joints.m.friction.pressure_angle": ANGLE, "joints.on_b.damping": 0.2}
    columns = ("on_a.qd[1]", "on_b.reaction.force[2]", "m.contact[1].normal_force")
    found = sensitivity(scene, tuple(values), columns, until=1.0, every=0.5, rtol=1e-10)
    h = 1e-5
    for path, value in values.items():
        up, down = (simulate(scene, until=1.0, every=0.5, rtol=1e-11, overrides={path: value + s * h}) for s in (1, -1))
        for column in columns:
            slope = (up[column] - down[column]) / (2 * h)
            assert found.d(column, path)[1:] == pytest.approx(slope[1:], rel=1e-6, abs=1e-7), (column, path)


def test_wear_of_teeth_is_by_the_way_their_flanks_slide() -> None:
    r = simulate(pair("drive: {constant: {rate: 30}}", "effort: 7"), rtol=1e-10)
    found = wear(r, 1e-15)["m.contact[1]"]
    force = 7.0 / (R2 - ROLL) / np.cos(ANGLE)
    way = ARM * 30 * (1 + 20 / 40) * 2.0
    assert found.distance == pytest.approx(way, rel=1e-9)
    assert found.volume == pytest.approx(1e-15 * force * way, rel=1e-9)


def test_the_band_of_rest_of_a_geared_spring_is_that_of_raising_and_lowering() -> None:
    """``equilibrium`` finds the range of rest of the spring's wheel. At the ends of this range, the load on the other wheel just
    sinks or just rises."""
    stiffness, load = 20.0, 5.0
    found = equilibrium(pair(f"spring: {{stiffness: {stiffness}}}, damping: 0.5", f"effort: {load}"))
    bands = {b.coordinate: sorted((abs(b.low), abs(b.high))) for b in found.bands}
    edges = sorted(load / stiffness * x for x in ((R1 - ROLL) / (R2 + ROLL), (R1 + ROLL) / (R2 - ROLL)))
    assert bands["on_a.q[1]"] == pytest.approx(edges, rel=1e-8)
    assert bands["on_b.q[1]"] == pytest.approx([x * R1 / R2 for x in edges], rel=1e-8)


def idle_train(rng: np.random.Generator) -> tuple[dict[str, Any], str, float]:
    """Wheels in a row that coast to rest. One shaft has friction and an effort that is smaller than this friction. Also returns
    this shaft's name and effort."""
    count, module, place = int(rng.integers(2, 6)), 0.004, 0.0
    teeth, holds = rng.integers(14, 40, count).tolist(), int(rng.integers(0, count))
    torque = rng.uniform(0.02, 0.1)
    effort = rng.uniform(-0.9, 0.9) * torque
    bodies, joints = {}, {}
    for i in range(count):
        place += module * (teeth[i - 1] + teeth[i]) / 2 if i else 0.0
        bodies[f"w{i}"] = {"mass": 1.0, "inertia": [rng.uniform(5e-4, 3e-3)] * 3, "position": [place, 0, 0]}
        joints[f"s{i}"] = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": f"w{i}", "at": [place, 0, 0]}
        if i:
            joints[f"g{i}"] = {"type": "gear", "axis": "z", "inboard": f"w{i - 1}", "outboard": f"w{i}", "module": module,
                               "teeth": [teeth[i - 1], teeth[i]],
                               "friction": {"mu": rng.uniform(0.03, 0.15), "pressure_angle": "20 deg"}}  # fmt: skip
    joints["s0"]["start"] = {"qd": rng.uniform(2.0, 8.0)}
    joints[f"s{holds}"] |= {"friction": {"torque": torque}, "effort": effort}
    return {"schema": 1, "gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints}, f"s{holds}", effort


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["auto", "moreau", "rk5", "rk8", "rosenbrock"])
@pytest.mark.parametrize("seed", [1, 0, *range(2, 8)])
def test_teeth_carry_nothing_where_one_shaft_holds_a_train_at_rest(seed: int, method: str) -> None:
    """Coasting takes (Σ J i²) ω/(friction ∓ effort) seconds. Afterwards the friction of the shaft balances only the effort of this
    shaft."""
    scene, shaft, effort = idle_train(np.random.default_rng(seed))
    columns = [f"{shaft}.qd[1]", f"{shaft}.friction.torque[1]", "g*.contact[1].normal_force"]
    run = simulate(scene_from_dict(scene), until=30.0, every=1.0, method=method, outputs=columns, rtol=1e-6)
    assert run.outcome.name == "done"
    assert abs(run[columns[0]][-1]) < 1e-9
    assert abs(run[columns[1]][-1]) == pytest.approx(abs(effort), rel=1e-9)
    assert max(abs(run[n][-1]) for n in run.matching(columns[2])) < 1e-9  # each wheel weighs 10 N
