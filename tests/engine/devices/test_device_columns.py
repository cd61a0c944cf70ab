"""Columns of springs, dampers, stops, efforts and drives give their forces and powers. Together they include every source and sink
of energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from tests.reference.mechanics.time_signals import load_value
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model, simulate

EXACT = 1e-9
CASES = {f"{make.__name__} {seed}": (make, seed) for make in (random_tree, random_loop) for seed in range(6)}
WORDS = (".spring.", ".damper.", ".stop.", ".effort", ".power", ".length", ".force")


def case_of(which: str) -> Case:
    make, seed = CASES[which]
    return make(seed, t=0.3, devices=0.9)


def each(given, count: int) -> list:
    """The columns of a joint for each of its freedoms."""
    return list(given) if isinstance(given, tuple) else [given] + [None] * (count - 1)


def stopped(s: sm.EndStops, q: float, rate: float) -> float:
    total = 0.0
    for bound, sign in ((s.lower, 1), (s.upper, -1)):
        depth = sign * (bound - q) if bound is not None else 0.0
        if depth > 0.0:
            total += sign * s.stiffness * depth * max(1 - s.damping * sign * rate, 0.0)
    return total


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("which", CASES)
def test_efforts_of_devices_are_what_their_formulas_say(which: str, kernel: str) -> None:
    case = case_of(which)
    scene, row = case.scene, evaluate(Model(case.scene, ("*",), kernel=kernel), case.q, case.qd, case.t)
    expected = {}
    for name, j in scene.joints.items():
        kind = REGISTRY[j.type]
        for k in range(kind.nv):
            i = kind.coordinate_of(k)
            q, rate = row[f"{name}.q[{i + 1}]"] if i >= 0 else 0.0, row[f"{name}.qd[{k + 1}]"]
            spring, damping, stops, effort = (each(x, kind.nv)[k] for x in (j.spring, j.damping, j.end_stops, j.effort))
            said = {
                "spring.effort": spring and -spring.stiffness * (q - spring.rest),
                "damper.effort": None if damping is None else -damping * rate,
                "end_stop.effort": stops and stopped(stops, q, rate),
                "effort": None if effort is None else load_value(scene, effort, case.t),
            }
            for word, value in said.items():
                if value is not None:
                    expected[f"{name}.{word}[{k + 1}]"] = value
                    expected[f"{name}.{word.partition('.')[0]}.power[{k + 1}]"] = value * rate
            if f"{name}.drive.effort[{k + 1}]" in row:
                expected[f"{name}.drive.reaction[{k + 1}]"] = -row[f"{name}.drive.effort[{k + 1}]"]
                expected[f"{name}.drive.power[{k + 1}]"] = row[f"{name}.drive.effort[{k + 1}]"] * rate
    words = (*WORDS[:5], ".drive.reaction")
    told = {n for n in row if any(w in n for w in words) and n.partition(".")[0] in scene.joints and ".drive.effort" not in n}
    assert told == set(expected)
    for n, value in expected.items():
        assert row[n] == pytest.approx(value, rel=EXACT, abs=EXACT), n


def test_a_spring_between_points_reports_its_length_force_and_power() -> None:
    ends = ("block.tip", "ground")
    spring = sm.SpringDamper("spring_damper", ends, stiffness=200.0, damping=3.0, length=0.5)
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=2.0, points={"tip": (0.05, 0.02, 0.0)})
    scene = sm.Scene({"block": body}, {"free": sm.Joint("free", "ground", "block", start=sm.Start(qd=(1.0, 0.5, 0, 0, 2.0, 0)))},
                     "hung", forces={"rubber": spring})  # fmt: skip
    r = simulate(scene, until=0.5, every=1e-3, rtol=1e-11)
    tip = np.array([r[f"block.tip.position[{k}]"] for k in (1, 2, 3)])
    length = np.linalg.norm(tip, axis=0)
    rate = make_interp_spline(r.time, length, k=5).derivative()(r.time)
    assert r["rubber.length"] == pytest.approx(length, rel=1e-12)
    inside = slice(10, -10)  # except near its ends, the rate of a spline is precise to 1e-9
    assert r["rubber.force"][inside] == pytest.approx((200.0 * (length - 0.5) + 3.0 * rate)[inside], abs=1e-6)
    assert r["rubber.power"][inside] == pytest.approx((-r["rubber.force"] * rate)[inside], abs=1e-5)


def test_powers_and_friction_are_all_that_changes_energy() -> None:
    """The test compares changes of kinetic and gravitational energy with the integral of all columns of power, where these are
    smooth."""
    body = sm.Body(box=(0.6, 0.05, 0.05), mass=2.0, center=(0.3, 0.0, 0.0))
    rub = sm.Friction(mu=0.2, radius=0.01, half_length=0.02)
    motor = sm.Signal(harmonic=sm.Harmonic(3.0, 0.6, 0.0, 4.0))
    hinge = sm.Joint("revolute", "ground", "arm", axis="y", friction=rub, spring=sm.Spring(4.0, 0.3), damping=0.2, effort=motor)
    r = simulate(sm.Scene({"arm": body}, {"hinge": hinge}, "arm"), until=0.4, every=1e-3, rtol=1e-11)
    powers = sum(r[n] for n in r.matching("hinge.*.power[1]")) - r["hinge.friction.torque[1]"] * r["hinge.qd[1]"]
    weight = 2.0 * 9.81 * 0.3 * np.cos(r["hinge.q[1]"]) * r["hinge.qd[1]"]
    work = make_interp_spline(r.time, powers + weight, k=5).antiderivative()(r.time)
    assert not r.events
    assert r["energy.kinetic"] == pytest.approx(work, abs=1e-9 * np.abs(work).max())


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("which", CASES)
def test_both_kernels_report_the_same_of_every_device(which: str) -> None:
    case = case_of(which)
    a, b = (evaluate(Model(case.scene, ("*",), kernel=k), case.q, case.qd, case.t) for k in ("parts", "compiled"))
    for n in (n for n in a if any(w in n for w in WORDS)):
        assert a[n] == pytest.approx(b[n], rel=EXACT, abs=EXACT), n
