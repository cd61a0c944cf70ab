"""Inverse dynamics recovers the efforts of a run from its motion."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.reference.scenes.random_device_scenes import crossed
from tests.scalable_mechanisms import n_four_bar
from trunnion import SceneError, inverse, load_scene, simulate
from trunnion.analysis.mechanics.motion_files import read_motion
from trunnion.cli import main
from trunnion.scene.data_classes import scene as sm

CLOSE = 1e-8


def efforts(time: np.ndarray, i: int) -> np.ndarray:
    return 5.0 + 30.0 / (i + 1) * np.sin(2 * np.pi * 0.7 * time + 0.3 * i)


def arm(n: int = 3) -> sm.Scene:
    """An arm whose joints have friction, moved by sinusoidal torques."""
    bodies, joints = {}, {}
    for i in range(n):
        bodies[f"b{i}"] = sm.Body(box=(0.5, 0.05, 0.05), density=2700, center=(0.25, 0.0, 0.0), points={"tip": (0.5, 0.0, 0.0)})
        rub = sm.Friction(mu=0.2, radius=0.02, half_length=0.03)
        effort = sm.Signal(harmonic=sm.Harmonic(30.0 / (i + 1), 0.7, 0.3 * i, 5.0))
        inboard, axis = ("ground", "z") if i == 0 else (f"b{i - 1}.tip", "y")
        start = sm.Start(q=0.3, qd=1.0)
        joints[f"j{i}"] = sm.Joint("revolute", inboard, f"b{i}", axis=axis, friction=rub, effort=effort, start=start)
    return sm.Scene(bodies, joints, "arm")


def test_efforts_of_a_run_with_friction_are_found_again_from_its_motion() -> None:
    scene = arm()
    r = simulate(scene, until=0.3, every=0.001, rtol=1e-10)
    assert any(e.kind == "reversal" for e in r.events)
    motion = {n: r[n] for n in r.names if ".q[" in n or ".qd[" in n or ".qdd[" in n}
    found = inverse(scene, r.time, motion)
    assert not found.missing
    for i in range(3):
        assert found[f"j{i}.drive.effort[1]"] == pytest.approx(efforts(r.time, i), abs=CLOSE)
        assert found[f"j{i}.contact[1].normal_force"] == pytest.approx(r[f"j{i}.contact[1].normal_force"], rel=CLOSE)


def test_coordinates_alone_are_enough_where_nothing_turns_round() -> None:
    """The samples are 2 ms apart, and the splines have degree 5. The error of the accelerations is of fourth order in the
    spacing."""
    scene = arm(2)
    r = simulate(scene, until=0.2, every=0.002, rtol=1e-12)
    assert not any(e.kind == "reversal" for e in r.events)
    found = inverse(scene, r.time, {f"j{i}.q[1]": r[f"j{i}.q[1]"] for i in range(2)})
    for i in range(2):
        assert found[f"j{i}.drive.effort[1]"][5:-5] == pytest.approx(efforts(r.time, i)[5:-5], abs=1e-4)


@pytest.mark.default_cases(7)
@pytest.mark.parametrize("seed", range(12))
def test_loads_act_at_the_times_of_the_motion(seed: int) -> None:
    """J q̈ = u + τ(t) for a wheel on a shaft without friction."""
    rng = np.random.default_rng(seed)
    amplitude, frequency, phase, mean, inertia = rng.uniform(0.1, 3.0, 5)
    signals = (
        (sm.Signal(harmonic=sm.Harmonic(amplitude, frequency, phase, mean)),
         lambda t: mean + amplitude * np.sin(2 * np.pi * frequency * t + phase)),
        (sm.Signal(ramp=sm.Ramp(mean, amplitude, duration=0.5, begin=0.2)),
         lambda t: mean + (amplitude - mean) * np.clip((t - 0.2) / 0.5, 0.0, 1.0)),
        (sm.Signal(table=sm.Table((0.0, 0.4, 2.0), (mean, amplitude, phase), interpolation="linear")),
         lambda t: np.interp(t, (0.0, 0.4, 2.0), (mean, amplitude, phase))),
    )  # fmt: skip
    signal, torque = signals[seed % 3]
    wheel = sm.Body(mass=1.0, inertia=(inertia, inertia, inertia))
    shaft = sm.Joint("revolute", "ground", "wheel", axis="z")
    load = sm.Torque("torque", on="wheel", torque=(0.0, 0.0, signal), frame="world")
    scene = sm.Scene({"wheel": wheel}, {"shaft": shaft}, gravity=(0.0, 0.0, 0.0), forces={"load": load})
    t = np.linspace(0.0, 1.5, 40)
    q, qd, qdd = np.sin(3.0 * t), 3.0 * np.cos(3.0 * t), -9.0 * np.sin(3.0 * t)
    found = inverse(scene, t, {"shaft.q[1]": q, "shaft.qd[1]": qd, "shaft.qdd[1]": qdd})
    assert found["shaft.drive.effort[1]"] == pytest.approx(inertia * qdd - torque(t), abs=1e-12 * 10.0 * inertia + 1e-12)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(4))
def test_wheels_turn_on_by_more_than_a_tooth_from_time_to_time(seed: int) -> None:
    """The numbers of teeth determine the angles; the inertia seen by the first wheel determines the effort."""
    rng = np.random.default_rng(seed)
    teeth = [int(n) for n in rng.integers(12, 80, 4)]
    inertia = rng.uniform(0.01, 0.2, 4)
    at = np.cumsum([0.0, *(0.5e-3 * (a + b) for a, b in pairwise(teeth))])
    bodies = {f"w{i}": sm.Body(mass=1.0, inertia=(float(J),) * 3) for i, J in enumerate(inertia)}
    joints = {f"r{i}": sm.Joint("revolute", sm.Side("ground", (float(at[i]), 0.0, 0.0)), f"w{i}", axis="z") for i in range(4)}
    for i, pair in enumerate(pairwise(teeth)):
        joints[f"g{i}"] = sm.Joint("gear", f"w{i}", f"w{i + 1}", axis="z", teeth=pair, module=1e-3)
    ratio = np.cumprod([1.0, *(-a / b for a, b in pairwise(teeth))])
    t = np.linspace(0.0, 2.0, 40)
    q, qd, qdd = 4.0 * np.sin(3.0 * t), 12.0 * np.cos(3.0 * t), -36.0 * np.sin(3.0 * t)
    scene = sm.Scene(bodies, joints, "train", gravity=(0.0, 0.0, 0.0))
    found = inverse(scene, t, {"r0.q[1]": q, "r0.qd[1]": qd, "r0.qdd[1]": qdd}, outputs=["*.q[1]", "r0.drive.effort[1]"])
    for i in range(4):
        assert found[f"r{i}.q[1]"] == pytest.approx(ratio[i] * q, abs=1e-9)
    assert found["r0.drive.effort[1]"] == pytest.approx(inertia @ ratio**2 * qdd, abs=1e-9)


def test_in_a_loop_one_motion_takes_all_with_it() -> None:
    """The crank of a crank-slider follows the motion of a run. Its effort is zero, because no drive acted in the run."""
    scene = load_scene("crank_slider_free")
    r = simulate(scene, until=0.3, every=0.01, rtol=1e-10)
    crank = next(n for n, j in scene.joints.items() if j.type == "revolute" and "ground" in str(j.inboard))
    motion = {f"{crank}.{q}[1]": r[f"{crank}.{q}[1]"] for q in ("q", "qd", "qdd")}
    found = inverse(scene, r.time, motion)
    forces = max(float(np.abs(r[n]).max()) for n in r.matching("*.reaction.force[*]"))
    moving = np.abs(r[f"{crank}.qd[1]"]) > 1e-6  # at rest friction is not unique
    assert np.abs(found[f"{crank}.drive.effort[1]"][moving]).max() < 1e-6 * forces


def test_the_command_reads_what_a_run_wrote_and_any_table(tmp_path: Path) -> None:
    scene = load_scene("double_pendulum")
    source, out = tmp_path / "motion.csv", tmp_path / "efforts.csv"
    assert main(["simulate", "double_pendulum", "--until", "0.05", "-o", str(source)]) == 0
    joint = next(n for n, j in scene.joints.items() if j.type == "cylindrical")
    assert main(["inverse", "double_pendulum", "--motion", str(source), "-o", str(out)]) == 0
    with out.open() as file:
        rows = list(csv.DictReader(file))
    assert abs(float(rows[-1][f"{joint}.drive.effort[1]"])) < 1e-6  # no drive acted in the run
    plain = tmp_path / "plain.csv"
    times = np.linspace(0.0, 0.5, 20)
    body = "\n".join(f"{t},{0.1 * t**2}" for t in times)
    plain.write_text(f"time,pivot.q[1]\n{body}\n")
    assert main(["inverse", "simple_pendulum", "--motion", str(plain)]) == 0


def _rest(motion: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The rates and accelerations of the first wheel, and the motion of the flywheel, which is on no loop."""
    return {n: x for n, x in motion.items() if n in ("r0.qd[1]", "r0.qdd[1]") or n.startswith("free.")}


def test_wheel_pairs_and_other_joints_without_a_body_have_no_motion_of_their_own(tmp_path: Path) -> None:
    """A run also writes the coordinates of joints without a body. The other joints determine these coordinates."""
    scene, table = crossed("gear_trains", 3), tmp_path / "motion.csv"
    r = simulate(scene, until=0.02, every=0.005, rtol=1e-10)
    r.save(table)
    time, motion = read_motion(str(table), scene)
    assert {n.split(".")[0] for n in motion} == {"r0", "r1", "r2", "free"}
    found = inverse(scene, time, motion)
    assert not found.missing
    assert np.isfinite(found["g0.contact[1].normal_force"]).all()
    assert any("the drives share a load arbitrarily: r0.drive.effort[1], r1" in n for n in found.notes)
    assert not any("arbitrarily" in n for n in inverse(scene, time, {"r0.q[1]": motion["r0.q[1]"]} | _rest(motion)).notes)
    with pytest.raises(SceneError, match=r"motion\.g0\.q\[1\]: no such freedom of a gear joint can be prescribed"):
        inverse(scene, time, motion | {"g0.q[1]": r["g0.q[1]"]})


@pytest.mark.parametrize("made", [n_four_bar(1), crossed("screws_in_loops", 3)], ids=lambda s: s.name)
def test_a_table_of_a_run_prescribes_all_joints_of_a_loop_but_one(made: sm.Scene, tmp_path: Path) -> None:
    table = tmp_path / "motion.csv"
    r = simulate(made, until=0.02, every=0.005)
    r.save(table)
    time, motion = read_motion(str(table), made)
    assert not inverse(made, time, motion).missing
    every = {n: r[n] for n in r.names if n.endswith(".q[1]") and n.split(".")[0] in made.joints}
    with pytest.raises(SceneError, match="all joints of its loop are prescribed"):
        inverse(made, time, every)


def test_times_at_which_the_forces_have_no_solution_are_named_and_the_others_computed() -> None:
    """The rows of a run prescribe both joints of a cam's loop, with friction at the cam."""
    scene = crossed("cams", 21003)
    r = simulate(scene, until=0.16, every=0.02, rtol=1e-10)
    found = inverse(scene, r.time, {f"{n}.{q}[1]": r[f"{n}.{q}[1]"] for n in ("guide", "turn") for q in ("q", "qd", "qdd")})
    without = np.isnan(found.values).any(axis=1)
    assert 0 < np.count_nonzero(without) < len(r.time)
    assert [m.split(":")[0] for m in found.missing] == [f"t = {t:g} s" for t in r.time[without]]


def test_every_mistake_in_a_motion_is_reported() -> None:
    scene, t = arm(1), np.linspace(0.0, 1.0, 4)
    motion = {"j0.q[2]": t, "j0.qd[1]": t, "elbow.q[1]": t, "j0.qdd[1]": t[:2]}
    with pytest.raises(SceneError) as told:
        inverse(scene, t, motion)
    assert {p.where for p in told.value.problems} == {"motion.j0.q[2]", "motion.j0.q[1]", "motion.elbow.q[1]", "motion.j0.qdd[1]"}
    with pytest.raises(SceneError, match="at least"):
        inverse(scene, t, {"j0.q[1]": t})
    with pytest.raises(SceneError, match="no freedom"):
        inverse(replace(scene, name="other"), t, {})


def test_an_effort_at_rest_is_the_weights_torque_and_a_note_tells_that_friction_could_carry_it() -> None:
    """The arm stands near its lowest position, where friction alone holds it in a run. When it moves, there is no note."""
    mass, length, angle = 2.0, 0.6, 0.002
    rub = sm.Friction(mu=0.12, radius=0.008, half_length=0.015)
    arm = sm.Body(box=(length, 0.04, 0.04), mass=mass, center=(length / 2, 0.0, 0.0))
    pin = sm.Joint("revolute", "ground", "arm", axis="y", friction=rub, start=sm.Start(q=np.pi / 2 + angle))
    scene = sm.Scene({"arm": arm}, {"pin": pin}, "arm")
    run = simulate(scene, until=0.1, every=0.02)
    assert not run["pin.qd[1]"].any()
    motion = {c: run[c] for c in ("pin.q[1]", "pin.qd[1]", "pin.qdd[1]")}
    found = inverse(scene, run.time, motion)
    assert np.abs(found["pin.drive.effort[1]"]) == pytest.approx(np.full(6, mass * 9.81 * length / 2 * np.sin(angle)), rel=1e-9)
    assert [n for n in found.notes if "at rest at 6 of 6 instants" in n]
    assert not inverse(scene, run.time, motion | {"pin.qd[1]": np.ones(6)}).notes
