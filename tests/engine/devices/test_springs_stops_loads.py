"""During runs, springs, dampers, stops, applied forces and inputs act as their formulas state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

RTOL = 1e-10
ERROR = 1e-7
"""Accumulated errors of steps at RTOL over a hundred oscillations."""
BALL = sm.Body(sphere=0.1, mass=2.0)
WEIGHTLESS = (0.0, 0.0, 0.0)


def slider(gravity=WEIGHTLESS, forces=None, inputs=None, **joint) -> sm.Scene:
    """A scene of one ball of 2 kg on a rail along x."""
    return sm.Scene(
        {"ball": BALL},
        {"rail": sm.Joint("prismatic", "ground", "ball", axis="x", **joint)},
        "slider",
        gravity=gravity,
        forces=forces or {},
        inputs=inputs or {},
    )


def run(scene: sm.Scene, until: float = 3.0, every: float = 0.01, **how) -> Result:
    r = simulate(scene, until=until, every=every, rtol=RTOL, **how)
    assert r.outcome.ok, r.outcome
    return r


def damped(t, q0, v0, m, c, k) -> np.ndarray:
    """The motion q(t) that solves m q̈ + c q̇ + k q = 0 from q0, v0."""
    roots = np.roots([m, c, k]).astype(complex)
    a = np.linalg.solve([[1, 1], roots], [q0, v0])
    return np.real(a[0] * np.exp(roots[0] * t) + a[1] * np.exp(roots[1] * t))


def test_a_joint_spring_and_damper_make_the_damped_oscillator() -> None:
    r = run(slider(spring=sm.Spring(50.0, 0.3), damping=1.5, start=sm.Start(0.1, 2.0)))
    assert r["rail.q[1]"] == pytest.approx(0.3 + damped(r.time, -0.2, 2.0, 2.0, 1.5, 50.0), abs=ERROR)
    effort = -50.0 * (r["rail.q[1]"] - 0.3) - 1.5 * r["rail.qd[1]"]
    assert r["rail.reaction.force[1]"] == pytest.approx(-effort, abs=1e-12)  # the column holds reactions on the inboard part
    lost = 1.5 * np.trapezoid(r["rail.qd[1]"] ** 2, r.time)
    assert r["energy.dissipated"][-1] == pytest.approx(lost, rel=1e-4)  # the error of the trapezoidal rule on rows 0.01 s apart
    assert r["energy.potential"] == pytest.approx(25.0 * (r["rail.q[1]"] - 0.3) ** 2, abs=1e-12)


def test_springs_and_damping_act_on_each_freedom_by_itself() -> None:
    """A universal joint at small angles is two separate oscillators."""
    body = sm.Body(mass=2.0, inertia=(0.2, 0.3, 0.4))
    joint = sm.Joint(
        "universal",
        "ground",
        "b",
        axis="x",
        reference="y",
        spring=(sm.Spring(3.0), sm.Spring(7.0, 1e-4)),
        damping=(0.1, None),
        start=sm.Start((1e-4, 0.0), (0.0, 2e-4)),
    )
    r = run(sm.Scene({"b": body}, {"j": joint}, gravity=WEIGHTLESS))
    assert r["j.q[1]"] == pytest.approx(damped(r.time, 1e-4, 0.0, 0.2, 0.1, 3.0), abs=1e-9)
    assert r["j.q[2]"] == pytest.approx(1e-4 + damped(r.time, -1e-4, 2e-4, 0.3, 0.0, 7.0), abs=1e-9)


def bouncing(damping: float = 0.0, stiffness: float = 1e4) -> Result:
    """A run of a body that falls from rest at 0 onto a stop at −0.5 m."""
    stops = sm.EndStops(stiffness=stiffness, lower=-0.5, damping=damping)
    return run(slider(gravity=(-9.81, 0.0, 0.0), end_stops=stops, start=sm.Start(0.0, 0.0)), until=4.0, every=0.001)


def test_a_stop_without_damping_gives_back_all_energy() -> None:
    r = bouncing()
    energy = r["energy.kinetic"] + r["energy.potential"]
    assert np.abs(energy - energy[0]).max() <= 1e-7
    peaks = r["rail.q[1]"][1:-1][(np.diff(r["rail.q[1]"])[:-1] > 0) & (np.diff(r["rail.q[1]"])[1:] <= 0)]
    assert len(peaks) >= 4
    assert np.abs(peaks).max() <= 1e-5  # rows 1 ms apart miss the top by up to g t²/2


def test_a_bouncing_body_touches_and_leaves_when_it_must() -> None:
    """Free flight of √(2 h/g) and half an oscillation on the spring alternate."""
    g, k, m, h = 9.81, 1e4, 2.0, 0.5
    w, v = np.sqrt(k / m), np.sqrt(2 * g * h)
    contact = (np.pi + 2 * np.arctan(g / (w * v))) / w
    flight = np.sqrt(2 * h / g)
    on = [flight + n * (2 * flight + contact) for n in range(6)]
    r = bouncing()
    found = {kind: [e.time for e in r.events if e.kind == kind] for kind in ("end_stop_engaged", "end_stop_released")}
    assert found["end_stop_engaged"] == pytest.approx([t for t in on if t < 4.0], abs=1e-7)
    assert found["end_stop_released"] == pytest.approx([t + contact for t in on if t + contact < 4.0], abs=1e-7)
    assert {(e.joint, e.part) for e in r.events} == {("rail", 1)}


@pytest.mark.parametrize("damping", [0.0, 0.3, 5.0])
def test_a_stop_never_pulls(damping: float) -> None:
    """By Hunt and Crossley, the force is stiffness·depth·(1 + damping·depth rate) while this product is positive."""
    r = bouncing(damping)
    depth, rate = -0.5 - r["rail.q[1]"], -r["rail.qd[1]"]
    push = -r["rail.reaction.force[1]"]  # the force of the stop on the ball
    assert np.all(push >= 0.0)
    assert np.count_nonzero(push > 0) > 10
    assert push == pytest.approx(np.where(depth > 0, 1e4 * depth * np.maximum(1 + damping * rate, 0.0), 0.0), abs=1e-7)
    assert np.all(np.diff(r["energy.dissipated"]) >= -1e-12)
    assert np.abs(r["energy.residual"]).max() <= 1e-7
    if damping:
        assert r["energy.dissipated"][-1] > 0.2 * 2.0 * 9.81 * 0.5


def test_a_stop_lets_go_of_what_leaves_faster_than_it_can_follow() -> None:
    """A body that falls into the stop never leaves faster than 1/damping. Here the body starts inside the stop with a higher rate,
    as after an external force."""
    stops = sm.EndStops(stiffness=1e4, lower=-0.5, damping=5.0)
    r = run(slider(end_stops=stops, start=sm.Start(-0.6, 3.0)), until=0.1, every=0.001)
    assert r["rail.q[1]"] == pytest.approx(-0.6 + 3.0 * r.time, abs=1e-12)
    assert np.all(r["rail.reaction.force[1]"] == 0.0)


def test_an_upper_stop_is_a_lower_one_seen_in_a_mirror() -> None:
    stops = sm.EndStops(stiffness=1e4, upper=0.5, damping=0.3)
    up = run(slider(gravity=(9.81, 0.0, 0.0), end_stops=stops, start=sm.Start(0.0, 0.0)), until=4.0, every=0.001)
    assert up["rail.q[1]"] == pytest.approx(-bouncing(0.3)["rail.q[1]"], abs=1e-9)


def test_a_spring_damper_between_two_free_bodies() -> None:
    """Along their line, the two bodies are one damped oscillator with the reduced mass. The common mass centre moves uniformly."""
    a, b = BALL, replace(BALL, mass=3.0)
    way = np.array([2.0, -1.0, 2.0]) / 3.0
    joints = {
        "fa": sm.Joint("free", "ground", "a", start=sm.Start((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.2, 0.1, 0.0, 0.0, 0.0, 0.0))),
        "fb": sm.Joint("free", "ground", "b", start=sm.Start((*(0.8 * way), 1.0, 0.0, 0.0, 0.0), (0.2, 0.1, 0.0, 0.0, 0.0, 0.0))),
    }  # fmt: skip
    spring = sm.SpringDamper("spring_damper", ("a", "b"), stiffness=40.0, damping=0.7, length=0.5)
    r = run(sm.Scene({"a": a, "b": b}, joints, gravity=WEIGHTLESS, forces={"s": spring}))
    xa, xb = (np.array([r[f"{n}.position[{k}]"] for k in (1, 2, 3)]) for n in "ab")
    stretch = damped(r.time, 0.3, 0.0, 1.2, 0.7, 40.0)
    assert xb - xa == pytest.approx(np.outer(way, 0.5 + stretch), abs=ERROR)
    assert (2 * xa + 3 * xb) / 5 == pytest.approx(np.outer([0.2, 0.1, 0.0], r.time) + 0.6 * 0.8 * way[:, None], abs=ERROR)
    assert np.abs(r["energy.residual"]).max() <= ERROR


def free_body(forces: dict, inputs=None, spin: float = 0.0) -> sm.Scene:
    """A body of 2 kg in space that spins about z. Its frame is turned by 90° about z."""
    body = sm.Body(mass=2.0, inertia=(0.2, 0.3, 0.4), center=(0.1, 0.0, 0.0), points={"p": (0.3, 0.0, 0.0)})
    half = np.sqrt(0.5)
    start = sm.Start((0.0, 0.0, 0.0, half, 0.0, 0.0, half), (-0.0, 0.0, 0.0, 0.0, 0.0, spin))
    return sm.Scene(
        {"b": body}, {"j": sm.Joint("free", "ground", "b", start=start)}, gravity=WEIGHTLESS, forces=forces, inputs=inputs or {}
    )


def test_a_force_in_world_axes_at_the_mass_centre_makes_a_parabola() -> None:
    r = run(free_body({"f": sm.Force("force", "b", (4.0, 0.0, -1.0))}, spin=2.0), until=1.0)
    v0 = np.array([r[f"b.velocity[{k}]"][0] for k in (1, 2, 3)])
    x = np.array([r[f"b.position[{k}]"] - r[f"b.position[{k}]"][0] for k in (1, 2, 3)])
    assert v0 == pytest.approx([-0.2, 0.0, 0.0], abs=1e-15)  # the spin times the lever arm
    assert x == pytest.approx(np.outer(v0, r.time) + np.outer([2.0, 0.0, -0.5], r.time**2 / 2), abs=1e-9)


def test_a_force_in_body_axes_turns_with_the_body() -> None:
    r = run(free_body({"f": sm.Force("force", "b", (4.0, 0.0, 0.0), frame="body")}, spin=2.0), until=2.0)
    phi = np.pi / 2 + 2.0 * r.time  # the force acts through the mass centre, so the spin is constant
    a = np.array([r[f"b.acceleration[{k}]"] for k in (1, 2, 3)])
    assert a == pytest.approx(2.0 * np.array([np.cos(phi), np.sin(phi), 0 * phi]), abs=1e-8)
    v = np.array([r[f"b.velocity[{k}]"] - r[f"b.velocity[{k}]"][0] for k in (1, 2)])
    assert v == pytest.approx(np.array([np.sin(phi) - 1.0, -np.cos(phi)]), abs=1e-8)


def test_a_force_off_the_mass_centre_turns_the_body_and_a_torque_does_just_that() -> None:
    r = run(free_body({"f": sm.Force("force", "b.p", (-3.0, 0.0, 0.0))}), until=1e-3, every=1e-3)
    assert r["j.qdd[6]"][0] == pytest.approx(3.0 * 0.2 / 0.4, rel=1e-12)  # the arm of 0.2 m points along world y
    for frame, torque in (("world", (0.0, 0.0, 1.2)), ("body", (0.0, 0.0, 1.2))):
        r = run(free_body({"t": sm.Torque("torque", "b", torque, frame)}), until=1.0)
        assert r["b.angular_velocity[3]"] == pytest.approx(3.0 * r.time, abs=1e-9)
    r = run(free_body({"t": sm.Torque("torque", "b", (0.6, 0.0, 0.0), "body")}), until=1e-3, every=1e-3)
    # the body's x is the world's y; the acceleration is 0.6 N m over 0.2 kg m²
    assert [r[f"j.qdd[{k}]"][0] for k in (4, 5, 6)] == pytest.approx([0.0, 3.0, 0.0], abs=1e-12)


def test_inputs_drive_forces_and_efforts_and_can_be_set() -> None:
    scene = slider(effort=sm.FromInput("push"), inputs={"push": sm.Input(start=3.0)})
    assert run(scene)["rail.q[1]"][-1] == pytest.approx(3.0 / 2.0 * 9.0 / 2, abs=1e-9)
    assert run(apply(scene, {"inputs.push.start": -1.0}))["rail.q[1]"][-1] == pytest.approx(-1.0 / 2.0 * 9.0 / 2, abs=1e-9)
    force = sm.Force("force", "ball", (sm.FromInput("push"), 0.0, 0.0))
    scene = slider(forces={"f": force}, inputs={"other": sm.Input(start=9.0), "push": sm.Input(start=2.0)})
    assert run(scene)["rail.q[1]"][-1] == pytest.approx(2.0 / 2.0 * 9.0 / 2, abs=1e-9)


@pytest.mark.parametrize("kind", ["harmonic", "table", "ramp"])
def test_efforts_follow_their_signal(kind: str) -> None:
    """Tables of loads are linear between their points, and constant outside their range."""
    signal = {
        "harmonic": sm.Signal(harmonic=sm.Harmonic(amplitude=3.0, frequency=0.7, phase=0.4, offset=1.0)),
        "table": sm.Signal(table=sm.Table((0.5, 1.0, 2.0), (1.0, 4.0, -2.0))),
        "ramp": sm.Signal(ramp=sm.Ramp(1.0, 5.0, duration=1.2, begin=0.4)),
    }[kind]
    r = run(slider(effort=signal))
    value = {
        "harmonic": lambda t: 1.0 + 3.0 * np.sin(2 * np.pi * 0.7 * t + 0.4),
        "table": lambda t: np.interp(t, (0.5, 1.0, 2.0), (1.0, 4.0, -2.0)),
        "ramp": lambda t: np.interp(t, (0.4, 1.6), (1.0, 5.0)),
    }[kind](r.time)
    assert r["rail.qdd[1]"] == pytest.approx(value / 2.0, abs=1e-12)
    assert r["rail.reaction.force[1]"] == pytest.approx(-value, abs=1e-12)
    assert np.abs(r["energy.residual"]).max() <= ERROR


@pytest.mark.default_cases(9)
@pytest.mark.parametrize("method", ["auto", "rk5", "rk8", "rosenbrock", "moreau"])
@pytest.mark.parametrize("short", [0.1, 1e-2, 1e-3, 1e-4])
def test_a_stop_just_below_the_top_of_a_throw_is_met_by_every_method(short: float, method: str) -> None:
    """The throw at 1 m/s would rise by 1/(2 g). The body meets the stop, makes half an oscillation on the stop's spring under its
    weight, and moves down again."""
    weight, stiffness = 9.81, 1e5
    at, rate = (1.0 - short) / (2 * weight), math.sqrt(stiffness)
    speed = math.sqrt(short)  # speed at which the body reaches the stop
    begin, contact = (1.0 - speed) / weight, 2 * math.atan(speed * rate / weight) / rate
    left = 0.2 - begin - contact
    stops = sm.EndStops(stiffness=stiffness, upper=at)
    rail = sm.Joint("prismatic", "ground", "b", axis="x", start=sm.Start(qd=1.0), end_stops=stops)
    scene = sm.Scene({"b": sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0))}, {"p": rail}, gravity=(-weight, 0.0, 0.0))
    run = simulate(scene, until=0.2, method=method, rtol=1e-6, outputs=["p.q[1]"])
    assert [e.kind for e in run.events] == ["end_stop_engaged", "end_stop_released"]
    close = 1e-3 if method == "moreau" else 2e-5  # √rtol, or 20 rtol, because the stop reverses errors of the speed
    assert run["p.q[1]"][-1] == pytest.approx(at - speed * left - 0.5 * weight * left**2, abs=close * at)
