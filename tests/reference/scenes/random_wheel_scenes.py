"""Random scenes of wheels in which devices interact: trains, planets, belts, racks, bevel differentials, cams."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.reference.scenes.epicyclic_trains import train
from tests.reference.scenes.random_scene_draft import Draft


def gear_trains(rng: Generator) -> dict[str, Any]:
    """Three or four shafts in a row with friction in teeth and bearings. A torque drives the first shaft. A load, a brake, or a
    flywheel with a freewheel acts on the last shaft."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.2))
    count, module = int(rng.integers(3, 5)), 4e-3
    teeth = [int(z) for z in rng.integers(14, 34, count)]
    places = np.concatenate([[0.0], np.cumsum([(a + b) * module / 2 for a, b in pairwise(teeth)])])
    for i, (z, x) in enumerate(zip(teeth, places, strict=True)):
        at = [float(x), 0.0, 0.0]
        d.wheel(f"w{i}", z * module / 2, at, mass=None if d.chance(0.8) else 1e-3)
        torque = {"effort": d.load(0.3, until)} if i == 0 or d.chance(0.3) else {}
        held = d.brake(0.15, until) if i == count - 1 and d.chance(0.4) else d.pin(0.05)
        d.join(f"r{i}", "revolute", "ground", f"w{i}", at, torque, held, {"start": {"qd": d.about(5)}} if i == 0 else {})
    for i in range(count - 1):
        wheels: dict[str, Any] = {"teeth": [teeth[i], teeth[i + 1]], "module": module}
        d.join(f"g{i}", "gear", f"w{i}", f"w{i + 1}", None, wheels, d.teeth(0.6))
    if d.chance(0.5):
        last = [float(places[-1]), 0.0, 0.05]
        d.wheel("fly", 0.05, last)
        d.join("free", "revolute", f"w{count - 1}", "fly", last, d.freewheel(0.02, 0.3), {"damping": d.of(0, 0.01)})
    return d.scene(until)


def planets(rng: Generator) -> dict[str, Any]:
    """An epicyclic train of two to four planets with friction in its teeth. The sun's bearing holds the sun, a brake acts on the
    ring or the carrier, and the torque on the ring oscillates, grows or fades."""
    count, until = int(rng.integers(2, 5)), float(rng.uniform(0.5, 1.2))
    scene, d = train(int(rng.integers(1 << 30)), count), Draft(rng)
    joints: dict[str, Any] = scene["joints"]
    if d.chance(0.6):
        joints["rring"]["effort"] = d.load(1.5, until)
    if d.chance(0.6):
        joints[("rring", "rcar")[int(rng.integers(2))]] |= d.brake(0.4, until)
    for name, j in joints.items():
        if j["type"] == "gear" and "friction" not in j:
            j |= d.teeth(0.25)
        if name.startswith("rp") and d.chance(0.4):
            j |= d.pin(0.01)
    if d.chance(0.3):
        joints["rsun"]["end_stops"] = {"stiffness": 50.0, "upper": 0.05, "lower": -0.05, "damping": d.of(0, 0.5)}
    return scene | {"gravity": d.gravity, "simulation": {"until": round(until, 3)}}


def belts(rng: Generator) -> dict[str, Any]:
    """A motor drives one or two pulleys. A brake acts for some of the time, and a freewheel drives a flywheel."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.2))
    radii = [int(r) / 1000 for r in rng.integers(20, 60, 3)]
    signal = {"signal": d.load(1.0, until)} if d.chance(0.7) else {}
    motor = {"motor": {"stall": d.of(0.3, 2), "no_load": d.of(10, 60), **signal}}
    for i, r in enumerate(radii):
        at = [0.2 * i, 0.0, 0.0]
        d.wheel(f"p{i}", r, at)
        more = motor if i == 0 else ({"effort": d.load(0.2, until)} if d.chance(0.5) else {})
        rubs = d.brake(0.6, until) if i == 2 and d.chance(0.7) else d.pin(0.06)
        d.join(f"r{i}", "revolute", "ground", f"p{i}", at, more, rubs)
    for i in range(2):
        d.join(f"b{i}", "belt", f"p{i}", f"p{i + 1}", None, {"radii": [radii[i], radii[i + 1]], "crossed": d.chance(0.3)})
    if d.chance(0.5):
        d.wheel("fly", 0.06, [0.4, 0.0, 0.05])
        d.join("free", "revolute", "p2", "fly", [0.4, 0.0, 0.05], d.freewheel(0.03, 0.5))
    if d.chance(0.4):  # A mass hangs on the middle pulley.
        d.block("load", [0.2 + radii[1], -0.2, 0.0])
        d.join("rail", "prismatic", "ground", "load", [0.2 + radii[1], -0.2, 0.0], d.guide(1.0), axis="y")
        d.join("rope", "rack", {"body": "p1", "axis": "z"}, {"body": "load", "axis": "y"}, None,  # type: ignore[arg-type]
               {"radii": [radii[1]]})  # fmt: skip
        del d.joints["rope"]["axis"]
    return d.scene(until)


def racks(rng: Generator) -> dict[str, Any]:
    """A pinion between two racks. Each rack has a spring, a stop or a ratchet. Guides, teeth and the pinion have friction."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    z, module = int(rng.integers(14, 30)), 4e-3
    radius = z * module / 2
    d.wheel("pinion", radius, [0.0, 0.0, 0.0])
    turn = {"motor": {"stall": d.of(0.3, 1.5), "no_load": d.of(10, 40), "signal": d.load(1.0, until)}}
    turn = turn if d.chance(0.5) else {"effort": d.load(0.5, until)}
    d.join("turn", "revolute", "ground", "pinion", [0, 0, 0], turn, d.pin(0.06))
    for i, side in enumerate((1, -1)[: 1 + int(d.chance(0.7))]):
        place = [0.0, side * radius, 0.0]
        d.block(f"bar{i}", place)
        more: list[dict[str, Any]] = [d.guide(2.0)]
        more += [{"spring": {"stiffness": d.of(20, 300), "rest": d.of(-0.03, 0.03)}}] if d.chance(0.6) else []
        more += [d.stops(5e3, 0.03, 0.03)] if d.chance(0.5) else []
        if d.chance(0.4):
            more += [{"latch": {"at": d.of(0.002, 0.01), "stiffness": d.of(3e3, 2e4), "damping": d.of(0, 0.5),
                                "pitch": d.of(0.004, 0.01), "release": d.lifting(until)}}]  # fmt: skip
        d.join(f"rail{i}", "prismatic", "ground", f"bar{i}", place, *more, axis="x")
        ends: dict[str, Any] = {"inboard": {"body": "pinion", "axis": "z"}, "outboard": {"body": f"bar{i}", "axis": "x"}}
        d.joints[f"mesh{i}"] = {"type": "rack", **ends, "teeth": [z], "module": module, **d.teeth(0.6)}
    return d.scene(until)


def bevel_differentials(rng: Generator) -> dict[str, Any]:
    """A differential with one or two pinions. A torque acts on its carrier, a brake on one side, and a load or a freewheel on the
    other side."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    side_teeth, pinion_teeth, module = int(rng.integers(18, 30)), int(rng.integers(10, 17)), 4e-3
    big, small = side_teeth * module / 2, pinion_teeth * module / 2
    d.wheel("car", big, [0.0, 0.0, 0.0], "x")
    start = {"start": {"qd": d.about(5)}} if d.chance(0.6) else {}
    d.join("rcar", "revolute", "ground", "car", [0, 0, 0], {"effort": d.load(0.6, until)}, d.pin(0.05), start, axis="x")
    for name, s in (("left", -1), ("right", 1)):
        at = [0.0, 0.0, 0.0]
        d.wheel(name, big, at, "x")
        d.bodies[name]["center"][0] = s * small
        rubs = d.brake(0.3, until) if name == "left" and d.chance(0.7) else d.pin(0.08)
        d.join(f"r{name}", "revolute", "ground", name, at, rubs, {"effort": d.load(0.2, until)} if d.chance(0.5) else {}, axis="x")
    for i, s in enumerate((1, -1)[: int(rng.integers(1, 3))]):
        at = [0.0, 0.0, 0.0]
        d.wheel(f"p{i}", small, at, "y", mass=d.of(0.1, 0.3))
        d.bodies[f"p{i}"]["center"][1] = s * big
        d.join(f"rp{i}", "revolute", "car", f"p{i}", at, d.pin(0.02), axis="y")
        for name, axis in (("left", "-x"), ("right", "x")):
            pinion = {"body": f"p{i}", "axis": "y" if s > 0 else "-y"}
            ends: dict[str, Any] = {"inboard": {"body": name, "axis": axis}, "outboard": pinion}
            d.joints[f"m{name}{i}"] = {"type": "bevel_gear", **ends, "teeth": [side_teeth, pinion_teeth], "module": module,
                                       **d.teeth(0.4)}  # fmt: skip
    if d.chance(0.4):
        d.wheel("fly", 0.05, [0.0, 0.0, 0.0], "x")
        d.bodies["fly"]["center"][0] = 2 * small
        d.join("free", "revolute", "right", "fly", [0, 0, 0], d.freewheel(0.02, 0.3), axis="x")
    return d.scene(until)


def cams(rng: Generator) -> dict[str, Any]:
    """A cam with a roller or a flat follower on a guide with friction; a spring presses the follower. A motor with a brake, a
    torque or a drive turns the cam. The follower has a stop or a hook."""
    d, until = Draft(rng), float(rng.uniform(0.4, 1.0))
    flat = d.chance(0.4)
    angles = np.linspace(0.0, 2 * np.pi, 13)
    lift, phase = d.of(0.003, 0.012), d.of(0, 6)
    radius = 0.05 + lift * np.cos(angles - phase) + 0.1 * lift * np.cos(2 * angles)
    radius[-1] = radius[0]
    base = float(radius[3])  # radius of the cam towards y, where the follower stands
    roller = {"roller": d.of(0.005, 0.015)} if not flat and d.chance(0.7) else {}
    d.wheel("cam", 0.04, [0.0, 0.0, 0.0])
    way = int(rng.integers(3))
    turn: list[dict[str, Any]] = [{"effort": d.load(0.8, until)}, d.pin(0.06), {"start": {"qd": d.about(8)}}]
    if way == 1:
        turn = [{"motor": {"stall": d.of(0.5, 2), "no_load": d.of(10, 40), "signal": d.load(1.0, until)}}, d.brake(0.5, until)]
    if way == 2:
        turn = [{"drive": {"ramp": {"start": d.about(10), "end": d.about(10) * d.of(0, 1), "duration": 0.7 * until}}}, d.pin(0.06)]
    d.join("turn", "revolute", "ground", "cam", [0, 0, 0], *turn)
    d.block("rod", [0.0, base, 0.0], mass=d.of(0.1, 0.5))
    more: list[dict[str, Any]] = [d.guide(1.0), {"spring": {"stiffness": d.of(200, 1500), "rest": -d.of(0.01, 0.03)}}]
    more += [d.stops(1e4, 0.004, 0.004)] if d.chance(0.3) else []
    if d.chance(0.35):
        hook = {"at": d.of(0.0, 0.4) * lift, "stiffness": d.of(1e4, 4e4), "damping": d.of(0, 1)}
        more += [{"latch": {**hook, "release": d.lifting(until)}}]
    d.join("guide", "prismatic", "ground", "rod", [0.0, base, 0.0], *more, axis="y")
    rubs = {"friction": {"mu": d.of(0.03, 0.2)}} if d.chance(0.8) else {}
    outboard: dict[str, Any] = {"body": "rod", "axis": "y", "reference": "z"} if flat else {"body": "rod", "point": [0, 0, 0]}
    d.joints["follow"] = {"type": "flat_cam" if flat else "cam", "axis": "z", "reference": "x",
                          "inboard": {"body": "cam", "point": [0, 0, 0]}, "outboard": outboard, **roller, **rubs,
                          "profile": {"angle": [float(a) for a in angles], "radius": [float(r) for r in radius]}}  # fmt: skip
    return d.scene(until)
