"""Random scenes of linkages in which devices interact: screws, hooks, ratchets, freewheels, drives, grippers, slots and stops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.reference.scenes.random_scene_draft import Draft

ORIGIN = [0.0, 0.0, 0.0]


def point(x: float, y: float) -> np.ndarray:
    """A point of the plane."""
    return np.array([x, y])


def chain(d: Draft, nodes: list[np.ndarray], pins: float = 0.05, share: float = 0.8) -> None:
    """Links l0, l1, … between the nodes, and revolutes j0, j1, … at the nodes. The ground holds both ends. A share of the pins has
    friction."""
    last = len(nodes) - 1
    for i in range(last):
        d.bar(f"l{i}", nodes[i], nodes[i + 1])
    for i, at in enumerate(nodes):
        ends = ("ground", "l0") if i == 0 else ("ground", f"l{last - 1}") if i == last else (f"l{i - 1}", f"l{i}")
        d.join(f"j{i}", "revolute", *ends, at, d.pin(pins) if d.chance(share) else {})


def four_bar(d: Draft, grashof: bool = True) -> None:
    """A four-bar: a crank j0 that can turn fully, a coupler, and a rocker on j3."""
    crank, ground = d.of(0.05, 0.09), d.of(0.25, 0.35)
    rocker = d.of(0.2, 0.28)
    coupler = d.of(1.02, 1.15) * (ground + crank - rocker + 0.12) if grashof else d.of(0.2, 0.35)
    turn = d.of(-3, 3)
    a, o = crank * point(math.cos(turn), math.sin(turn)), point(ground, 0.0)
    chain(d, [point(0, 0), a, _circles(a, coupler, o, rocker), o])


def _circles(a: np.ndarray, ra: float, b: np.ndarray, rb: float) -> np.ndarray:
    """The upper point at these distances from two points. The first distance is changed if no point has these distances."""
    way = float(np.hypot(*(b - a)))
    ra = min(max(ra, abs(way - rb) * 1.05), (way + rb) * 0.97)
    along = (ra**2 - rb**2 + way**2) / (2 * way)
    e = (b - a) / way
    return a + along * e + math.sqrt(max(ra**2 - along**2, 1e-6)) * point(-e[1], e[0])


def crank_slider(d: Draft, *guide: dict[str, Any]) -> None:
    """A crank on j0, a rod, and a piston on a guide along x with devices. The guide's coordinate is 0 at the start."""
    turn, crank = d.of(-3, 3), d.of(0.05, 0.1)
    a = crank * point(math.cos(turn), math.sin(turn))
    p = point(a[0] + math.sqrt(d.of(0.2, 0.4) ** 2 - a[1] ** 2), 0.0)
    d.bar("l0", point(0, 0), a)
    d.bar("l1", a, p)
    d.block("piston", [float(p[0]), 0.0, 0.0])
    d.join("j0", "revolute", "ground", "l0", ORIGIN, d.pin(0.05))
    d.join("j1", "revolute", "l0", "l1", a, d.pin(0.03))
    d.join("j2", "revolute", "l1", "piston", p, d.pin(0.03))
    d.join("guide", "prismatic", "ground", "piston", p, *guide, axis="x")


def screws_in_loops(rng: Generator) -> dict[str, Any]:
    """A jack: a spindle in a bearing, a nut on a guide, and a thread between them. Half of the jacks have a second nut on a second
    thread. Threads are self-locking or not. The guide has a spring, a stop or a load."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    d.gravity = [0.0, 0.0, -9.81] if d.chance(0.5) else d.gravity
    d.wheel("spindle", 0.03, ORIGIN)
    start = d.going(8)
    d.join("turn", "revolute", "ground", "spindle", ORIGIN, {"effort": d.load(0.5, until)}, d.pin(0.06, thrust=True), start)
    for i in range(1 + int(d.chance(0.5))):
        at = [0.0, 0.0, 0.05 * i]
        d.block(f"nut{i}", at, mass=d.of(0.5, 4))
        more = [d.guide(3.0), {"effort": d.load(8, until)} if d.chance(0.6) else {}]
        more += [{"spring": {"stiffness": d.of(200, 3000), "rest": d.of(-0.01, 0.01)}}] if d.chance(0.5) else []
        more += [d.stops(1e4, 0.005, 0.005)] if d.chance(0.4) else []
        d.join(f"rail{i}", "prismatic", "ground", f"nut{i}", at, *more)
        pitch = d.of(0.004, 0.03) * (1 if i == 0 or d.chance(0.5) else -1)
        rub: dict[str, Any] = {"mu": d.of(0.05, 0.25), "radius": d.of(0.006, 0.012), "flank_angle": d.of(0, 0.5)}
        rub |= {"preload": d.of(2, 40)} if d.chance(0.4) else {}
        d.join(f"thread{i}", "screw", "spindle", f"nut{i}", at, {"pitch": pitch, "friction": rub})
    return d.scene(until)


def screw_levers(rng: Generator) -> dict[str, Any]:
    """A spindle moves a nut on a guide, and a link lifts a lever. A torque or a motor turns the spindle. The lever has a stop."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    nut, pivot = point(d.of(0.01, 0.03), 0.0), point(d.of(0.12, 0.2), 0.0)
    elbow = _circles(nut, d.of(0.12, 0.18), pivot, d.of(0.12, 0.18))
    d.wheel("spindle", 0.02, ORIGIN, "x")
    d.block("nut", [float(nut[0]), 0.0, 0.0])
    d.bar("link", nut, elbow)
    d.bar("lever", elbow, pivot)
    turn = {"motor": {"stall": d.of(0.2, 1), "no_load": d.of(20, 60), "signal": d.load(1.0, until)}}
    d.join("turn", "revolute", "ground", "spindle", ORIGIN, turn if d.chance(0.5) else {"effort": d.load(0.4, until)},
           d.pin(0.05, thrust=True), d.going(8), axis="x")  # fmt: skip
    rub = {"mu": d.of(0.05, 0.25), "radius": d.of(0.006, 0.012), "flank_angle": d.of(0, 0.5)}
    d.join("thread", "screw", "spindle", "nut", nut, {"pitch": d.of(0.005, 0.03), "friction": rub}, axis="x")
    d.join("rail", "prismatic", "ground", "nut", nut, d.guide(2.0) if d.chance(0.6) else {}, axis="x")
    d.join("n", "revolute", "nut", "link", nut, d.pin(0.03))
    d.join("e", "revolute", "link", "lever", elbow, d.pin(0.03) if d.chance(0.7) else {})
    d.join("p", "revolute", "ground", "lever", pivot, d.pin(0.06), d.stops(500, 0.1, 0.1) if d.chance(0.5) else {})
    return d.scene(until)


def hooks_in_loops(rng: Generator) -> dict[str, Any]:
    """A crank-slider with friction. A hook catches and releases its piston. The piston also has a stop and a spring."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.2))
    side = 1 if d.chance(0.5) else -1
    hook = {"at": side * d.of(0.002, 0.03), "keeps": "above" if side > 0 else "below", "stiffness": d.of(5e3, 4e4),
            "damping": d.of(0, 0.5), "release": d.lifting(until)}  # fmt: skip
    hook |= {"holds": d.of(20, 80)} if d.chance(0.3) else {}
    more: list[dict[str, Any]] = [d.guide(2.0), {"latch": hook}]
    more += [d.stops(1e4, 0.04, 0.04)] if d.chance(0.5) else []
    more += [{"spring": {"stiffness": d.of(20, 300), "rest": d.of(-0.03, 0.03)}}] if d.chance(0.4) else []
    crank_slider(d, *more)
    d.joints["j0"] |= {"effort": d.load(0.6, until)} | d.going(6)
    return d.scene(until)


def ratchets_in_loops(rng: Generator) -> dict[str, Any]:
    """A four-bar moves a rocker, which drives a wheel by a freewheel. A pawl holds the wheel or the rocker."""
    d, until = Draft(rng), float(rng.uniform(0.5, 1.2))
    four_bar(d)
    d.joints["j0"] |= {"effort": d.load(0.8, until)} | d.going(8, 0.1)
    at = [*map(float, d.joints["j3"]["at"][:2]), 0.04]
    d.wheel("wheel", 0.06, at)
    pawl = {"latch": {"at": d.of(0.01, 0.06), "stiffness": d.of(100, 2000), "damping": d.of(0, 0.3), "pitch": d.of(0.04, 0.12),
                      "keeps": "above" if d.chance(0.5) else "below", "release": d.lifting(until)}}  # fmt: skip
    on_wheel = d.chance(0.6)
    d.join("hub", "revolute", "ground", "wheel", at, d.pin(0.05), {"effort": d.load(0.1, until)}, pawl if on_wheel else {})
    d.join("free", "revolute", "l2", "wheel", at, d.freewheel(0.03, 0.6))
    if not on_wheel:
        d.joints["j3"] |= pawl
    return d.scene(until)


def freewheels_in_four_bars(rng: Generator) -> dict[str, Any]:
    """A four-bar whose crank, rocker or coupler drives a flywheel by a freewheel. The flywheel has a brake or a load."""
    d, until = Draft(rng), float(rng.uniform(0.5, 1.2))
    four_bar(d, grashof=d.chance(0.7))
    if d.chance(0.3):
        d.joints["j0"]["motor"] = {"stall": d.of(0.3, 1.5), "no_load": d.of(10, 40), "signal": d.load(1, until)}
    else:
        d.joints["j0"] |= {"effort": d.load(0.6, until)} | d.going(6)
    where = int(rng.integers(3))
    link, at = (("l0", d.joints["j0"]["at"]), ("l2", d.joints["j3"]["at"]), ("l1", d.joints["j1"]["at"]))[where]
    at = [at[0], at[1], 0.05]
    d.wheel("fly", 0.06, at)
    d.join("free", "revolute", link, "fly", at, d.freewheel(0.03, 0.5))
    if where < 2 and d.chance(0.6):
        d.join("hub", "revolute", "ground", "fly", at, d.brake(0.3, until) if d.chance(0.5) else d.pin(0.05))
    return d.scene(until)


def grippers(rng: Generator) -> dict[str, Any]:
    """A rod pushes two fingers by links, or one finger mimics the other. Stops represent the gripped object. The lower finger is
    slightly shorter. (If two mirrored links straightened at one instant, rigid bodies would have no solution: only infinite forces
    could keep fingers of different mass and friction together.)"""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    d.block("rod", ORIGIN)
    push = {"effort": d.load(12, until)}
    d.join("rail", "prismatic", "ground", "rod", ORIGIN, push, d.guide(2.0), d.going(0.3), axis="x")
    x, y, reach, arm = d.of(0.1, 0.14), d.of(0.03, 0.05), d.of(0.07, 0.1), d.of(0.06, 0.09)
    tie = d.chance(0.4)
    for name, s, part in (("a", 1, 1.0), ("b", -1, 0.9)):
        upper = _circles(point(0, 0), reach, point(x, y), part * arm)
        pivot, elbow = point(x, s * y), point(upper[0], s * upper[1])
        d.bar(f"finger_{name}", pivot, elbow)
        gripped = [d.stops(300, 0.08, 0.08)] if d.chance(0.7) else []
        if s < 0 and tie:
            d.join(f"f{name}", "revolute", "ground", f"finger_{name}", pivot, d.pin(0.04), {"mimic": {"joint": "fa", "ratio": -1}})
            continue
        d.join(f"f{name}", "revolute", "ground", f"finger_{name}", pivot, d.pin(0.04), *gripped)
        d.bar(f"link_{name}", point(0, 0), elbow)
        d.join(f"r{name}", "revolute", "rod", f"link_{name}", ORIGIN, d.pin(0.02))
        d.join(f"e{name}", "revolute", f"link_{name}", f"finger_{name}", elbow, d.pin(0.02) if d.chance(0.7) else {})
    return d.scene(until)


def slots(rng: Generator) -> dict[str, Any]:
    """A crank's pin moves in a straight or curved slot of a slide or a rocker. The slide or rocker has a spring, a stop or a
    brake."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    crank, turn = d.of(0.04, 0.08), d.of(-3, 3)
    pin = crank * point(math.cos(turn), math.sin(turn))
    d.bar("l0", point(0, 0), pin)
    length = float(np.hypot(*pin))
    d.bodies["l0"]["points"] = {"pin": [length / 2, 0, 0]}
    d.join("j0", "revolute", "ground", "l0", ORIGIN, d.pin(0.05), {"effort": d.load(0.6, until)}, d.going(8, 0.2))
    slides = d.chance(0.6)
    bow = d.of(0.1, 0.5) if d.chance(0.5) else 0.0
    ys = np.linspace(-0.12, 0.12, 7)
    if slides:
        at = [float(pin[0]) - bow * float(pin[1]) ** 2 / 0.1, 0.0, 0.0]
        d.block("yoke", at)
        more: list[dict[str, Any]] = [d.guide(2.0), {"effort": d.load(3, until)} if d.chance(0.4) else {}]
        more += [d.stops(5e3, 0.04, 0.04)] if d.chance(0.4) else []
        more += [{"spring": {"stiffness": d.of(20, 300), "rest": d.of(-0.03, 0.03)}}] if d.chance(0.4) else []
        d.join("guide", "prismatic", "ground", "yoke", at, *more, axis="x")
        curve = [[float(bow * y**2 / 0.1), float(y)] for y in ys]
    else:
        pivot = point(0.0, -d.of(0.14, 0.2))
        way = pin - pivot
        d.bodies["yoke"] = {"mass": d.of(0.3, 1.5), "inertia": [4e-3, 5e-4, 4e-3], "position": [0.0, float(pivot[1]), 0.0],
                            "orientation": {"axis": "z", "angle": math.atan2(-way[0], way[1])}}  # fmt: skip
        rubs = d.brake(0.3, until) if d.chance(0.4) else d.pin(0.06)
        d.join("swing", "revolute", "ground", "yoke", pivot, rubs, d.stops(500, 0.3, 0.3) if d.chance(0.4) else {})
        curve = [[float(bow * 0.2 * y**2), float(y)] for y in np.linspace(0.03, 0.35, 7)]
        reach = float(np.hypot(*way))
        d.bodies["yoke"]["orientation"]["angle"] += math.asin(min(0.2 * bow * reach, 0.9))
    rub = {"friction": {"mu": d.of(0.03, 0.2)} if d.chance(0.7) else {"force": d.of(0.3, 3)}}
    local: dict[str, Any] = {"body": "yoke", "point": [0, 0, 0], "axis": "z", "reference": "x"}
    outer: dict[str, Any] = {"body": "l0", "point": "pin", "axis": "z", "reference": "x"}
    d.joints["slot"] = {"type": "point_on_curve", "inboard": local, "outboard": outer, "curve": {"points": curve}, **rub}
    return d.scene(until)


def stops_beside_sticking_pairs(rng: Generator) -> dict[str, Any]:
    """Blocks in a row on rails with friction. Springs connect the blocks, some blocks have stops, and a push acts on the first
    block. Or a five-bar whose end links have stops."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    if d.chance(0.35):
        return five_bar_scene(d, until, stops=True)
    count = int(rng.integers(3, 6))
    for i in range(count):
        at = [0.1 * i, 0.0, 0.0]
        d.block(f"b{i}", at)
        more: list[dict[str, Any]] = [d.guide(4.0), d.stops(1e4, 0.01, 0.01) if d.chance(0.6) else {}]
        more += [{"effort": d.load(12, until)}] if i == 0 or d.chance(0.3) else []
        d.join(f"r{i}", "prismatic", "ground", f"b{i}", at, *more, d.going(0.5, 0.6), axis="x")
    for i in range(count - 1):
        d.forces[f"s{i}"] = {"type": "spring_damper", "between": [f"b{i}.o", f"b{i + 1}.o"], "stiffness": d.of(50, 2000),
                             "damping": d.of(0, 3), "length": 0.1}  # fmt: skip
    return d.scene(until)


def five_bar_scene(d: Draft, until: float, stops: bool = False) -> dict[str, Any]:
    """A five-bar of two freedoms with a torque at each end, and with stops or a brake at the ends."""
    e = point(d.of(0.25, 0.35), d.of(-0.05, 0.05))
    nodes = [point(0, 0), point(d.of(-0.1, 0.05), d.of(0.08, 0.15)), point(d.of(0.08, 0.22), d.of(0.22, 0.32)),
             e + point(d.of(-0.05, 0.1), d.of(0.06, 0.12)), e]  # fmt: skip
    chain(d, nodes)
    for name in ("j0", "j4"):
        d.joints[name] |= {"effort": d.load(0.5, until)} | d.going(4)
        d.joints[name] |= d.stops(200, 0.3, 0.3) if stops else d.brake(0.3, until) if d.chance(0.4) else {}
    return d.scene(until)


def five_bars(rng: Generator) -> dict[str, Any]:
    """A five-bar with brakes that act only for some of the time."""
    return five_bar_scene(Draft(rng), float(rng.uniform(0.4, 1.0)))


def drives_that_die(rng: Generator) -> dict[str, Any]:
    """A drive moves a four-bar or a crank-slider and comes to rest. A wheel or a pendulum on the last link coasts or sticks, or a
    stop catches the last link."""
    d, until = Draft(rng), float(rng.uniform(0.5, 1.2))
    slider = d.chance(0.4)
    if slider:
        crank_slider(d, d.guide(3.0), d.stops(5e3, 0.1, 0.1) if d.chance(0.3) else {})
    else:
        four_bar(d)
    way = int(rng.integers(3))
    begin = d.of(0.1, 0.3) * until
    drives: tuple[dict[str, Any], ...] = (
        {"ramp": {"start": d.about(6), "end": 0.0, "duration": d.of(0.3, 0.6) * until}},
        {"move": {"start": 0.0, "end": d.about(1.5), "duration": d.of(0.4, 0.6) * until, "begin": begin,
                  "profile": str(rng.choice(["polynomial", "trapezoid", "s_curve"]))}},
        {"harmonic": {"amplitude": d.of(0.2, 0.6), "frequency": d.of(0.6, 1.5) / until, "phase": 0.0}},
    )  # fmt: skip
    d.joints["j0"]["drive"] = drives[way]
    link, at = ("l1", d.joints["j2"]["at"]) if slider else ("l2", d.joints["j2"]["at"])
    if d.chance(0.5):
        d.wheel("fly", 0.05, [at[0], at[1], 0.04])
        d.join("hang", "revolute", link, "fly", [at[0], at[1], 0.04], d.pin(0.03) if d.chance(0.6) else d.freewheel(0.02, 0.3))
    else:
        a = point(at[0], at[1])
        d.bar("fly", a, a + d.of(0.08, 0.15) * point(math.sin(turn := d.of(-3, 3)), math.cos(turn)))
        d.join("hang", "revolute", link, "fly", at, d.pin(0.06), d.stops(200, 0.3, 0.3) if d.chance(0.5) else {})
    return d.scene(until)


def blocks_on_belts(rng: Generator) -> dict[str, Any]:
    """Blocks connected by springs on a belt that is driven, pulled or stopped. Each block sticks to the belt and slips. Every
    second block has a separate lane: blocks pass each other, and no spring shrinks to a point, where its force has no direction."""
    d, until = Draft(rng), float(rng.uniform(0.6, 1.2))
    d.gravity = [0.0, 0.0, -9.81]
    d.block("belt", ORIGIN, mass=d.of(1, 4))
    speed = d.about(0.3)
    drive = ({"drive": {"constant": {"rate": speed}}}, {"drive": {"ramp": {"start": speed, "end": 0.0, "duration": 0.6 * until}}},
             {"drive": {"harmonic": {"amplitude": 0.05, "frequency": 1.5 / until}}},
             {"effort": d.load(8, until), **d.guide(2.0)})[int(rng.integers(4))]  # fmt: skip
    d.join("run", "prismatic", "ground", "belt", ORIGIN, drive, axis="x")
    count = int(rng.integers(2, 5))
    for i in range(count):
        at = [0.1 * i, 0.03 * (i % 2), 0.02]
        d.block(f"b{i}", at)
        more = d.stops(5e3, 0.05, 0.05) if d.chance(0.3) else {}
        d.join(f"r{i}", "prismatic", "belt", f"b{i}", at, d.guide(2.5), more, axis="x")
    for i in range(count - 1):
        d.forces[f"s{i}"] = {"type": "spring_damper", "between": [f"b{i}.o", f"b{i + 1}.o"], "stiffness": d.of(30, 500),
                             "damping": d.of(0, 2), "length": 0.1}  # fmt: skip
    d.forces["hold"] = {"type": "spring_damper", "between": ["ground.wall", "b0.o"], "stiffness": d.of(50, 500), "length": 0.3}
    return d.scene(until) | {"ground": {"points": {"wall": [-0.3, 0.0, 0.02]}}}
