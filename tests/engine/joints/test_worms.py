"""Worms drive, are driven and lock according to textbook formulas. Their forces act at the pitch point, in space."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.engine.mechanisms.gear_pairs import flying, unit
from tests.engine.mechanisms.worm_gears import Worm, random_worm
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.reference.mechanics.rotation import matrix_from_quaternion
from tests.reference.scenes.random_scenes import Case
from tests.reference.scenes.unit_changes import rescaled
from trunnion import Scene, SceneError, hold, sensitivity, simulate
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text

USUAL = Worm(2, 40, 0.004, math.radians(8), math.radians(20), 0.05)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_worm_drives_and_is_driven_by_the_standard_formulas(seed: int) -> None:
    """The test compares torques and the three components of the tooth force to 1e-12."""
    w, load = random_worm(seed), float(np.random.default_rng(seed).uniform(1, 50))
    for drives in (True, False):
        rate = (1 if drives else -1) * math.copysign(10.0, w.turns)  # rate of the worm; the load turns the wheel backward
        scene = w.scene({"drive": {"constant": {"rate": rate}}}, {"effort": -load})
        r = simulate(scene, until=0.01, every=0.01, rtol=1e-10, kernel="compiled" if seed % 40 == 2 else "parts")
        wheel, worm, apart, torque = w.forces(load, drives)
        assert r["wheel_shaft.qd[1]"][1] == pytest.approx(w.turns * rate, rel=1e-10)
        assert math.copysign(1, w.turns) * r["worm_shaft.drive.effort[1]"][1] == pytest.approx(torque, rel=1e-12, abs=1e-12 * load)
        axial, radial, circle = (r[f"mesh.reaction.force[{k}]"][1] for k in (1, 2, 3))
        assert (abs(axial), -radial, abs(circle)) == pytest.approx((wheel, apart, abs(worm)), rel=1e-12, abs=1e-12 * wheel)
        assert r["mesh.contact[1].normal_force"][1] == pytest.approx(apart / math.sin(w.pressure), rel=1e-12)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(20))
def test_a_worm_locks_itself_where_its_lead_is_below_the_angle_of_friction(seed: int) -> None:
    """Without a torque on the worm, the limit is tan γ cos α = μ. ``hold`` agrees."""
    w = random_worm(seed)
    limit = math.tan(abs(w.lead)) * math.cos(w.pressure)
    for more in (1e-6, -1e-6):
        pair = replace(w, mu=limit * (1 + more)).scene({}, {"effort": -5.0})
        r = simulate(pair, until=2.0, every=1.0, outputs=["wheel_shaft.q[1]"])
        assert bool(abs(r["wheel_shaft.q[1]"][-1]) > 1e-9) == (more < 0)
        assert hold(pair).holds == (more > 0)


def test_a_worm_at_rest_is_at_rest_in_millimetres_and_grams() -> None:
    """Neither body has a size, so the radius of gyration is the scale. (With 1 m as the scale, the round-off of the load's work
    over 20 s counts as an error of energy.)"""
    w = random_worm(0)
    still = replace(w, mu=1.5 * math.tan(abs(w.lead)) * math.cos(w.pressure)).scene({}, {"effort": -5.0})
    shafts = dict.fromkeys(("worm_shaft", "wheel_shaft"), np.zeros(1))
    for scene in (still, rescaled(Case(still, shafts, shafts, 0.0, True), 1e3, 1e3, 1.0).case.scene):
        r = simulate(scene, until=20.0, every=20.0, outputs=["wheel_shaft.q[1]"])
        assert (r.outcome.name, r.audit.verdict) == ("done", "within")
        assert abs(r["wheel_shaft.q[1]"][-1]) < 1e-11


def in_flight(seed: int, friction: sm.Friction | None) -> tuple[Scene, dict[str, np.ndarray]]:
    """A worm and its wheel, out of balance, on a carrier in free flight. Also returns the vectors of the pair in the axes of the
    carrier."""
    f, rng, w = flying(seed, ("gear",)), np.random.default_rng([3, seed]), random_worm(seed)
    a, at = unit(rng.normal(size=3)), 0.3 * rng.normal(size=3)
    u = unit(np.cross(a, rng.normal(size=3)))
    b = w.side * np.cross(u, a)  # the sense of u, for which side · (a × b) = u
    away = at + (w.r1 + w.r2) * u + 0.01 * a + 0.02 * b
    scene = f.scene
    joints = {"fly": scene.joints["fly"]}
    for n, point, axis in (("w0", at, a), ("w1", away, b)):
        side = sm.Side("carrier", point=tuple(map(float, point)))
        joints[f"on_{n}"] = replace(scene.joints[f"on_{n}"], inboard=side, axis=tuple(map(float, axis)))
    sides = [sm.Side(n, axis=tuple(map(float, v))) for n, v in (("w0", a), ("w1", b))]
    joints["m0"] = sm.Joint("worm", *sides, teeth=(float(w.threads), float(w.teeth)), module=w.module, lead_angle=w.lead,
                            friction=friction)  # fmt: skip
    spot = at + w.r1 * u + 0.01 * a
    return replace(scene, joints=joints), {"a": a, "b": b, "u": u, "spot": spot, "p0": at, "p1": away}


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(20))
def test_the_force_of_a_worm_acts_at_the_pitch_point_of_both_wheels(seed: int) -> None:
    """In a second scene, the reported force acts on both wheels at the pitch point in place of the pair. The accelerations are the
    same."""
    scene, at = in_flight(seed, sm.Friction(mu=0.08, pressure_angle=0.35))
    r = simulate(scene, until=1e-3, every=1e-3)
    R = matrix_from_quaternion(np.array([r[f"carrier.orientation[{k}]"][0] for k in (1, 2, 3, 4)]))
    E = np.column_stack([at["a"], at["u"], np.cross(at["a"], at["u"])])
    force = R @ E @ np.array([r[f"m0.reaction.force[{k}]"][0] for k in (1, 2, 3)])
    joints = {n: j for n, j in scene.joints.items() if n != "m0"}
    bodies, loads = dict(scene.bodies), {}
    for n, sign, p in (("w0", 1, at["p0"]), ("w1", -1, at["p1"])):
        joints[f"on_{n}"] = replace(joints[f"on_{n}"], start=sm.Start(qd=float(r[f"on_{n}.qd[1]"][0])))
        spot = tuple(map(float, at["spot"] - p))  # at the start, the axes of all bodies are parallel
        bodies[n] = replace(bodies[n], points={"mesh": spot})
        loads[f"push_{n}"] = sm.Force("force", f"{n}.mesh", tuple(map(float, sign * force)))
    columns = ["*.qdd[*]", "*.acceleration*"]
    alone = simulate(replace(scene, bodies=bodies, joints=joints, forces=loads), until=1e-3, every=1e-3, outputs=columns)
    for c in alone.columns[1:]:
        assert r[c.name][0] == pytest.approx(alone[c.name][0], rel=1e-8, abs=1e-8), c.name


def test_a_worm_without_friction_keeps_energy_in_free_flight_and_stays_in_mesh() -> None:
    for seed in range(3):
        scene, _ = in_flight(seed, None)
        r = simulate(scene, until=0.2, every=0.1, rtol=1e-10)
        assert np.abs(r["energy.residual"]).max() < 1e-8 * r["energy.kinetic"].max()
        assert r["on_w1.qd[1]"] == pytest.approx(random_worm(seed).turns * r["on_w0.qd[1]"], rel=1e-9)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_both_kernels_write_the_same_with_a_worm(seed: int) -> None:
    agree(in_flight(seed, sm.Friction(mu=0.1, pressure_angle=0.35))[0], redundant=seed % 2 == 1)


def test_derivatives_of_a_run_with_a_worm_are_those_of_the_standard_formulas() -> None:
    scene = USUAL.scene({"drive": {"constant": {"rate": 10}}}, {"effort": -5.0})
    found = sensitivity(scene, ("joints.mesh.friction.mu",), ("worm_shaft.drive.effort[1]",), until=0.01, every=0.01, rtol=1e-10)
    up, down = (replace(USUAL, mu=USUAL.mu + x).forces(5.0, True)[3] for x in (1e-6, -1e-6))
    slope = found.d("worm_shaft.drive.effort[1]", "joints.mesh.friction.mu")[1]
    assert slope == pytest.approx((up - down) / 2e-6, rel=1e-7)


def test_the_worm_drive_of_the_guide_agrees_with_hand_calculation() -> None:
    page = (Path(trunnion.__file__).parent / "docs/guide/friction.md").read_text(encoding="utf-8")
    scene = scene_from_text(page.split("```yaml\n")[2].split("```")[0])
    assert scene.name == "worm_drive"
    r = simulate(scene, until=0.01, every=0.01)
    torque = 100 / 0.08 * (0.1405408 + 0.0532089) / (1 - 0.0532089 * 0.1405408) * 0.004 / 0.1405408
    assert r["drive.drive.effort[1]"][1] == pytest.approx(torque, rel=1e-5)


WRONG = {
    "a worm needs a lead angle, not 0": {"lead": 0.0},
    "lead_angle must lie between -1.5 and 1.5": {"lead": 2.0},
    "the axes of worm and wheel are 0.108461 m apart": {"module": 0.0041},
}


@pytest.mark.parametrize("says", WRONG)
def test_impossible_worms_are_refused_with_the_reason(says: str) -> None:
    scene = USUAL.scene({}, {})
    changes = {{"lead": "lead_angle"}.get(k, k): v for k, v in WRONG[says].items()}
    wrong = replace(scene, joints=scene.joints | {"mesh": replace(scene.joints["mesh"], **changes)})
    with pytest.raises(SceneError, match=re.escape(says)):
        simulate(wrong, until=0.01)
    askew = replace(scene.joints["mesh"], outboard=sm.Side("wheel", axis="x"))
    with pytest.raises(SceneError, match="not at a right angle"):
        simulate(replace(scene, joints=scene.joints | {"mesh": askew}), until=0.01)
