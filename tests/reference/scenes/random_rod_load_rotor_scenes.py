"""Random scenes of rods, loads that depend on speed and position, nonlinear springs, and rotors, with friction in joints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.reference.scenes.random_linkage_scenes import ORIGIN, chain, point
from tests.reference.scenes.random_scene_draft import Draft


def surround(d: Draft, bodies: list[str], force: float, size: float) -> None:
    """Drag, a field or an attracting point at each of these bodies. force, size: typical force and typical length in the scene."""
    for i, body in enumerate(bodies):
        way = int(d.rng.integers(4))
        if way == 0:
            d.forces[f"air{i}"] = {"type": "drag", "on": body, "area": d.of(0.02, 0.3), "coefficient": d.of(0.4, 1.2),
                                   "density": d.of(1, 30)}  # fmt: skip
        elif way == 1:
            k, wide = force / size, d.of(0.5, 2) * size
            d.forces[f"field{i}"] = {"type": "field", "on": body, "fx": f"-{k:.6g} N/m*x*exp(-(y/({wide:.6g} m))^2)",
                                     "fy": f"{d.about(force):.6g} N*tanh(y/({wide:.6g} m))"}  # fmt: skip
        elif way == 2:
            gm = d.of(0.5, 2) * force * size**2
            d.forces[f"sun{i}"] = {"type": "point_gravity", "on": body, "towards": "ground.sun", "gm": gm}


def rod_loops(rng: Generator) -> dict[str, Any]:
    """Two cranks with friction and a rod between them, or a crank and a slider. A field, drag or an attracting point acts. A brake,
    a hook or a stop holds the links."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    turn, long = d.of(-3, 3), d.of(0.06, 0.1)
    a = long * point(math.cos(turn), math.sin(turn))
    d.bar("crank", point(0, 0), a)
    d.join("j0", "revolute", "ground", "crank", ORIGIN, d.pin(0.05), {"effort": d.sudden(0.6, until)}, d.going(6))
    if d.chance(0.5):
        o, other = point(d.of(0.25, 0.4), 0.0), d.of(-1, 1)
        b = o + d.of(0.12, 0.2) * point(math.sin(other), math.cos(other))
        d.bar("rocker", o, b)
        more = [d.brake(0.3, until) if d.chance(0.4) else d.pin(0.06), d.stops(300, 0.3, 0.3) if d.chance(0.4) else {}]
        more += [d.curved(0.3, 2.0, 0.05)] if d.chance(0.4) else []
        d.join("j1", "revolute", "ground", "rocker", o, *more)
        end: dict[str, Any] = {"body": "rocker", "point": [float(np.hypot(*(b - o))) / 2, 0, 0]}
        bodies = ["crank", "rocker"]
    else:
        at = [float(a[0]) + d.of(0.25, 0.4), d.of(-0.03, 0.03), 0.0]
        d.block("slide", at)
        more = [d.guide(2.0)]
        if d.chance(0.4):
            hook = {"at": d.of(0.002, 0.03), "stiffness": d.of(5e3, 4e4), "damping": d.of(0, 0.5), "release": d.lifting(until)}
            more += [{"latch": hook}]
        more += [d.stops(1e4, 0.04, 0.04)] if d.chance(0.4) else []
        more += [d.curved(0.03, 200, 3)] if d.chance(0.4) else []
        d.join("guide", "prismatic", "ground", "slide", at, *more, axis="x")
        end, bodies = {"body": "slide", "point": [0, 0, 0]}, ["crank", "slide"]
    d.rod("rod", {"body": "crank", "point": [long / 2, 0, 0]}, end)
    surround(d, bodies, 4.0, 0.1)
    return d.scene(until) | {"ground": {"points": {"sun": [0.15, d.of(0.25, 0.4), d.of(-0.1, 0.1)]}}}


def hung_frames(rng: Generator) -> dict[str, Any]:
    """A bar hangs on two rods from the ground or from a slider with friction. A pendulum or wheel with friction is on the bar. A
    nonlinear strut and drag damp the bar, and pulses push it."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    d.gravity = [0.0, -9.81, 0.0]
    half, drop = d.of(0.08, 0.14), d.of(0.15, 0.25)
    lean = d.of(-0.05, 0.05)
    left, right = point(-half, -drop - 0.2 * lean), point(half, -drop + 0.2 * lean)
    d.bar("bar", left, right)
    length = float(np.hypot(*(right - left)))
    d.bodies["bar"]["points"] = {"l": [-length / 2, 0, 0], "r": [length / 2, 0, 0]}
    d.join("sheet", "planar", "ground", "bar", (left + right) / 2)
    hangs = d.chance(0.5)
    over = [d.of(-0.03, 0.03) - half, 0.0, 0.0]
    if hangs:
        d.block("trolley", over)
        rubs = d.loaded(0.5, "force") if d.chance(0.2) else d.guide(3.0)
        more = [{"effort": d.sudden(8, until, " N")}, d.stops(5e3, 0.03, 0.03) if d.chance(0.4) else {}]
        d.join("rail", "prismatic", "ground", "trolley", over, rubs, *more, d.going(0.3), axis="x")
    d.rod("r0", {"body": "trolley", "point": [0, 0, 0]} if hangs else {"body": "ground", "point": over}, "bar.l")
    d.rod("r1", {"body": "ground", "point": [half + d.of(-0.02, 0.04), 0.0, 0.0]}, "bar.r")
    if d.chance(0.5):
        d.wheel("wheel", 0.05, [float(left[0]), float(left[1]), 0.03])
        at = [float(left[0]), float(left[1]), 0.03]
        d.join("axle", "revolute", "bar", "wheel", at, d.pin(0.05) if d.chance(0.5) else d.freewheel(0.03, 0.3),
               {"effort": d.sudden(0.3, until)})  # fmt: skip
    else:
        d.bar("hand", right, right + point(0.0, -0.12))
        d.join("axle", "revolute", "bar", "hand", right, d.pin(0.06), d.stops(200, 0.3, 0.3) if d.chance(0.5) else {})
    if d.chance(0.6):
        away = float(np.hypot(*(left - point(-0.4, -0.1))))
        d.forces["strut"] = {"type": "spring_damper", "between": ["ground.wall", "bar.l"], "stiffness": d.of(5, 60),
                             "length": away, **d.curved(0.05, 200, 5, rest=away)}  # fmt: skip
    push = [d.sudden(5, until, " N"), d.sudden(3, until, " N") if d.chance(0.5) else 0.0, 0.0]
    d.forces["push"] = {"type": "force", "on": "bar.r", "force": push}
    surround(d, ["bar"], 4.0, 0.1)
    return d.scene(until) | {"ground": {"points": {"sun": [0.0, -0.6, 0.0], "wall": [-0.4, -0.1, 0.0]}}}


def valve_trains(rng: Generator) -> dict[str, Any]:
    """A cam lifts a tappet in a guide. A rod or a rocker transmits the tappet's motion to a valve in another guide, against a
    nonlinear spring whose coils touch. A motor, a torque or a trapezoidal rate turns the cam."""
    d, until = Draft(rng), float(rng.uniform(0.3, 0.8))
    angles = np.linspace(0.0, 2 * np.pi, 13)
    lift = d.of(0.003, 0.008)
    radius = 0.04 + lift * np.cos(angles - d.of(0, 6))
    radius[-1] = radius[0]
    base = float(radius[3])  # radius of the cam towards y, where the tappet stands
    d.wheel("cam", 0.04, ORIGIN)
    way = int(rng.integers(3))
    turn = ([{"effort": d.sudden(0.8, until)}, d.pin(0.06), {"start": {"qd": d.about(8)}}],
            [{"motor": {"stall": d.of(0.5, 2), "no_load": d.of(10, 40), "signal": d.sudden(1.0, until, "")}}, d.brake(0.5, until)],
            [d.rates(15, until)])[way]  # fmt: skip
    d.join("turn", "revolute", "ground", "cam", ORIGIN, *turn)
    d.block("tappet", [0.0, base, 0.0], mass=d.of(0.1, 0.3))
    d.join("guide", "prismatic", "ground", "tappet", [0.0, base, 0.0], d.guide(1.0), axis="y")
    d.joints["follow"] = {"type": "cam", "axis": "z", "reference": "x", "inboard": {"body": "cam", "point": [0, 0, 0]},
                          "outboard": {"body": "tappet", "point": [0, 0, 0]}, "roller": 0.01,
                          "friction": {"mu": d.of(0.03, 0.15)},
                          "profile": {"angle": [float(a) for a in angles], "radius": [float(r) for r in radius]}}  # fmt: skip
    rocks = d.chance(0.5)
    at = [0.08, base + 0.02, 0.0] if rocks else [0.0, base + 0.12, 0.0]
    d.block("valve", at, mass=d.of(0.1, 0.3))
    rest = at[1] + d.of(0.02, 0.04) * (-1 if rocks else 1)
    more = [d.guide(1.0), d.curved(4 * lift, d.of(500, 2000), 5), {"spring": {"stiffness": d.of(200, 1500), "rest": rest - at[1]}}]
    more += [d.stops(1e4, 0.004, 0.004)] if d.chance(0.3) else []
    d.join("stem", "prismatic", "ground", "valve", at, *more, axis="y")
    if not rocks:
        d.rod("pushrod", {"body": "tappet", "point": [0, 0, 0]}, {"body": "valve", "point": [0, 0, 0]})
        return d.scene(until)
    y = base + 0.1
    d.bar("rocker", point(0.0, y), point(0.08, y))
    d.join("pivot", "revolute", "ground", "rocker", point(0.04, y), d.pin(0.02))
    d.rod("pushrod", {"body": "tappet", "point": [0, 0, 0]}, {"body": "rocker", "point": [-0.04, 0, 0]})
    d.rod("link", {"body": "rocker", "point": [0.04, 0, 0]}, {"body": "valve", "point": [0, 0, 0]})
    return d.scene(until)


def curved_rows(rng: Generator) -> dict[str, Any]:
    """Blocks in a row on rails with friction, with nonlinear springs and dampers between them. Some blocks have steps, pulses,
    stops or hooks. An attracting point or drag acts."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    count = int(rng.integers(3, 5))
    for i in range(count):
        at = [0.1 * i, 0.0, 0.0]
        d.block(f"b{i}", at)
        more: list[dict[str, Any]] = [d.loaded(2.0, "force") if d.chance(0.2) else d.guide(4.0)]
        more += [d.stops(1e4, 0.01, 0.01)] if d.chance(0.4) else []
        more += [{"effort": d.sudden(12, until, " N")}] if i == 0 or d.chance(0.4) else []
        if d.chance(0.3):
            hook = {"at": d.of(0.002, 0.02), "stiffness": d.of(5e3, 4e4), "damping": d.of(0, 0.5), "release": d.lifting(until)}
            more += [{"latch": hook}]
        d.join(f"r{i}", "prismatic", "ground", f"b{i}", at, *more, d.going(0.5, 0.6), axis="x")
    for i in range(count - 1):
        d.forces[f"s{i}"] = {"type": "spring_damper", "between": [f"b{i}.o", f"b{i + 1}.o"], "stiffness": d.of(50, 500),
                             "damping": d.of(0, 3), "length": 0.1, **d.curved(0.02, d.of(200, 1500), 10, rest=0.1)}  # fmt: skip
    surround(d, [f"b{i}" for i in range(count)], 5.0, 0.2)
    return d.scene(until) | {"ground": {"points": {"sun": [0.15, 0.25, 0.0]}}}


def spinning_rotors(rng: Generator) -> dict[str, Any]:
    """A rotor with axial inertia spins in a frame with one or two axes with friction. Steps turn the frame. A brake or a freewheel
    acts on the rotor, and stops or a nonlinear spring hold the frame."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    d.bodies["yoke"] = {"mass": 1.0, "inertia": [2e-3, 3e-3, 2.5e-3], "position": ORIGIN, "center": [0.02, 0.0, 0.0]}
    d.bodies["frame"] = {"mass": d.of(0.5, 1.5), "inertia": [2e-3, 1.5e-3, 2e-3], "position": ORIGIN}
    more = [{"effort": d.sudden(0.5, until)}, d.stops(100, 0.3, 0.3) if d.chance(0.4) else {}, d.going(3)]
    d.join("yaw", "revolute", "ground", "yoke", ORIGIN, d.pin(0.05, thrust=True), *more, axis="y")
    more = [d.curved(0.4, 2.0, 0.05) if d.chance(0.5) else {}, {"effort": d.sudden(0.3, until)} if d.chance(0.5) else {}]
    d.join("tilt", "revolute", "yoke", "frame", ORIGIN, d.loaded(0.05) if d.chance(0.4) else d.pin(0.05), *more, axis="z")
    axial = d.of(0.5, 2) * 1e-3
    d.bodies["rotor"] = {"mass": d.of(0.3, 1.0), "inertia": {"axial": axial, "axis": "x"}, "position": ORIGIN}
    spin = d.about(60)
    rubs = d.brake(0.3, until) if d.chance(0.5) else d.pin(0.05)
    d.join("spin", "revolute", "frame", "rotor", ORIGIN, rubs, {"start": {"qd": spin}}, axis="x")
    if d.chance(0.5):
        d.wheel("fly", 0.03, [0.05, 0.0, 0.0], "x")
        start = {"start": {"qd": d.about(10)}}
        d.join("free", "revolute", "rotor", "fly", [0.05, 0.0, 0.0], d.freewheel(0.02, 0.3), start, axis="x")
    return d.scene(until)


def started_linkages(rng: Generator) -> dict[str, Any]:
    """A five-bar or four-bar with friction. One joint has an exact start, other joints have guesses. Sudden torques, stops,
    nonlinear springs and drag act on the linkage."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    e = point(d.of(0.25, 0.35), d.of(-0.05, 0.05))
    nodes = [point(0, 0), point(d.of(-0.1, 0.05), d.of(0.08, 0.15)), e + point(d.of(-0.05, 0.1), d.of(0.1, 0.2)), e]
    if d.chance(0.4):
        nodes.insert(2, point(d.of(0.08, 0.22), d.of(0.22, 0.32)))
    chain(d, nodes)
    last = len(nodes) - 1
    d.joints["j0"] |= {"start": {"q": d.of(-0.1, 0.1), "qd": d.about(3), "use": "exact"}, "effort": d.sudden(0.6, until)}
    for i in range(1, last):
        d.joints[f"j{i}"]["start"] = {"q": d.of(-0.1, 0.1), "use": "guess"}
    d.joints[f"j{last}"] |= d.stops(200, 0.3, 0.3) if d.chance(0.5) else {"effort": d.sudden(0.3, until)}
    if d.chance(0.5):
        d.joints[f"j{last}"] |= d.curved(0.3, 2.0, 0.05)
    surround(d, [f"l{i}" for i in range(last)], 4.0, 0.1)
    return d.scene(until) | {"ground": {"points": {"sun": [0.15, 0.6, 0.1]}}}
