"""Scenes with brief threshold crossings and known events: motions, loads and signals whose peaks are slightly above or below a
threshold. Closed formulas of free flight, one spring and the signals give the events."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from tests.reference.scenes.brief_crossing_signals import Shape, Signal, harmonic, log_uniform, peaked, table, upside_down

GRAVITY = 9.81
NEAREST, FARTHEST = -8.0, -4.0
"""Decimal exponents of the distance of a motion's peak from its threshold, relative to the threshold."""
NEAREST_LOAD = -6.0
"""Decimal exponents of the distance of a load's peak from the load that releases a pair at rest."""
SURE = 300.0
"""Distance of a peak from its threshold, relative to the largest tolerance at which a run must decide it correctly."""
EDGE = 0.05
"""Part of a window that a slider keeps from the window's ends."""


@dataclass(frozen=True)
class Part:
    """A body on a joint, with its devices and events."""

    joint: dict[str, Any]
    events: list[tuple[str, float]]
    """Events of the kinds in `kinds` in order of time."""
    kinds: tuple[str, ...]
    until: float
    """Time up to which the answer is known, s."""
    mass: float = 1.0
    place: Callable[[float], float] | None = None
    """Coordinate at a time."""
    loosest: float = 1.0
    """Largest relative tolerance whose error does not change the answer."""
    carrier: dict[str, Any] | None = None
    """A driven joint between the ground and this joint."""
    signal: Signal | None = None
    """The signal whose peak decides."""


@dataclass(frozen=True)
class BriefPass:
    """A scene of one to three independent parts, its duration, and the events of each joint."""

    scene: dict[str, Any]
    until: float
    parts: dict[str, Part]

    @property
    def inputs(self) -> dict[str, Signal]:
        """The inputs by name."""
        return {p.signal.data["input"]: p.signal for p in self.parts.values() if p.signal is not None and p.signal.pieces}

    @property
    def loosest(self) -> float:
        return min(p.loosest for p in self.parts.values())

    def events(self, joint: str) -> list[tuple[str, float]]:
        return [e for e in self.parts[joint].events if e[1] < self.until]


def sign(r: np.random.Generator) -> float:
    return float(r.choice([-1.0, 1.0]))


def joint_of(r: np.random.Generator, **more: Any) -> dict[str, Any]:
    kind = {"type": "prismatic", "axis": "x"} if r.random() < 0.7 else {"type": "revolute", "axis": "y"}
    return kind | more


def brake(joint: dict[str, Any], value: Any) -> dict[str, Any]:
    return {"force" if joint["type"] == "prismatic" else "torque": value}


def flight(r: np.random.Generator, span: float) -> tuple[float, float, float, float, bool]:
    """Speed, deceleration, a threshold below or above the highest point of the flight, the side, and whether the flight reaches the
    threshold."""
    speed = float(r.uniform(0.5, 3.0))
    pull = speed / (span * float(r.uniform(0.3, 0.7)))
    far, side, up = log_uniform(r, NEAREST, FARTHEST), sign(r), bool(r.random() < 0.6)
    return speed, pull, 0.5 * speed**2 / pull * (1 - far if up else 1 + far), side, up


def passing(speed: float, pull: float, at: float) -> float:
    """Time at which a flight reaches a coordinate."""
    return (speed - math.sqrt(speed**2 - 2 * pull * at)) / pull


def thrown_at_stop(r: np.random.Generator, span: float) -> Part:
    speed, pull, at, side, up = flight(r, span)
    mass, rate = float(r.uniform(0.5, 2.0)), log_uniform(r, 1.0, 3.5) / span
    stops = {"stiffness": mass * rate**2, "upper" if side > 0 else "lower": side * at}
    joint = joint_of(r, effort=-side * mass * pull, start={"qd": side * speed}, end_stops=stops)
    place = lambda t: side * (speed * t - 0.5 * pull * t * t)  # noqa: E731
    kinds = ("end_stop_engaged", "end_stop_released")
    if not up:
        return Part(joint, [], kinds, 3 * span, mass, place)
    t = passing(speed, pull, at)
    u = math.sqrt(speed**2 - 2 * pull * at)
    off = t + 2 * math.atan(u * rate / pull) / rate

    def there(now: float) -> float:
        if now < t:
            return side * (speed * now - 0.5 * pull * now**2)
        within, after = min(now, off) - t, max(now - off, 0.0)
        swing = u / rate * math.sin(rate * within) - pull / rate**2 * (1.0 - math.cos(rate * within)) if now < off else 0.0
        return side * (at + swing - u * after - 0.5 * pull * after**2)

    return Part(joint, [(kinds[0], t), (kinds[1], off)], kinds, 3 * span, mass, there)


def swung_at_stop(r: np.random.Generator, span: float) -> Part:
    """A body on a spring oscillates near an end stop. The stop is slightly before or slightly beyond the amplitude."""
    rate, amplitude, side, up = log_uniform(r, 0.0, 1.5) / span, float(r.uniform(0.2, 1.0)), sign(r), bool(r.random() < 0.6)
    far, mass, faster = log_uniform(r, FARTHEST, -1.0), float(r.uniform(0.5, 2.0)), log_uniform(r, 0.5, 3.0)
    at = amplitude * (1 - far if up else 1 + far)
    stops = {"stiffness": mass * (faster * rate) ** 2, "upper" if side > 0 else "lower": side * at}
    joint = joint_of(r, start={"qd": side * amplitude * rate}, end_stops=stops, spring={"stiffness": mass * rate**2})
    kinds, loosest = ("end_stop_engaged", "end_stop_released"), far / SURE
    if not up:
        return Part(joint, [], kinds, 3 * span, mass, lambda now: side * amplitude * math.sin(rate * now), loosest)
    t, on = math.asin(at / amplitude) / rate, rate * math.sqrt(1.0 + faster**2)
    off = t + 2 * math.atan2(math.sqrt(amplitude**2 - at**2) * rate * on, rate**2 * at) / on
    return Part(joint, [(kinds[0], t), (kinds[1], off)], kinds, min(3 * span, off + math.pi / rate), mass, None, loosest)


def thrown_over_teeth(r: np.random.Generator, span: float) -> Part:
    speed, pull, at, side, up = flight(r, span)
    mass, rate, teeth = float(r.uniform(0.5, 2.0)), log_uniform(r, 1.0, 3.5) / span, int(r.integers(0, 4))
    latch: dict[str, Any] = {"stiffness": mass * rate**2, "keeps": "above" if side > 0 else "below"}
    pitch = at * float(r.uniform(0.05, 0.3))
    latch |= {"at": side * (at - max(teeth - 1, 0) * pitch)} | ({"pitch": pitch} if teeth else {})
    joint = joint_of(r, effort=-side * mass * pull, start={"qd": side * speed}, latch=latch)
    places = [at - i * pitch for i in range(max(teeth, 1) - 1, -1, -1)]
    caught = places if up else places[:-1]
    events = [("latch", passing(speed, pull, p)) for p in caught]
    place = lambda t: side * (speed * t - 0.5 * pull * t * t)  # noqa: E731
    until = 3 * span
    if caught:
        back = 2 * speed / pull - events[-1][1]
        u = math.sqrt(max(speed**2 - 2 * pull * caught[-1], 0.0))
        events.append(("end_stop_engaged", back))
        until = back + (math.pi + 2 * math.atan(pull / (rate * u))) / rate * 0.9
        place = lambda t: side * (speed * t - 0.5 * pull * t * t) if t < back else math.nan  # noqa: E731
    return Part(joint, events, ("latch", "unlatch", "end_stop_engaged"), until, mass, place)


def passed_hook(r: np.random.Generator, span: float, shapes: tuple[Shape, ...] = (harmonic, table)) -> Part:
    """A slider at constant speed meets a hook, which a signal lifts. For a short time, the signal is below or above the level of
    release."""
    dips = bool(r.random() < 0.5)
    middle, deep = span * float(r.uniform(0.3, 0.7)), log_uniform(r, NEAREST, -1.0)
    kind, rest = shapes[0 if r.random() < 0.5 else -1], float(r.uniform(0.1, 2.0))
    s = kind(r, -0.5 - rest, -0.5 + deep, span, middle) if dips else kind(r, 0.5 - rest, 0.5 + deep, span, middle)
    s = upside_down(s) if dips else s
    edges = s.crossings(0.5, 3 * span)
    i = int(r.choice([i for i, (t, way) in enumerate(edges[:-1] or edges) if way == (-1 if dips else 1) and t < span]))
    t = near_window(r, edges, i, 3 * span)
    mass, speed, rate = float(r.uniform(0.5, 2.0)), float(r.uniform(0.3, 3.0)), log_uniform(r, 1.0, 3.5) / span
    side = sign(r)
    latch = {"at": side * speed * t, "stiffness": mass * rate**2, "keeps": "below" if side > 0 else "above", "release": s.data}
    joint = joint_of(r, start={"qd": side * speed}, latch=latch)
    kinds = ("latch", "unlatch", "end_stop_engaged")
    before = [("unlatch" if way > 0 else "latch", at) for at, way in edges if at < t]
    if (before[-1][0] == "unlatch") if before else s.value(0.0) > 0.5:
        return Part(joint, before, kinds, 3 * span, mass, lambda now: side * speed * now, signal=s)
    later = [e for e in edges if e[0] > t]
    lifts, off = later[0][0] if later else math.inf, t + math.pi / rate
    leaves = min(lifts, off)
    passes_on = lifts < off and math.cos(rate * (lifts - t)) > 0.0

    def there(now: float) -> float:
        within, after = min(now, leaves) - t, max(now - leaves, 0.0)
        if within < 0.0:
            return side * speed * now
        return side * speed * (t + math.sin(rate * within) / rate + math.cos(rate * within) * after)

    until = 3 * span
    if lifts < off and not passes_on:  # the body returns to the hook's place, where the hook may fall again
        until = min(until, lifts - 0.9 * math.tan(rate * (lifts - t)) / rate)
    elif not passes_on and len(later) > 1:
        until = min(until, later[1][0])
    events = [*before, ("end_stop_engaged", t), *[("unlatch", at) for at, _ in later[:1]]]
    return Part(joint, events, kinds, until, mass, there, signal=s)


def near_window(r: np.random.Generator, edges: list[tuple[float, int]], i: int, until: float) -> float:
    """A time inside the window from edge i to edge i + 1, or shortly before or after this window."""
    later = [t for t, _ in edges[i + 1 :]] + ([until] if i + 1 < len(edges) else [until, math.inf])
    a, b, after = edges[i][0], *later[:2]
    before = edges[i - 1][0] if i else 0.0
    room, where = min(a - before, after - b, b - a), r.random()
    if where < 0.6:
        return float(a + r.uniform(EDGE, 1.0 - EDGE) * (b - a))
    return float(a - r.uniform(EDGE, 1.0) * room if where < 0.8 else b + r.uniform(EDGE, 0.9) * room)


def hook_let_go(r: np.random.Generator, span: float, shape: Shape = peaked) -> Part:
    """A hook that carries a constant force. A signal lifts the hook briefly or not at all."""
    up, far = bool(r.random() < 0.6), log_uniform(r, NEAREST, FARTHEST)
    s = shape(r, float(r.uniform(-1.0, 0.3)), 0.5 + far if up else 0.5 - far, span)
    mass, rate, push, side = float(r.uniform(0.5, 2.0)), log_uniform(r, 1.0, 2.0) / span, float(r.uniform(0.5, 3.0)), sign(r)
    deep = push / (mass * rate**2)
    latch = {"at": 0.0, "stiffness": mass * rate**2, "keeps": "below" if side > 0 else "above", "down": True, "release": s.data}
    joint = joint_of(r, start={"q": side * deep}, effort=side * push, latch=latch)
    lifted = [0.0] * (s.value(0.0) > 0.5) + [t for t, way in s.crossings(0.5, 3 * span) if way > 0]
    go = lifted[0] if lifted else math.inf
    events = [("unlatch", go)] if 0.0 < go < math.inf else []  # the lift of a hook at the start is no event
    place = lambda t: side * (deep + 0.5 * push / mass * max(t - go, 0.0) ** 2)  # noqa: E731
    return Part(joint, events, ("latch", "unlatch"), 3 * span, mass, place, signal=s)


def loaded(r: np.random.Generator, span: float, shape: Shape = peaked) -> Part:
    """A pair at rest whose load exceeds its capacity for a short time, or stays below it."""
    cap, far, up, side = float(r.uniform(0.5, 5.0)), log_uniform(r, NEAREST_LOAD, FARTHEST), bool(r.random() < 0.7), sign(r)
    s = shape(r, cap * float(r.uniform(-0.6, 0.9)), cap * (1 + far if up else 1 - far), span)
    joint = joint_of(r)
    joint |= {"effort": (s if side > 0 else upside_down(s)).data, "friction": brake(joint, cap)}
    events = [("slip", t) for t, way in s.crossings(cap, 3 * span) if way > 0]
    return Part(joint, events, ("slip",), 3 * span, signal=s)


def braked(r: np.random.Generator, span: float, shape: Shape = peaked) -> Part:
    """A constant load on a brake whose capacity falls below the load briefly, or not at all."""
    load, far, up, side = float(r.uniform(0.5, 5.0)), log_uniform(r, NEAREST_LOAD, FARTHEST), bool(r.random() < 0.7), sign(r)
    s = upside_down(shape(r, -load * float(r.uniform(1.1, 3.0)), -load * (1 - far if up else 1 + far), span))
    joint = joint_of(r)
    joint |= {"effort": side * load, "friction": brake(joint, s.data)}
    events = [("slip", t) for t, way in s.crossings(load, 3 * span) if way < 0]
    return Part(joint, events, ("slip",), 3 * span, signal=s)


def overrun(r: np.random.Generator, span: float) -> Part:
    """A freewheel. For a short time, the load exceeds the drag in one direction, or the capacity in the other direction."""
    drag, grip = float(r.uniform(0.2, 1.0)), float(r.uniform(2.0, 10.0))
    far = [log_uniform(r, NEAREST_LOAD, FARTHEST) for _ in range(2)]
    up = [bool(r.random() < 0.6) for _ in range(2)]
    low, high = -grip * (1 + far[0] if up[0] else 1 - far[0]), drag * (1 + far[1] if up[1] else 1 - far[1])
    s = harmonic(r, low, high, span)
    joint = joint_of(r, effort=s.data)
    back = "back_force" if joint["type"] == "prismatic" else "back_torque"
    joint["friction"] = brake(joint, drag) | {back: grip}
    slips = [t for limit, sense in ((drag, 1), (-grip, -1)) for t, way in s.crossings(limit, 3 * span) if way == sense]
    return Part(joint, [("slip", t) for t in sorted(slips)], ("slip",), 3 * span)


def shaken(r: np.random.Generator, span: float) -> Part:
    """A block on a platform that a drive shakes. The peaks of its inertial force are slightly above or below the friction."""
    f, far, up = log_uniform(r, -0.5, 1.0) / span, log_uniform(r, NEAREST_LOAD, FARTHEST), bool(r.random() < 0.7)
    amplitude = float(r.uniform(0.01, 1.0))
    peak, phase = amplitude * (2 * math.pi * f) ** 2, float(r.uniform(0.0, 2 * math.pi))
    cap = peak / (1 + far if up else 1 - far)
    carrier = {"type": "prismatic", "axis": "x", "drive": {"harmonic": {"amplitude": amplitude, "frequency": f, "phase": phase}}}
    joint = {"type": "prismatic", "axis": "x", "friction": {"force": cap}}
    events = []
    if up:
        inside = math.acos(1 / (1 + far)) / (2 * math.pi * f)
        k0 = math.ceil(phase / math.pi - 0.5)
        tops = [(0.5 * math.pi + k * math.pi - phase) / (2 * math.pi * f) for k in range(k0 - 1, k0 + int(6 * span * f) + 4)]
        events = [("slip", t - inside) for t in tops if 0.0 < t - inside < 3 * span]
    return Part(joint, events, ("slip",), 3 * span, carrier=carrier)


FAMILIES: dict[str, Callable[[np.random.Generator, float], Part]] = {
    f.__name__: f
    for f in (thrown_at_stop, swung_at_stop, thrown_over_teeth, passed_hook, hook_let_go, loaded, braked, overrun, shaken)
}


OF_SIGNALS: dict[str, Callable[..., Part]] = {f.__name__: f for f in (hook_let_go, loaded, braked)}


def shaped(shape: Shape) -> dict[str, Callable[[np.random.Generator, float], Part]]:
    """The families whose result depends on a signal, with signals of this shape."""
    return {n: partial(f, shape=shape) for n, f in OF_SIGNALS.items()} | {"passed_hook": partial(passed_hook, shapes=(shape,))}


def brief_pass(seed: int, shape: Shape | None = None) -> BriefPass:
    """Scene number `seed`: from all families, or from the families with a signal of a given shape."""
    families = FAMILIES if shape is None else shaped(shape)
    r = np.random.default_rng([37, seed])
    span = log_uniform(r, -1.0, 1.0)
    names = r.choice(list(families), size=int(r.choice([1, 1, 1, 2, 3])), replace=False)
    parts = {f"j{i}": families[str(n)](r, span) for i, n in enumerate(names)}
    until = min(p.until for p in parts.values())
    times = sorted(t for p in parts.values() for _, t in p.events if t < until)
    gaps = np.diff([0.0, *times, until])
    k = int(np.argmax(gaps[1:])) + 1 if len(gaps) > 1 and r.random() < 0.4 else len(gaps) - 1
    left = [0.0, *times, until]
    until = left[k] + float(r.uniform(0.1, 0.9)) * (left[k + 1] - left[k])
    bodies, joints = {}, {}
    for n, p in parts.items():
        body = {"mass": p.mass, "inertia": [p.mass] * 3}
        bodies[f"{n}_body"] = body
        inboard = "ground"
        if p.carrier is not None:
            bodies[f"{n}_carrier"], joints[f"{n}_drive"] = body, p.carrier | {"inboard": "ground", "outboard": f"{n}_carrier"}
            inboard = f"{n}_carrier"
        joints[n] = p.joint | {"inboard": inboard, "outboard": f"{n}_body"}
    scene: dict[str, Any] = {"schema": 1, "gravity": [0.0, -GRAVITY, 0.0], "bodies": bodies, "joints": joints}
    made = BriefPass(scene, until, parts)
    if made.inputs:
        scene["inputs"] = {n: {"start": s.value(0.0)} for n, s in made.inputs.items()}
    return made
