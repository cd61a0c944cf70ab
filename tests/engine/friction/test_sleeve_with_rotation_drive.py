"""In a pair of two components, a drive moves one component. The pair slides while the drive moves, however slowly. Along the other
component, the pair then creeps under any load, as a tight pin comes loose when it is turned. The pair rests when the drive rests.
As reference, SciPy solves the equation of this motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.default_case_selection import sampled
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate

MASS, G, RADIUS, LONG, UNTIL = 2.0, 9.81, 0.02, 5.0, 1.0
"""The sleeve is long: friction on its surface, which tilts it, makes the loads of its ends differ by only (radius/length)², 2e-5.
Tolerances are relative to its length, too."""
SETTINGS = [("rk5", 1e-4), ("rk8", 1e-6), ("auto", 1e-4), ("auto", 1e-8), ("rosenbrock", 1e-4), ("rosenbrock", 1e-6)]
REST = 1e-8
"""Slowest rate of SciPy's drives, rad/s; the equation has no solution at rest."""
Drive = tuple[str, Callable[[float], float]]
"""A drive as in scene files, and its rate, rad/s."""


def ramp(first: float, last: float, begin: float, lasts: float) -> Drive:
    """A rate that changes linearly."""
    text = f"{{ramp: {{start: {first}, end: {last}, begin: {begin}, duration: {lasts}}}}}"
    return text, lambda t: np.interp(t, [begin, begin + lasts], [first, last])


def move(size: float, begin: float, lasts: float) -> Drive:
    """A motion from rest to rest, by the polynomial of fifth order."""
    text = f"{{move: {{start: 0, end: {size}, begin: {begin}, duration: {lasts}}}}}"
    return text, lambda t: size / lasts * 30.0 * (x := np.clip((t - begin) / lasts, 0.0, 1.0)) ** 2 * (1.0 - x) ** 2


def swing(size: float, hertz: float) -> Drive:
    """A motion to and fro."""
    text = f"{{harmonic: {{amplitude: {size}, frequency: {hertz} Hz}}}}"
    return text, lambda t: size * 2.0 * np.pi * hertz * np.cos(2.0 * np.pi * hertz * t)


DRIVES = {
    "starts": ramp(0, 1, 0.5, 0.2), "ends": ramp(1, 0, 0.1, 0.5), "turns": ramp(1, -1, 0.1, 0.5),
    "goes": move(0.1, 0.1, 0.5), "swings": swing(0.2, 2),
}  # fmt: skip


def drawn(drive: str, mu: float, share: float, speed: float) -> str:
    """A sleeve on a level shaft. A force of ``share`` times its largest friction pushes the sleeve along the shaft, and a drive
    turns the sleeve."""
    return f"""
schema: 1
gravity: [0, 0, -{G}]
bodies:
  sleeve: {{mass: {MASS}, inertia: [0.01, 0.01, 0.01]}}
joints:
  shaft:
    type: cylindrical
    axis: x
    pin: outboard
    inboard: ground
    outboard: sleeve
    friction: {{mu: {mu}, radius: {RADIUS}, half_length: {LONG}}}
    start: {{qd: [{speed}, 0]}}
    effort: [{share * mu * MASS * G}, 0]
    drive: [null, {drive}]
simulation: {{until: {UNTIL}}}
"""


def turned(drive: str, mu: float, share: float, speed: float) -> Scene:
    """The scene of a sleeve from ``drawn``."""
    return scene_from_text(drawn(drive, mu, share, speed))


def alone(rate: Callable[[float], float], mu: float, share: float, speed: float, times: np.ndarray) -> np.ndarray:
    """The sleeve's travel and speed. u: the speed at which the drive turns the sleeve's surface. Friction against u inclines the
    normals, so that normal force and friction carry the weight together: N² (1 + (μ u/V)²) = (m g)²; v' = μ (g share - N/m v/V), V²
    = v² + u²."""

    def motion(t: float, x: np.ndarray) -> list[float]:
        u = max(abs(rate(t)), REST) * RADIUS
        surface = np.hypot(x[1], u)
        return [x[1], mu * G * (share - x[1] / surface / np.hypot(1.0, mu * u / surface))]

    return solve_ivp(motion, (0.0, times[-1]), [0.0, speed], "LSODA", times, rtol=1e-11, atol=1e-14, max_step=0.01).y


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(8), 2))
@pytest.mark.parametrize(("method", "rtol"), SETTINGS)
def test_a_sleeve_that_is_turned_creeps_along_its_shaft_and_never_rests(method: str, rtol: float, seed: int) -> None:
    chance = np.random.default_rng(seed)
    rate = float(chance.choice([-1.0, 1.0]) * 10.0 ** chance.uniform(-5.0, 1.0))
    mu, share, speed = chance.uniform(0.05, 0.5), chance.uniform(0.1, 0.9), chance.uniform(0.1, 1.0)
    r = simulate(turned(f"{{constant: {{rate: {rate}}}}}", mu, share, speed), every=0, method=method, rtol=rtol)
    q, v = alone(lambda _: rate, mu, share, speed, r.time)
    assert r.outcome.ok
    assert not r.events
    assert np.abs(r["shaft.q[1]"] - q).max() <= 20.0 * rtol * LONG
    assert np.abs(r["shaft.qd[1]"] - v).max() <= 20.0 * rtol * LONG / UNTIL


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("share", [0.5, 0.0, 0.9])
@pytest.mark.parametrize("what", DRIVES)
@pytest.mark.parametrize(("method", "rtol"), SETTINGS[2:])
def test_a_sleeve_rests_when_its_drive_does_and_starts_with_it(method: str, rtol: float, what: str, share: float) -> None:
    drive, rate = DRIVES[what]
    r = simulate(turned(drive, 0.2, share, 0.3), every=0.05, method=method, rtol=rtol)
    q, _ = alone(rate, 0.2, share, 0.3, r.time)
    last = [e for e in r.events if e.kind in ("slip", "stick")]
    assert r.outcome.ok
    assert np.abs(r["shaft.q[1]"] - q).max() <= 20.0 * rtol * LONG
    if what == "starts" and share < 0.9:
        assert [e.kind for e in last] == ["stick", "slip"]
        assert last[1].time == 0.5
    if what in ("ends", "goes") and share < 0.9:  # SciPy's drive never rests completely
        assert [e.kind for e in last] == ["stick"]
        assert abs(r["shaft.qd[1]"][-1]) <= REST * RADIUS


CRANK = {
    "bodies:": """
  crank: {mass: 1, inertia: [0.01, 0.01, 0.01], points: {tip: [0.1, 0, 0]}}
  rod: {mass: 1, inertia: [0.01, 0.01, 0.01], points: {a: [-0.2, 0, 0], b: [0.2, 0, 0]}}
  block: {mass: 1, inertia: [0.01, 0.01, 0.01]}""",
    "joints:": """
  main: {type: revolute, axis: y, inboard: ground, outboard: crank, start: {qd: 3, q: 0.3}}
  pin: {type: revolute, axis: y, inboard: crank.tip, outboard: rod.a}
  guide: {type: prismatic, axis: x, inboard: ground, outboard: block}
  wrist: {type: revolute, axis: y, inboard: rod.b, outboard: block}""",
}
"""A crank that is not connected with the sleeve. Its loop makes the engine use the code for loops for the sleeve, too."""


def any_drive(chance: np.random.Generator) -> Drive:
    """A ramp, a move or a swing."""
    begin, lasts, size = chance.uniform(0.05, 0.4), chance.uniform(0.05, 0.5), 10.0 ** chance.uniform(-3.0, 1.0)
    first, last = (float(x) for x in chance.choice([0.0, size, -size], 2))
    what, hertz = chance.integers(3), chance.uniform(0.5, 4.0)
    return [ramp(first, last, begin, lasts), move(size, begin, lasts), swing(size, hertz)][what]


def moves_alone(seed: int, more: dict[str, str]) -> None:
    """With any drive the sleeve moves according to its equation. ``more`` adds devices to the scene's text, each after a given
    word."""
    chance = np.random.default_rng(1000 + seed)
    drive, rate = any_drive(chance)
    mu, share, speed = chance.uniform(0.05, 0.5), chance.uniform(-0.9, 0.9), chance.choice([0.0, 1.0, -1.0])
    speed *= chance.uniform(0.0, 0.6)
    text = drawn(drive, mu, share, speed)
    for part, rest in more.items():
        text = text.replace(part, part + rest, 1)
    for method, rtol in (("auto", 1e-6), ("rosenbrock", 1e-4), ("rk8", 1e-6)):
        r = simulate(scene_from_text(text), every=0.02, method=method, rtol=rtol)
        assert r.outcome.ok
        assert np.abs(r["shaft.q[1]"] - alone(rate, mu, share, speed, r.time)[0]).max() <= 20.0 * rtol * LONG


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(60), 4))
def test_a_sleeve_with_any_drive_moves_as_its_equation_says(seed: int) -> None:
    moves_alone(seed, {})


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(10), 3))
def test_a_loop_beside_the_sleeve_changes_nothing(seed: int) -> None:
    moves_alone(seed, CRANK)
