"""Random scenes of contacts that begin and end, beside joints with friction, stops, hooks, brakes, freewheels and gear units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.reference.scenes.random_linkage_scenes import ORIGIN, point
from tests.reference.scenes.random_scene_draft import Draft

WEIGHT = [0.0, -9.81, 0.0]


def level(height: float, ends: float = 5.0) -> dict[str, Any]:
    """A level line whose free side is above."""
    return {"points": [[ends, height], [-ends, height]]}


def touch(d: Draft, name: str, body: str, at: np.ndarray, curve: dict[str, Any], **more: Any) -> None:
    """A point of a body that touches a curve on the ground. Most contacts have friction, and some have a rebound."""
    joint: dict[str, Any] = {"type": "point_on_curve", "axis": "z", "reference": "x", "inboard": "ground", "curve": curve}
    joint["outboard"] = {"body": body, "point": [float(at[0]), float(at[1]), 0.0]}
    joint |= {"friction": {"mu": d.of(0.05, 0.5)}} if d.chance(0.7) else {}
    d.joints[name] = joint | {"unilateral": ({"restitution": d.of(0.1, 0.7)} if d.chance(0.4) else {}) | more}


def dropped_levers(rng: Generator) -> dict[str, Any]:
    """A lever on a pin with friction, or two levers in series, falls with its tip on a table. A brake, a freewheel, a spring, a
    stop or a sudden torque acts at the pins."""
    d, until = Draft(rng, gravity=WEIGHT), float(rng.uniform(0.3, 0.7))
    turn, long = d.of(-0.5, 0.9), d.of(0.12, 0.25)
    tip = long * point(math.cos(turn), math.sin(turn))
    d.bar("lever", point(0, 0), tip)
    way = int(rng.integers(4))
    rub = (d.pin(0.05), d.brake(0.3, until), d.freewheel(0.05, 0.6), d.loaded(0.05))[way]
    more = [{"spring": {"stiffness": d.of(0.5, 5), "rest": d.of(-0.5, 0.5)}}] if d.chance(0.4) else []
    more += [d.stops(200, 0.6, 0.3)] if d.chance(0.4) else []
    more += [{"effort": d.sudden(1.0, until)}] if d.chance(0.4) else []
    d.join("pivot", "revolute", "ground", "lever", ORIGIN, rub, *more, d.going(3))
    lowest = float(tip[1])
    if d.chance(0.5):
        second = tip + d.of(0.08, 0.15) * point(math.cos(0.7 * turn - 0.5), math.sin(0.7 * turn - 0.5))
        d.bar("hand", tip, second)
        d.join("knee", "revolute", "lever", "hand", tip, d.pin(0.03), d.stops(100, 0.5, 0.5) if d.chance(0.4) else {}, d.going(3))
        touch(d, "hand_touches", "hand", point(float(np.hypot(*(second - tip))) / 2, 0.0),
              level(min(lowest, float(second[1])) - d.of(0.0, 0.06)), starts="open")  # fmt: skip
        lowest = min(lowest, float(second[1]))
    touch(d, "tip_touches", "lever", point(long / 2, 0.0), level(lowest - d.of(0.0, 0.08)), starts="open")
    one = d.joints["tip_touches"]["unilateral"]
    if "hand_touches" in d.joints and d.chance(0.3):
        d.joints["hand_touches"]["unilateral"] = {**one, "impact_law": "poisson"}
        one["impact_law"] = "poisson"
    return d.scene(until)


def lifting_tappets(rng: Generator) -> dict[str, Any]:
    """A cam pushes a tappet in a guide with friction against a spring. The tappet lifts off and lands. Stops, a hook, or a rocker
    behind a rod act on it. A motor, a torque or a rate that begins suddenly turns the cam."""
    d, until = Draft(rng, gravity=WEIGHT), float(rng.uniform(0.3, 0.7))
    angles = np.linspace(0.0, 2 * np.pi, 13)
    lift = d.of(0.004, 0.01)
    radius = 0.04 + lift * np.cos(angles - d.of(0, 6))
    radius[-1] = radius[0]
    base = float(radius[3])
    d.wheel("cam", 0.04, ORIGIN)
    way = int(rng.integers(3))
    turn = ([{"effort": d.sudden(2.0, until)}, d.pin(0.06), {"start": {"qd": d.about(30)}}],
            [{"motor": {"stall": d.of(1, 4), "no_load": d.of(40, 90), "signal": d.sudden(1.0, until, "")}}, d.brake(0.5, until)],
            [d.rates(60, until)])[way]  # fmt: skip
    d.join("turn", "revolute", "ground", "cam", ORIGIN, *turn)
    d.block("tappet", [0.0, base, 0.0], mass=d.of(0.1, 0.3))
    stiff = d.of(100, 800)
    more = [d.guide(1.0), {"spring": {"stiffness": stiff, "rest": -d.of(0.0, 8.0) / stiff}}]
    more += [d.stops(2e4, 0.02, 0.012)] if d.chance(0.4) else []
    if d.chance(0.3):
        hook = {"at": d.of(0.003, 0.01), "stiffness": d.of(5e3, 4e4), "damping": d.of(0, 0.5), "release": d.lifting(until)}
        more += [{"latch": hook}]
    d.join("guide", "prismatic", "ground", "tappet", [0.0, base, 0.0], *more, axis="y")
    follow: dict[str, Any] = {"type": "cam", "axis": "z", "reference": "x", "inboard": {"body": "cam", "point": [0, 0, 0]},
                              "outboard": {"body": "tappet", "point": [0, 0, 0]}, "roller": 0.01,
                              "profile": {"angle": [float(a) for a in angles], "radius": [float(r) for r in radius]}}  # fmt: skip
    follow |= {"friction": {"mu": d.of(0.03, 0.15)}} if d.chance(0.7) else {}
    d.joints["follow"] = follow | {"unilateral": {"restitution": d.of(0.1, 0.6)} if d.chance(0.4) else {}}
    if d.chance(0.5):
        y = base + 0.1
        d.bar("rocker", point(0.0, y), point(0.08, y))
        d.join("pivot", "revolute", "ground", "rocker", point(0.04, y), d.pin(0.02))
        d.rod("pushrod", {"body": "tappet", "point": [0, 0, 0]}, {"body": "rocker", "point": [-0.04, 0, 0]})
    return d.scene(until)


def pulled_boxes(rng: Generator) -> dict[str, Any]:
    """A box on two feet is pushed or pulled: it slides, tips and lands. A slider with friction pulls the box by a rod or by a
    spring, or a pendulum with friction hangs on the box."""
    d, until = Draft(rng, gravity=WEIGHT), float(rng.uniform(0.3, 0.7))
    half, high, mass = d.of(0.05, 0.1), d.of(0.05, 0.15), d.of(0.5, 2)
    spin = mass * (half**2 + high**2) / 3
    d.bodies["box"] = {"mass": mass, "inertia": [spin, spin, spin], "position": [0.0, high, 0.0]}
    fly: dict[str, Any] = {"effort": [d.sudden(0.8 * mass * 9.81, until, " N"), None, None]} if d.chance(0.6) else {}
    d.join("fly", "planar", "ground", "box", [0.0, high, 0.0], fly, {"start": {"qd": [d.of(-1, 1), 0.0, 0.0]}})
    mu = {"friction": {"mu": d.of(0.1, 0.8)}}
    bounce = {"restitution": d.of(0.1, 0.6)} if d.chance(0.3) else {}
    for name, x in (("left", -half), ("right", half)):
        touch(d, name, "box", point(x, -high), level(0.0))
        d.joints[name] |= {**mu, "unilateral": bounce}
    way = int(rng.integers(3))
    if way == 0:
        at = [d.of(0.3, 0.4), d.of(0.05, 0.25), 0.0]
        d.block("slide", at)
        more = [d.stops(1e4, 0.03, 0.03)] if d.chance(0.5) else []
        d.join("guide", "prismatic", "ground", "slide", at, d.guide(2.0), {"effort": d.load(8, until)}, *more, axis="x")
        d.rod("tow", {"body": "box", "point": [half, 0, 0]}, {"body": "slide", "point": [0, 0, 0]})
    elif way == 1:
        d.bar("arm", point(0, 1.5 * high), point(0, 1.5 * high - d.of(0.1, 0.2)))
        d.join("hang", "revolute", "box", "arm", [0.0, 1.5 * high, 0.0], d.pin(0.05), d.going(8),
               {"effort": d.sudden(0.6, until)} if d.chance(0.4) else {})  # fmt: skip
    else:
        at = [-d.of(0.3, 0.4), high, 0.0]
        d.block("slide", at)
        d.join("guide", "prismatic", "ground", "slide", at, d.guide(2.0), {"effort": d.sudden(10, until, " N")}, axis="x")
        d.forces["cord"] = {"type": "spring_damper", "stiffness": d.of(50, 500), "damping": d.of(0, 5), "length": d.of(0.2, 0.3),
                            "between": ["slide.o", "box.grip"]}
        d.bodies["box"]["points"] = {"grip": [-half, d.of(-0.5, 1) * high, 0]}
    return d.scene(until)


def slotted_wheels(rng: Generator) -> dict[str, Any]:
    """The pin of a crank enters the slots of a Geneva wheel. A brake, a freewheel, a spring or friction acts on the wheel. A motor,
    a torque or a constant rate turns the crank."""
    d, until = Draft(rng), float(rng.uniform(0.3, 0.6))
    slots = int(rng.integers(4, 7))
    apart, half = 0.1, math.pi / slots
    r, long = apart * math.sin(half), apart * math.cos(half)
    early = math.pi / 2 - half + d.of(0.02, 0.8)
    sense = 1 if d.chance(0.5) else -1
    angle = math.pi + sense * early
    pin = point(apart + r * math.cos(angle), r * math.sin(angle))
    d.bar("crank", point(apart, 0), pin)
    d.wheel("wheel", 0.1, ORIGIN)
    rate = -sense * d.of(4, 12)
    way = int(rng.integers(3))
    drive = ([{"effort": d.sudden(0.5, until)}, d.pin(0.04), {"start": {"qd": rate}}],
             [{"motor": {"stall": d.of(1, 4), "no_load": 2 * abs(rate), "signal": math.copysign(1.0, rate)}}, d.brake(0.3, until),
              {"start": {"qd": rate}}],
             [{"drive": {"constant": {"rate": rate}}}])[way]  # fmt: skip
    d.join("shaft", "revolute", "ground", "crank", [apart, 0.0, 0.0], *drive)
    hold = (d.pin(0.05), d.brake(0.1, until), d.freewheel(0.02, 0.3), {})[int(rng.integers(4))]
    more = [{"spring": {"stiffness": d.of(0.02, 0.2), "rest": 0.0}}] if d.chance(0.4) else []
    more += [d.stops(100, 1.0, 1.0)] if d.chance(0.3) else []
    d.join("pivot", "revolute", "ground", "wheel", ORIGIN, hold, *more, {"start": {"q": -sense * half}})
    slot: dict[str, Any] = {"type": "pin_in_slot", "axis": "z", "reference": "x"}
    spot = float(np.hypot(*(pin - point(apart, 0)))) / 2
    slot |= {"inboard": {"body": "wheel", "point": [0, 0, 0]}, "outboard": {"body": "crank", "point": [spot, 0, 0]}}
    slot |= {"curve": {"points": [[0.2 * apart, 0.0], [long, 0.0]]}}
    slot |= {"slot": {"play": d.of(1e-4, 1e-3), "mouth": "end", "repeated": slots}}
    slot |= {"friction": {"mu": d.of(0.03, 0.2)}} if d.chance(0.5) else {}
    d.joints["pin"] = slot | {"unilateral": {"starts": "open"} | ({"restitution": d.of(0.1, 0.6)} if d.chance(0.3) else {})}
    return d.scene(until)


def braked_wheels(rng: Generator) -> dict[str, Any]:
    """A wheel in a swing arm rolls or slips on a track. A brake, a motor or a torque acts at the wheel's hub. The arm's slide has
    stops and friction."""
    d, until = Draft(rng, gravity=WEIGHT), float(rng.uniform(0.3, 0.7))
    radius, drop = d.of(0.04, 0.08), d.of(-0.02, 0.05)
    d.block("carriage", [0.0, radius + 0.1, 0.0], mass=d.of(0.5, 2))
    more = [d.stops(1e4, 0.1, 0.1)] if d.chance(0.4) else []
    rubs = d.guide(1.0) if d.chance(0.5) else {}
    pushed = {"effort": d.sudden(5, until, " N")} if d.chance(0.4) else {}
    d.join("rail", "prismatic", "ground", "carriage", [0.0, radius + 0.1, 0.0], rubs, pushed, *more, {"start": {"qd": d.of(-1, 1)}},
           axis="x")  # fmt: skip
    hub = point(0.12, radius + max(drop, 0.0))
    d.bar("arm", point(0, radius + 0.1), hub)
    press = [{"spring": {"stiffness": d.of(5, 40), "rest": -d.of(0.1, 0.5)}}] if d.chance(0.6) else []
    d.join("swing", "revolute", "carriage", "arm", [0.0, radius + 0.1, 0.0], d.pin(0.03), *press)
    d.wheel("wheel", radius, [float(hub[0]), float(hub[1]), 0.0])
    d.bodies["wheel"]["center"] = [0.0, 0.0, 0.0]
    way = int(rng.integers(3))
    braked = [d.brake(0.5, until), {"start": {"qd": d.of(-15, 15)}}]
    turned = [d.pin(0.02), {"effort": d.sudden(0.8, until)}]
    driven = [{"motor": {"stall": d.of(0.5, 2), "no_load": d.of(10, 40), "signal": d.sudden(1.0, until, "")}}, d.pin(0.02)]
    acts = (braked, turned, driven)[way]
    d.join("hub", "revolute", "arm", "wheel", [float(hub[0]), float(hub[1]), 0.0], *acts)
    wavy = d.chance(0.4)
    x = np.linspace(3.0, -3.0, 61)
    y = radius + (d.of(0.001, 0.006) * np.sin(d.of(10, 25) * (x - 0.12)) if wavy else 0 * x)
    curve = {"points": [[float(a), float(b)] for a, b in zip(x, y, strict=True)]} if wavy else level(radius)
    touch(d, "track", "wheel", ORIGIN[:2], curve, **({"starts": "open"} if drop > 0 else {}))
    d.joints["track"] |= {"roller": radius, "friction": {"mu": d.of(0.1, 0.8)}}
    return d.scene(until)
