"""Raising, lowering, holding and self-locking of a screw with friction agree with the closed forms of a lead screw."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trunnion import hold
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, simulate

KERNELS = ("parts", "compiled")
MASS, GRAVITY, SPIN = 40.0, 9.81, 0.02
RADIUS, FLANK, MU = 0.01, math.radians(15.0), 0.12
LOAD = MASS * GRAVITY


def lead(pitch: float) -> float:
    return pitch / (2 * math.pi * RADIUS)


def torque(pitch: float, sense: int, mu: float = MU) -> float:
    """Torque at which a screw under its load moves steadily, up (sense 1) or down (−1): W r (tan λ ± μ')/(1 ∓ μ' tan λ) with μ' =
    μ/cos β."""
    steep = mu / math.cos(FLANK)
    return LOAD * RADIUS * (lead(pitch) + sense * steep) / (1 - sense * steep * lead(pitch))


def jack(pitch: float, effort: float, mu: float = MU, rate: float = 0.0, pin: str = "inboard", **more: float) -> sm.Scene:
    """A load on an upright screw that a torque turns."""
    body = sm.Body(mass=MASS, inertia=(SPIN, SPIN, SPIN))
    rub = sm.Friction(mu=mu, radius=RADIUS, flank_angle=FLANK, **more)
    start = sm.Start(q=0.0, qd=rate)
    screw = sm.Joint("screw", "ground", "load", axis="z", pitch=pitch, pin=pin, friction=rub, effort=effort, start=start)
    return sm.Scene({"load": body}, {"screw": screw}, "jack", gravity=(0.0, 0.0, -GRAVITY))


def turned(r: Result) -> float:
    assert r.outcome.ok
    return float(r["screw.q[1]"][-1])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("pin", ["inboard", "outboard"])
@pytest.mark.parametrize("pitch", [0.002, -0.004, 0.03])
def test_a_screw_at_rest_holds_between_the_torques_that_raise_and_that_lower(pitch: float, pin: str, kernel: str) -> None:
    for sense in (1, -1):
        way = sense * int(math.copysign(1, pitch))
        edge = torque(abs(pitch), sense) * math.copysign(1, pitch)
        inside, beyond = edge - way * 1e-6 * abs(edge), edge + way * 1e-6 * abs(edge)
        assert turned(simulate(jack(pitch, inside, pin=pin), until=1.0, kernel=kernel)) == 0.0
        gone = turned(simulate(jack(pitch, beyond, pin=pin), until=1.0, kernel=kernel))
        assert way * gone > 0.0


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("pitch", [0.002, 0.03])
def test_a_screw_with_friction_accelerates_by_its_closed_form(pitch: float, sense: int, kernel: str) -> None:
    """T − m (g + q̈ p/2π) r tan(λ ± φ) = J q̈ holds to 1e-9."""
    given = torque(pitch, sense) + sense * 0.5
    arm = torque(pitch, sense) / LOAD
    rate = (given - LOAD * arm) / (SPIN + MASS * pitch / (2 * math.pi) * arm)
    r = simulate(jack(pitch, given, rate=sense * 1.0), until=0.5, kernel=kernel)
    assert r["screw.qdd[1]"][1:] == pytest.approx(np.full(len(r) - 1, rate), rel=1e-9)
    assert abs(r["energy.residual"]).max() < 1e-6


@pytest.mark.parametrize("side", [1, -1])
def test_a_screw_is_self_locking_where_its_lead_is_flatter_than_friction_over_the_flank(side: int) -> None:
    """tan λ is 1e-6 below and above μ/cos β."""
    pitch = 0.01
    edge = lead(pitch) * math.cos(FLANK)
    r = simulate(jack(pitch, 0.0, mu=edge * (1 + side * 1e-6)), until=1.0)
    assert (turned(r) == 0.0) is (side > 0)
    assert hold(jack(pitch, 0.0, mu=edge * (1 + side * 1e-6))).holds is (side > 0)


def test_the_normal_force_on_the_flanks_balances_the_load() -> None:
    """The flanks carry f cos β cos λ along the axis. Friction carries k f sin λ of the load."""
    pitch = 0.03
    r = simulate(jack(pitch, torque(pitch, 1), rate=1.0), until=0.1)
    angle = math.atan(lead(pitch))
    f = LOAD / (math.cos(FLANK) * math.cos(angle) - MU * math.sin(angle))
    assert r["screw.contact[1].normal_force"][1:] == pytest.approx(np.full(len(r) - 1, f), rel=1e-9)


def flanks(load: float, sliding: float, pitch: float, flank: float, mu: float, parts: int = 24) -> tuple[float, float]:
    """(friction along the freedom, normal force) of a thread under an axial force on the pin. The flanks consist of flat pieces,
    each with its own normal and place. ``sliding``: sense in which the bearing slides along the helix."""
    radius = RADIUS
    angle = math.atan(pitch / (2 * math.pi * radius))
    total = np.zeros(6)
    for turn in 2 * np.pi * np.arange(parts) / parts:
        out, around = np.array([0.0, np.cos(turn), np.sin(turn)]), np.array([0.0, -np.sin(turn), np.cos(turn)])
        up = np.array([1.0, 0.0, 0.0])
        helix, across = up * np.sin(angle) + around * np.cos(angle), up * np.cos(angle) - around * np.sin(angle)
        normal = across * np.cos(flank) + np.sign(load) * out * np.sin(flank)
        force = np.sign(load) * normal / parts + mu * sliding * helix / parts
        total += np.concatenate([force, np.cross(radius * out, force)])
    f = load / total[0]
    return float(f * (total[3] + total[0] * pitch / (2 * math.pi))), float(f)


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("seed", range(20))
def test_the_closed_forms_are_those_of_many_small_flanks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pitch, flank, mu = float(rng.uniform(-0.05, 0.05)), float(rng.uniform(0, 0.6)), float(rng.uniform(0.05, 0.3))
    pin, rate = str(rng.choice(["inboard", "outboard"])), float(rng.normal())
    body = sm.Body(mass=MASS, inertia=(SPIN, SPIN, SPIN), center=tuple(map(float, rng.normal(size=3) * 0.1)))
    rub = sm.Friction(mu=mu, radius=RADIUS, flank_angle=flank)
    screw = sm.Joint("screw", "ground", "load", axis="z", pitch=pitch, pin=pin, friction=rub, effort=float(rng.normal()))
    push = sm.Force("force", "load", tuple(map(float, 300 * rng.normal(size=3))))
    scene = sm.Scene({"load": body}, {"screw": screw}, "jack", gravity=(0.0, 0.0, -GRAVITY), forces={"push": push})
    row = evaluate(Model(scene, ("*",)), {"screw": np.array([0.3])}, {"screw": np.array([rate])}, 0.0)
    side = 1.0 if pin == "inboard" else -1.0
    along = side * row["screw.reaction.force[1]"]
    friction, normal = flanks(along, side * np.sign(rate), pitch, flank, mu)
    assert row["screw.friction.torque[1]"] == pytest.approx(side * friction, rel=1e-10)
    assert row["screw.contact[1].normal_force"] == pytest.approx(normal, rel=1e-10)


def test_a_preload_drags_at_the_radius_of_the_thread_whatever_the_load_is() -> None:
    pitch, press = 0.03, 500.0
    angle = math.atan(lead(pitch))
    f = (LOAD + MU * press * math.sin(angle)) / (math.cos(FLANK) * math.cos(angle) - MU * math.sin(angle))
    edge = LOAD * pitch / (2 * math.pi) + MU * (f + press) * RADIUS / math.cos(angle)
    assert turned(simulate(jack(pitch, edge * (1 - 1e-9), preload=press), until=0.5)) == 0.0
    assert turned(simulate(jack(pitch, edge * (1 + 1e-9), preload=press), until=0.5)) > 0.0


@pytest.mark.parametrize("sense", [1, -1])
def test_where_friction_of_a_preload_carries_more_than_the_load_the_other_flank_presses(sense: int) -> None:
    """Along the axis, as vectors: the normal forces n_1 f cos β cos λ of the flanks plus their friction k (f + P) sin λ equal the
    load."""
    pitch, press = 0.03, 20000.0
    body = sm.Body(mass=MASS, inertia=(SPIN, SPIN, SPIN))
    rub = sm.Friction(mu=MU, radius=RADIUS, flank_angle=FLANK, preload=press)
    screw = sm.Joint("screw", "ground", "load", axis="z", pitch=pitch, friction=rub)
    scene = sm.Scene({"load": body}, {"screw": screw}, "jack", gravity=(0.0, 0.0, -GRAVITY))
    row = evaluate(Model(scene, ("*",)), {"screw": np.array([0.3])}, {"screw": np.array([sense * 1.0])}, 0.0)
    angle, f, load = math.atan(lead(pitch)), row["screw.contact[1].normal_force"], row["screw.reaction.force[1]"]
    flank = -row["screw.contact[1].normal[1]"] * f * math.cos(FLANK) * math.cos(angle)
    drag = sense * MU * (f + press) * math.sin(angle)
    assert abs(drag) > abs(load)
    assert np.sign(flank) == -sense
    assert flank + drag == pytest.approx(load, rel=1e-10)
