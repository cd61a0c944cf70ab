"""Random scenes of gear units, worms and joints with load-dependent friction. Each has devices on the driven side."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.reference.scenes.random_linkage_scenes import ORIGIN, crank_slider, four_bar, point
from tests.reference.scenes.random_scene_draft import Draft


def shaft(d: Draft, until: float, size: float, at: list[float], axis: str = "z", fast: float = 20.0) -> None:
    """A rotor on its bearing. A torque, a motor with a brake beside it, or a prescribed rate moves the rotor. size: of the
    torque."""
    d.wheel("rotor", 0.02, at, axis)
    way = int(d.rng.integers(4))
    turn: list[dict[str, Any]] = [{"effort": d.sudden(size, until)}, d.pin(0.1 * size)]
    if way == 1:
        turn = [{"motor": {"stall": d.of(0.5, 2) * size, "no_load": d.of(1, 4) * fast, "signal": d.sudden(1.0, until, "")}}]
        turn += [d.brake(0.6 * size, until)] if d.chance(0.5) else []
    if way == 2:
        turn = [{"effort": d.load(size, until)}, d.brake(0.6 * size, until), d.going(fast)]
    if way == 3:
        turn = [d.rates(fast, until)]
    d.join("motor", "revolute", "ground", "rotor", at, *turn, axis=axis)


def geared_linkages(rng: Generator) -> dict[str, Any]:
    """A gear unit, which may lock itself, turns the crank of a four-bar or crank-slider with friction. The last link has a stop, a
    nonlinear spring, or both. The crank's bearing may have friction."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    more = [d.stops(500, 0.3, 0.3)] if d.chance(0.5) else []
    more += [d.curved(0.2, 3.0, 0.1)] if d.chance(0.5) else []
    if d.chance(0.5):
        four_bar(d, grashof=d.chance(0.7))
        for one in more:
            d.joints["j3"] |= one
    else:
        more = [d.stops(5e3, 0.04, 0.04)] if d.chance(0.5) else []
        more += [d.curved(0.03, 300, 5)] if d.chance(0.5) else []
        crank_slider(d, d.guide(2.0), *more)
    ratio = float(rng.choice([2.0, 8.0, 30.0]))
    shaft(d, until, 0.8 / ratio, [0.0, 0.0, -0.1], fast=5 * ratio)
    d.joints["unit"] = {"type": "gearbox", "inboard": "rotor", "outboard": "l0", **d.unit(ratio, 0.8)}
    return d.scene(until)


def winches(rng: Generator) -> dict[str, Any]:
    """A winch lifts a load that slides in a guide or swings about a pivot, by a rope or by a lever and a rod. A gear unit, a brake
    and a freewheel hold the load."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    d.gravity = [0.0, -9.81, 0.0]
    ratio, radius = float(rng.choice([5.0, 20.0, 50.0])), d.of(0.04, 0.08)
    mass = d.of(1, 5)
    torque = 9.81 * mass * radius
    shaft(d, until, torque / ratio, [0.0, 0.0, -0.2], fast=3 * ratio)
    held = d.freewheel(0.05 * torque, 0.5 * torque) if d.chance(0.3) else d.pin(0.05 * torque)
    d.wheel("drum", radius, ORIGIN)
    d.join("bearing", "revolute", "ground", "drum", ORIGIN, held, {"rotor_inertia": d.of(0.1, 1) * 1e-3} if d.chance(0.3) else {})
    d.joints["unit"] = {"type": "gearbox", "inboard": "rotor", "outboard": "drum", **d.unit(ratio, torque)}
    more = [d.stops(2e4, 0.01, 0.01)] if d.chance(0.4) else []
    more += [d.curved(0.02, 20 * mass / 0.02, 10 * mass)] if d.chance(0.3) else []
    way = int(rng.integers(3))
    if way == 0:
        d.block("load", [radius, -0.2, 0.0], mass)
        d.join("guide", "prismatic", "ground", "load", [radius, -0.2, 0.0], d.guide(0.1 * mass * 9.81), *more, axis="y")
        d.joints["rope"] = {"type": "rack", "inboard": {"body": "drum", "axis": "z"}, "outboard": {"body": "load", "axis": "y"},
                            "radii": [radius]}  # fmt: skip
        return d.scene(until)
    turn = d.of(-1, 1)
    pin = radius * point(math.cos(turn), math.sin(turn))
    if way == 1:  # A rod connects a block in a guide with a lever of the drum.
        d.block("load", [float(pin[0]), -0.3, 0.0], mass)
        d.join("guide", "prismatic", "ground", "load", [float(pin[0]), -0.3, 0.0], d.guide(0.1 * mass * 9.81), *more, axis="y")
        end: dict[str, Any] = {"body": "load", "point": [0, 0, 0]}
    else:
        a, b = point(0.3, -0.25), point(0.08, -0.25)
        d.bar("arm", a, b)
        d.join("pivot", "revolute", "ground", "arm", a, d.pin(0.05 * torque), d.stops(500, 0.1, 0.1) if d.chance(0.4) else {})
        end = {"body": "arm", "point": [0.11, 0, 0]}
    d.rod("hanger", {"body": "drum", "point": [float(pin[0]), float(pin[1]), 0.0]}, end)
    return d.scene(until)


def worm_drives(rng: Generator) -> dict[str, Any]:
    """A worm, which may lock itself, turns a wheel. On the wheel's shaft is the crank of a four-bar with friction, a brake, a
    nonlinear spring with stops, or a freewheel with a flywheel."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    lead = math.radians(d.of(2, 20)) * (1 if d.chance(0.7) else -1)
    threads, teeth, module = int(rng.integers(1, 4)), int(rng.integers(24, 44)), 2e-3
    apart = module / 2 * (threads / abs(math.tan(lead)) + teeth)
    ratio = teeth / threads
    crank = d.chance(0.5)
    if crank:
        four_bar(d, grashof=d.chance(0.7))
        d.joints["j3"] |= d.stops(500, 0.3, 0.3) if d.chance(0.5) else {}
        hub = d.joints["j0"]
        wheel = "l0"
    else:
        d.wheel("wheel", 0.04, ORIGIN)
        more = [{"effort": d.sudden(0.6, until)} if d.chance(0.6) else {}]
        more += [d.stops(200, 0.2, 0.2)] if d.chance(0.4) else []
        more += [d.curved(0.3, 2.0, 0.05)] if d.chance(0.4) else []
        d.join("hub", "revolute", "ground", "wheel", ORIGIN, *more, d.brake(0.3, until) if d.chance(0.5) else d.pin(0.05))
        hub, wheel = d.joints["hub"], "wheel"
        if d.chance(0.4):
            d.wheel("fly", 0.05, [0.0, 0.0, 0.05])
            d.join("free", "revolute", "wheel", "fly", [0.0, 0.0, 0.05], d.freewheel(0.03, 0.5))
    shaft(d, until, 0.8 / ratio, [0.0, -apart, 0.0], "x", fast=4 * ratio)
    hub["start"] = {"q": 0.0, "use": "exact"} if d.chance(0.2) else {}
    rub = {"friction": {"mu": d.of(0.03, 0.2), "pressure_angle": "20 deg"}} if d.chance(0.85) else {}
    if rub and d.chance(0.3):
        rub["friction"]["mu_static"] = 1.3 * rub["friction"]["mu"]
    if not hub["start"]:
        del hub["start"]
    d.joints["mesh"] = {"type": "worm", "inboard": {"body": "rotor", "axis": "x"}, "outboard": {"body": wheel, "axis": "z"},
                        "teeth": [threads, teeth], "module": module, "lead_angle": lead, **rub}  # fmt: skip
    if crank:  # the crank's frame turns about z, so z is the wheel's axis there, and the crank's pivot is the wheel's centre
        half = float(np.hypot(*np.array(d.bodies["l0"]["position"][:2])))
        d.joints["mesh"]["outboard"]["point"] = [-half, 0.0, 0.0]
    return d.scene(until)


def loaded_arms(rng: Generator) -> dict[str, Any]:
    """An arm of two or three joints whose friction grows with the transmitted load. Motors, efforts and springs move the joints. A
    ratchet, a stop or a brake holds one joint. A rod may tie the last link to a slider with friction."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    count = int(rng.integers(2, 4))
    nodes, turn = [point(0, 0)], d.of(-3, 3)
    for _ in range(count):
        turn += d.of(-1.2, 1.2)
        nodes.append(nodes[-1] + d.of(0.1, 0.2) * point(math.cos(turn), math.sin(turn)))
    for i in range(count):
        size = 2.0 / (i + 1)
        d.bar(f"a{i}", nodes[i], nodes[i + 1])
        more: list[dict[str, Any]] = [{"effort": d.sudden(size, until)}]
        if d.chance(0.3):
            more = [{"motor": {"stall": d.of(1, 3) * size, "no_load": d.of(5, 20), "signal": d.load(1.0, until)}}]
        more += [{"rotor_inertia": d.of(0.2, 2) * 1e-3}] if d.chance(0.4) else []
        more += [{"spring": {"stiffness": d.of(1, 10), "rest": d.of(-0.5, 0.5)}}] if d.chance(0.3) else []
        more += [d.curved(0.4, 5.0, 0.2)] if d.chance(0.25) else []
        held = d.loaded(0.1 * size) if d.chance(0.8) else d.brake(0.3 * size, until)
        d.join(f"j{i}", "revolute", "ground" if i == 0 else f"a{i - 1}", f"a{i}", nodes[i], *more, held, d.going(3, 0.4))
    if d.chance(0.4):
        pawl = {"at": d.of(0.01, 0.06), "stiffness": d.of(300, 3000), "damping": d.of(0, 0.3), "pitch": d.of(0.04, 0.12),
                "keeps": "above" if d.chance(0.5) else "below", "release": d.lifting(until)}  # fmt: skip
        d.joints[f"j{int(rng.integers(count))}"]["latch"] = pawl
    elif d.chance(0.6):
        d.joints[f"j{int(rng.integers(count))}"] |= d.stops(500, 0.3, 0.3)
    if d.chance(0.4):
        end = nodes[-1]
        place = [float(end[0]) + 0.2, float(end[1]) + 0.1, 0.0]
        d.block("slide", place)
        rubs = d.loaded(0.5, "force") if d.chance(0.5) else d.guide(2.0)
        more = [{"effort": d.sudden(4, until, " N")} if d.chance(0.5) else {}, d.stops(5e3, 0.03, 0.03) if d.chance(0.3) else {}]
        d.join("rail", "prismatic", "ground", "slide", place, rubs, *more, axis="x" if d.chance(0.5) else "y")
        length = float(np.hypot(*(nodes[-1] - nodes[-2])))
        d.rod("tie", {"body": f"a{count - 1}", "point": [length / 2, 0, 0]}, {"body": "slide", "point": [0, 0, 0]})
    return d.scene(until)


def locked_feeds(rng: Generator) -> dict[str, Any]:
    """A trapezoidal rate or a torque moves a slide with friction. The drive acts through a self-locking gear unit, and through a
    rack, a thread or a rod. The slide has a stop, a nonlinear spring, or a second slide that it pushes by a spring."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    ratio, radius = float(rng.choice([3.0, 10.0])), d.of(0.02, 0.04)
    way = int(rng.integers(3))
    axis = "x" if way == 1 else "z"
    size = 10 * radius
    shaft(d, until, size / ratio, [-0.1, 0.0, 0.0] if way == 1 else [0.0, 0.0, -0.1], axis, fast=6 * ratio)
    d.wheel("output", radius, ORIGIN, axis)
    d.join("hub", "revolute", "ground", "output", ORIGIN, d.pin(0.05 * size, thrust=way == 1), axis=axis)
    d.joints["unit"] = {"type": "gearbox", "inboard": "rotor", "outboard": "output", **d.unit(ratio, size)}
    if d.chance(0.7) and "friction" in d.joints["unit"]:
        d.joints["unit"]["friction"]["efficiency_backward"] = 0.0
    turn = d.of(0.5, 2.6)
    places = ([0.0, radius, 0.0], [0.05, 0.0, 0.0], [0.25, 0.0, 0.0])
    at = places[way]
    d.block("slide", at)
    more = [d.loaded(1.0, "force") if d.chance(0.3) else d.guide(4.0)]
    more += [{"effort": d.sudden(8, until, " N")}] if d.chance(0.5) else []
    more += [d.stops(1e4, 0.01, 0.01)] if d.chance(0.5) else []
    more += [d.curved(0.02, 400, 10)] if d.chance(0.5) else []
    d.join("rail", "prismatic", "ground", "slide", at, *more, axis="x")
    if way == 0:
        d.joints["mesh"] = {"type": "rack", "inboard": {"body": "output", "axis": "z"}, "outboard": {"body": "slide", "axis": "x"},
                            "radii": [radius]}  # fmt: skip
    elif way == 1:
        rub = {"mu": d.of(0.05, 0.2), "radius": d.of(0.006, 0.012), "flank_angle": d.of(0, 0.5)}
        d.join("thread", "screw", "output", "slide", at, {"pitch": d.of(0.01, 0.04), "friction": rub}, axis="x")
    else:
        pin = radius * point(math.cos(turn), math.sin(turn))
        d.rod("link", {"body": "output", "point": [float(pin[0]), float(pin[1]), 0.0]}, {"body": "slide", "point": [0, 0, 0]})
    if d.chance(0.4):
        after = [at[0] + 0.1, at[1], at[2]]
        d.block("next", after)
        d.join("rail2", "prismatic", "ground", "next", after, d.guide(4.0), axis="x")
        curve = d.curved(0.03, 500, 10, rest=0.1) if d.chance(0.6) else {}
        d.forces["between"] = {"type": "spring_damper", "between": ["slide.o", "next.o"], "stiffness": d.of(50, 500),
                               "damping": d.of(0, 3), "length": 0.1, **curve}  # fmt: skip
    return d.scene(until)
