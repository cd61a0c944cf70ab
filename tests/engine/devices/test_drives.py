"""Prescribed motion is exact. The effort of a drive agrees with the balance of energy."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from trunnion.elements.joints import REGISTRY
from trunnion.scene.checks import problems
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

LINK = sm.Body(box=(0.3, 0.1, 0.1), mass=2.0, center=(0.15, 0.0, 0.0), points={"e": (0.3, 0.0, 0.0)})
CONSTANT = sm.Constant(rate=0.5, start=-0.2)
RAMP = sm.Ramp(start=-1.0, end=2.0, duration=0.7, begin=0.2, origin=0.4)
HARMONIC = sm.Harmonic(amplitude=0.6, frequency=0.8, phase=0.3, offset=0.1)
TABLE = sm.Table(time=(0.1, 0.3, 0.7, 1.0, 1.6), value=(0.0, 0.2, -0.1, 0.3, 0.25))
DRIVES = {"slide": CONSTANT, "first": RAMP, "second": HARMONIC, "shaft": TABLE}


def scene() -> sm.Scene:
    """A chain with one drive of each kind. A drive moves the shaft along its axis, and the shaft turns freely."""
    joints = {
        "slide": sm.Joint("prismatic", "ground", "b1", axis="x", drive=sm.Drive(constant=CONSTANT)),
        "first": sm.Joint("revolute", "b1.e", "b2", axis="z", drive=sm.Drive(ramp=RAMP)),
        "second": sm.Joint("revolute", "b2.e", "b3", axis="y", drive=sm.Drive(harmonic=HARMONIC)),
        "shaft": sm.Joint(
            "cylindrical", "b3.e", "b4", axis="x", drive=(sm.Drive(table=TABLE), None), start=sm.Start((0.0, 0.3), (0.0, 1.0))
        ),
    }
    return sm.Scene({f"b{i}": LINK for i in (1, 2, 3, 4)}, joints, "driven")


def constant(t: np.ndarray) -> tuple[np.ndarray, ...]:
    return CONSTANT.start + CONSTANT.rate * t, CONSTANT.rate + 0 * t, 0 * t


def ramp(t: np.ndarray) -> tuple[np.ndarray, ...]:
    """The rate changes from start to end; the coordinate begins at origin."""
    s = np.clip((t - RAMP.begin) / RAMP.duration, 0.0, 1.0)
    rate = RAMP.start + (RAMP.end - RAMP.start) * s
    before, within, after = np.minimum(t, RAMP.begin), RAMP.duration * s, np.maximum(t - RAMP.begin - RAMP.duration, 0.0)
    q = RAMP.origin + RAMP.start * (before + within) + (RAMP.end - RAMP.start) * within * s / 2 + RAMP.end * after
    return q, rate, np.where((s > 0) & (s < 1), (RAMP.end - RAMP.start) / RAMP.duration, 0.0)


def harmonic(t: np.ndarray) -> tuple[np.ndarray, ...]:
    w, a = 2 * np.pi * HARMONIC.frequency, HARMONIC.amplitude
    x = w * t + HARMONIC.phase
    return HARMONIC.offset + a * np.sin(x), a * w * np.cos(x), -a * w * w * np.sin(x)


def table(t: np.ndarray) -> tuple[np.ndarray, ...]:
    """(q, q̇, q̈) of a natural spline that continues straight outside its points."""
    s, first, last = CubicSpline(TABLE.time, TABLE.value, bc_type="natural"), TABLE.time[0], TABLE.time[-1]
    inside = np.clip(t, first, last)
    return s(inside) + s(inside, 1) * (t - inside), s(inside, 1), np.where((t > first) & (t < last), s(t, 2), 0.0)


MOTIONS = {"slide": constant, "first": ramp, "second": harmonic, "shaft": table}


@cache
def driven() -> Result:
    """A run of the drives. Accelerations jump at the kinks of ramp and table."""
    r = simulate(scene(), until=2.0, every=0.004, rtol=1e-10)
    assert r.outcome.ok
    return r


@pytest.mark.parametrize("joint", DRIVES)
def test_a_drive_follows_its_data(joint: str) -> None:
    r = driven()
    q, qd, qdd = MOTIONS[joint](r.time)
    kinks = [0.2, 0.9, *TABLE.time]
    away = np.min(np.abs(np.subtract.outer(r.time, kinks)), axis=1) > 1e-6
    assert np.abs(r[f"{joint}.q[1]"] - q).max() <= 1e-13
    assert np.abs(r[f"{joint}.qd[1]"] - qd).max() <= 1e-12
    # the second derivative of the spline divides round-off by squares of short intervals
    assert np.abs(r[f"{joint}.qdd[1]"] - qdd)[away].max() <= 1e-11


def test_efforts_of_drives_are_what_changes_the_energy() -> None:
    """The test compares kinetic and potential energy with the integral of Σ effort · rate, by Simpson's rule over the rows of
    smooth intervals."""
    r = driven()
    power = sum(r[f"{j}.drive.effort[1]"] * r[f"{j}.qd[1]"] for j in DRIVES)
    energy = r["energy.kinetic"] + r["energy.potential"]
    for a, b in ((0.304, 0.696), (1.004, 1.596), (1.604, 2.0)):
        part = (r.time > a - 1e-9) & (r.time < b + 1e-9)
        work = cumulative_simpson(power[part], x=r.time[part], initial=0.0)
        # the error of Simpson's rule at a spacing of 4 ms
        assert np.abs(energy[part] - energy[part][0] - work).max() <= 1e-6 * np.ptp(work)
    assert np.abs(r["energy.residual"]).max() <= 1e-8 * np.abs(power).max()


def test_the_free_freedom_beside_a_driven_one_moves_freely() -> None:
    r = driven()
    assert np.ptp(r["shaft.qd[2]"]) > 0.5
    assert "shaft.drive.effort[2]" not in r


def test_a_mechanism_without_any_freedom_left_runs() -> None:
    """All motion is prescribed. The mechanism has no states, only statics and inertia."""
    joint = sm.Joint("revolute", "ground", "b", axis="y", drive=sm.Drive(harmonic=HARMONIC))
    r = simulate(sm.Scene({"b": LINK}, {"j": joint}), until=1.0, every=0.01)
    q, _, qdd = harmonic(r.time)
    inertia = 2.0 * (0.3**2 + 0.1**2) / 12 + 2.0 * 0.15**2
    weight = 2.0 * 9.81 * 0.15 * np.cos(q)  # about y, q > 0 lowers the end, so its moment about y is positive
    assert r["j.q[1]"] == pytest.approx(q, abs=1e-14)
    assert r["j.drive.effort[1]"] == pytest.approx(inertia * qdd - weight, abs=1e-12)
    assert r["j.reaction.torque[1]"] == pytest.approx(-r["j.drive.effort[1]"], abs=1e-12)


def test_a_mechanism_without_any_freedom_left_accounts_for_its_energy() -> None:
    joint = sm.Joint("revolute", "ground", "b", axis="y", drive=sm.Drive(harmonic=HARMONIC))
    r = simulate(sm.Scene({"b": LINK}, {"j": joint}), until=1.0, every=0.01)
    power = r["j.drive.effort[1]"] * r["j.qd[1]"]
    # limit in J: 1e-4 of the energy of 1 s of motion; rtol is 1e-6
    assert np.abs(r["energy.residual"]).max() <= 1e-4 * np.abs(power).max()


def test_a_drive_overrides_start_values_of_its_freedom() -> None:
    joint = sm.Joint("revolute", "ground", "b", axis="z", drive=sm.Drive(constant=CONSTANT), start=sm.Start(3.0, 9.0))
    r = simulate(sm.Scene({"b": LINK}, {"j": joint}), until=0.1, every=0.1)
    assert (r["j.q[1]"][0], r["j.qd[1]"][0]) == (CONSTANT.start, CONSTANT.rate)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "cylindrical", "planar", "free"])
def test_a_driven_joint_of_a_loop_is_driven(kind: str) -> None:
    """The joints of two bodies to the ground have more devices than the driven joint. By the rule for cuts alone, the driven joint
    would be cut."""
    count = REGISTRY[kind].nv
    drive = sm.Drive(constant=sm.Constant(rate=0.5, start=0.1))
    ties = {f"tie_{n}": sm.Joint("free", "ground", n, damping=(1.0,) * 6, effort=(0.0,) * 6) for n in "bc"}
    driven = sm.Joint(kind, "b", "c", axis=None if kind == "free" else "z", drive=(drive, *[None] * (count - 1)))
    bodies = {n: sm.Body(box=(0.2, 0.1, 0.3), density=1000.0) for n in "bc"}
    scene = sm.Scene(bodies, {**ties, "driven": driven}, gravity=(0, 0, 0))
    r = simulate(scene, until=0.5, every=0.25, outputs=["driven.q[1]"])
    assert r["driven.q[1]"] == pytest.approx([0.1, 0.225, 0.35], abs=1e-9)
    told = problems(replace(scene, joints=scene.joints | {"driven": replace(driven, cut=True)}))
    assert any("a driven joint cannot be cut" in str(p) for p in told)
