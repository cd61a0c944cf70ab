"""Warnings about clearance: a pin crosses its bearing in the time and with the speed of a simulated gap. For a vanishing gap, the
result tends to the ideal joint."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import trunnion
from trunnion import SceneError, knocks, simulate
from trunnion.analysis.mechanics.joint_clearances import clearances_of, free_mobility, restrict_mobility, rotation_at
from trunnion.cli import main
from trunnion.scene.data_classes import scene as sm

MASS, PULL, HERTZ, CLEARANCE = 2.0, 30.0, 3.0, 20e-6
RATE = 2 * np.pi * HERTZ
LOOP = "quick_return"
PIN = sm.Friction(mu=0.05, radius=0.01, half_length=0.02)
WAVE = sm.Signal(harmonic=sm.Harmonic(PULL, HERTZ))
BODY = sm.Body(mass=MASS, inertia=(0.01, 0.01, 0.01))


def shaken(direction: float = 0.0, **joint) -> sm.Scene:
    """A hub on a pin; an alternating force acts through its middle. direction: angle of the force about the pin from x, rad."""
    hinge = sm.Joint("revolute", "ground", "hub", axis="y", **{"friction": PIN, **joint})
    x, z = (sm.Signal(harmonic=sm.Harmonic(PULL * part, HERTZ)) for part in (np.cos(direction), np.sin(direction)))
    push = sm.Force("force", "hub", (x, 0.0, z) if direction else (WAVE, 0.0, 0.0))
    return sm.Scene({"hub": BODY}, {"pin": hinge}, "shaken", gravity=(0.0, 0.0, 0.0), forces={"push": push})


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("direction", [0.0, *np.random.default_rng(5).uniform(-np.pi, np.pi, 6)])
@pytest.mark.parametrize("pin", ["inboard", "outboard"])
def test_a_pin_crosses_as_the_sine_that_drives_it_says(pin: str, direction: float) -> None:
    """Motion in the clearance from rest, where the force reverses: m s̈ = P sin ωt, P/(m ω²) (ωt − sin ωt) = 2c, v = P/(m ω) (1 −
    cos ωt)."""
    r = simulate(shaken(direction, pin=pin), until=0.95, every=1e-3)
    found = knocks(r, CLEARANCE)
    t = brentq(lambda t: PULL / (MASS * RATE**2) * (RATE * t - np.sin(RATE * t)) - 2 * CLEARANCE, 1e-9, 0.5 / HERTZ)
    assert [k.time for k in found] == pytest.approx([k / (2 * HERTZ) for k in range(1, 6)], abs=1e-9)
    for k in found:
        assert (k.joint, k.turn, k.way, k.mass) == ("pin", pytest.approx(np.pi), pytest.approx(2 * CLEARANCE), pytest.approx(MASS))
        assert k.flight == pytest.approx(t, rel=1e-6)
        assert k.speed == pytest.approx(PULL / (MASS * RATE) * (1 - np.cos(RATE * t)), rel=1e-6)
        assert k.energy == pytest.approx(0.5 * MASS * k.speed**2)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("pin", ["inboard", "outboard"])
@pytest.mark.parametrize("kind", ["revolute", "spherical"])
def test_the_impact_is_at_the_contact_of_the_ideal_joint_after_the_reversal(kind: str, pin: str) -> None:
    """Normal and angle of the impact equal normal and angle of the ideal joint's contact just after the force has reversed."""
    rub = PIN if kind == "revolute" else sm.Friction(mu=0.05, radius=0.01)
    axis = "y" if kind == "revolute" else None
    joint = sm.Joint(kind, "ground", "hub", axis=axis, pin=pin, friction=rub)
    push = sm.Force("force", "hub", (WAVE, 0.0, 0.0))
    scene = sm.Scene({"hub": BODY}, {"pin": joint}, "shaken", gravity=(0.0, 0.0, 0.0), forces={"push": push})
    r = simulate(scene, until=0.3, every=1e-3)
    first = knocks(r, CLEARANCE)[0]
    row = int(np.searchsorted(r.time, first.time + first.flight))
    assert first.normal == pytest.approx([r[f"pin.contact[1].normal[{k}]"][row] for k in (1, 2, 3)], abs=1e-9)
    apart = first.angle - r["pin.contact[1].angle"][row]
    assert np.exp(1j * apart) == pytest.approx(1.0, abs=1e-9)


def held_by(kind: str, rng: np.random.Generator) -> tuple[sm.Scene, list[float]]:
    """A body that a joint of this kind holds at rest, under an alternating force through its joint. Also returns, for each
    clearance, the component of the force along the clearance: across the pin, or normal to the faces."""
    pin = str(rng.choice(["inboard", "outboard"]))
    push = rng.normal(size=3)
    push /= np.linalg.norm(push)
    e1, e2, e3 = np.eye(3)
    center, start = (0.0, 0.0, 0.0), None
    if kind == "prismatic":
        rub = sm.Friction(mu=0.05, half_width=0.01, half_height=0.015, half_length=0.02)
        # the mass centre is where the sleeve neither tilts nor slides
        push[0], center = 0.0, (0.0, *(float(x) for x in rng.uniform(-0.05, 0.05, 2)))
        sizes = [push @ e2, push @ e3]
    elif kind == "cylindrical":
        rub, push[0] = PIN, 0.0
        sizes = [np.linalg.norm(push)]
    else:
        rub = sm.Friction(mu=0.05, radius=(0.01, 0.01), half_length=(0.02, 0.02))
        angles = rng.uniform(-0.8, 0.8, 2)
        start = sm.Start(q=tuple(float(a) for a in angles))
        u2 = np.array([0.0, np.cos(angles[0]), np.sin(angles[0])])
        sizes = [np.linalg.norm(np.cross(push, u)) for u in (e1, u2)]
    joint = sm.Joint(kind, "ground", "hub", axis="x", reference="y", pin=pin, friction=rub, start=start)
    waves = tuple(sm.Signal(harmonic=sm.Harmonic(PULL * float(x), HERTZ)) for x in push)
    body = sm.Body(mass=MASS, inertia=(0.01, 0.01, 0.01), center=center)
    scene = sm.Scene({"hub": body}, {"pin": joint}, kind, gravity=(0.0, 0.0, 0.0), forces={"push": sm.Force("force", "hub", waves)})
    return scene, [abs(float(x)) for x in sizes]


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("kind", ["prismatic", "cylindrical", "universal"])
@pytest.mark.parametrize("seed", range(36))
def test_sleeves_shafts_and_crosses_cross_as_the_sine_that_drives_them_says(kind: str, seed: int) -> None:
    """The component of the force across a clearance causes impacts in this clearance. An impact is at the contact that carries the
    load afterwards."""
    scene, sizes = held_by(kind, np.random.default_rng(seed))
    r = simulate(scene, until=0.3, every=1e-3)
    found = knocks(r, CLEARANCE)
    for part, size in enumerate(sizes, 1):
        own, pull = [k for k in found if k.part == part], PULL * size
        t = brentq(lambda t, pull=pull: pull / (MASS * RATE**2) * (RATE * t - np.sin(RATE * t)) - 2 * CLEARANCE, 1e-9, 0.5 / HERTZ)
        assert own[0].time == pytest.approx(1 / (2 * HERTZ), abs=1e-9)
        for k in own:
            assert (k.way, k.mass) == (pytest.approx(2 * CLEARANCE), pytest.approx(MASS))
            assert k.flight == pytest.approx(t, rel=1e-5)
            assert k.speed == pytest.approx(pull / (MASS * RATE) * (1 - np.cos(RATE * t)), rel=1e-5)
        row = int(np.searchsorted(r.time, own[0].time + own[0].flight))
        if kind == "prismatic":
            face = np.eye(3)[part] * np.sign(r[f"pin.reaction.force[{part + 1}]"][row])
            assert own[0].normal == pytest.approx(-face if scene.joints["pin"].pin == "inboard" else face, abs=1e-9)
            continue
        contact = f"pin.contact[{2 * part - 1}]"
        assert own[0].normal == pytest.approx([r[f"{contact}.normal[{k}]"][row] for k in (1, 2, 3)], abs=1e-9)
        assert np.exp(1j * (own[0].angle - r[f"{contact}.angle"][row])) == pytest.approx(1.0, abs=1e-9)


def test_time_and_speed_of_an_impact_equal_those_of_a_simulated_gap() -> None:
    """The hub is on a rail between two hard stops. It rests on one stop until the force reverses."""
    stops = sm.EndStops(stiffness=1e9, lower=-CLEARANCE, upper=CLEARANCE)
    back = sm.Signal(harmonic=sm.Harmonic(PULL, HERTZ, phase=np.pi))
    rail = sm.Joint("prismatic", "ground", "hub", axis="x", end_stops=stops, effort=back, start=sm.Start(q=CLEARANCE))
    gap = simulate(sm.Scene({"hub": BODY}, {"rail": rail}, "gap", gravity=(0.0, 0.0, 0.0)), until=0.1, every=0.0, rtol=1e-10)
    hit = next(e for e in gap.events if e.kind == "end_stop_engaged" and e.time > 1e-6)
    [first, *_] = knocks(simulate(shaken(), until=0.5, every=1e-3), CLEARANCE)
    assert first.flight == pytest.approx(hit.time, rel=1e-5)
    row = int(np.argmin(np.abs(gap.time - hit.time)))
    assert first.speed == pytest.approx(abs(gap["rail.qd[1]"][row]), rel=1e-4)


def test_a_joint_whose_clearance_vanishes_tends_to_the_ideal_joint() -> None:
    """The time of flight t is proportional to the third root of the clearance c. The speed is proportional to t²: (12 c
    m/Ṅ)^(1/3), Ṅ t²/(2 m)."""
    r = simulate(shaken(), until=0.4, every=5e-4)
    slope = PULL * RATE
    for c in (1e-6, 1e-8, 1e-9):
        [k, *_] = knocks(r, c)
        t = (12 * c * MASS / slope) ** (1 / 3)
        assert k.flight == pytest.approx(t, rel=3 * (RATE * t) ** 2 + 1e-5)  # rows are 0.5 ms apart
        assert k.speed == pytest.approx(slope * t**2 / (2 * MASS), rel=3 * (RATE * t) ** 2 + 1e-5)  # rows are 0.5 ms apart


def mobility_of_pin(scene: sm.Scene) -> np.ndarray:
    """The mobility of the joint "pin" at the start, in the directions of its clearance (3×3)."""
    r = simulate(scene, until=0.01, every=0.01)
    return restrict_mobility(free_mobility(r, "pin")(0), clearances_of(r.scene.joints["pin"])[0], rotation_at(r, "pin", 0))


def test_the_mass_behind_a_pin_is_that_of_the_mechanism_without_it() -> None:
    """The inverse mass at the end of a free bar is 1/m + a²/J across the bar and 1/m along it."""
    bar = sm.Body(box=(0.6, 0.04, 0.04), mass=3.0, center=(0.3, 0.0, 0.0))
    scene = sm.Scene({"bar": bar}, {"pin": sm.Joint("revolute", "ground", "bar", axis="y", friction=PIN)}, "bar")
    J = 3.0 * (0.6**2 + 0.04**2) / 12
    W = mobility_of_pin(scene)
    assert sorted(np.linalg.eigvalsh(W)) == pytest.approx([0.0, 1 / 3.0, 1 / 3.0 + 0.3**2 / J], rel=1e-9, abs=1e-12)
    ball = replace(scene, joints={"pin": sm.Joint("spherical", "ground", "bar", friction=sm.Friction(mu=0.05, radius=0.01))})
    W = mobility_of_pin(ball)
    assert sorted(np.linalg.eigvalsh(W)) == pytest.approx([1 / 3.0, *[1 / 3.0 + 0.3**2 / J] * 2], rel=1e-9)


def test_pins_of_a_loop_are_reported() -> None:
    found = knocks(simulate(LOOP, until=0.1, every=2e-4), 10e-6)
    assert found == sorted(found, key=lambda k: k.time)
    assert found
    assert all(k.mass > 0.0 and k.speed > 0.0 and k.flight > 0.0 and 10e-6 < k.way <= 20e-6 for k in found)
    assert {k.joint for k in found} <= set(trunnion.load_scene(LOOP).joints)


def test_invalid_clearances_and_missing_columns_are_reported() -> None:
    r = simulate(shaken(), until=0.1, every=1e-3)
    with pytest.raises(SceneError, match="is not a joint of this scene"):
        knocks(r, {"rail": 1e-5})
    with pytest.raises(SceneError, match="must be positive"):
        knocks(r, {"pin": -1e-5})
    with pytest.raises(SceneError, match="need the column"):
        knocks(simulate(shaken(), until=0.1, outputs=("pin.q*",)), 1e-5)


def test_the_command_prints_the_impacts(capsys: pytest.CaptureFixture[str]) -> None:
    how = ["knocks", LOOP, "--until", "0.1", "--every", "2e-4"]
    assert main([*how, "--clearance", "crank_pin=10 um", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["knocks"]
    expected = knocks(simulate(LOOP, until=0.1, every=2e-4), {"crank_pin": 10e-6})
    assert [(k["joint"], k["time"]) for k in told] == [(k.joint, k.time) for k in expected]
    joint = expected[0].joint
    assert main([*how, "--clearance", f"{joint}=10 um"]) == 0
    assert f"{expected[0].time:.6g}" in capsys.readouterr().out
    assert main(how) == 2
    assert "for example --clearance" in capsys.readouterr().err
    assert main([*how, "--clearance", "10 s"]) == 2
    assert main([*how, "--clearance", "nothing=10 um"]) == 2
