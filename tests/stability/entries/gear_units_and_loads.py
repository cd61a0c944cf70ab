"""Rows of the gallery about gear units, worms, loaded joints, rods, and loads by place and time."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import holding, honest, ran
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict

RATIO, DRIVING, DRIVEN, IDLE, LOAD = 50.0, 0.9, 0.6, 0.2, 98.1
"""Data of the winch: ratio; efficiencies in both directions of power; no-load torque and torque of the load on the drum, N m."""
LEAD, PRESSURE = math.radians(5), math.radians(20)
"""Lead angle and pressure angle of the worm."""
WEIGHT, CONSTANT, PART, PART_BACK = 39.24, 2.0, 0.1, 0.2
"""Data of the elbow: torque of the weight and constant friction, N m; friction per torque when the joint drives and when the arm
drives."""
STIFF, PLAY, HELD = 400.0, 0.05, 10.0
"""Data of the spring whose coils touch: stiffness before the coils touch, N/m; travel until they touch, m; friction of the block,
N."""
SHORT = 1e-3
"""Duration of a pulse, s."""


def revolute(outboard: str, axis: str = "z", **more: Any) -> dict[str, Any]:
    """A hinge on the ground."""
    return {"type": "revolute", "axis": axis, "inboard": "ground", "outboard": outboard, **more}


def made(name: str, bodies: dict[str, Any], joints: dict[str, Any], until: float, **more: Any) -> sm.Scene:
    """A scene, without weight unless stated."""
    return scene_from_dict({"name": name, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints, **more,
                            "simulation": {"until": until}, "outputs": ["*"]})  # fmt: skip


def winch(torque: float, driven: float = DRIVEN) -> sm.Scene:
    """A rotor with a torque, a gear unit, and a drum with a load."""
    unit = {"type": "gearbox", "inboard": "rotor", "outboard": "drum", "ratio": RATIO,
            "friction": {"efficiency": DRIVING, "efficiency_backward": driven, "no_load_torque": IDLE}}  # fmt: skip
    bodies = {"rotor": {"mass": 2, "inertia": [1e-3] * 3}, "drum": {"mass": 10, "inertia": [0.1] * 3}}
    start = {"start": {"q": 0.0, "qd": 0.0}}
    joints = {"motor": revolute("rotor", effort=torque, **start), "bearing": revolute("drum", effort=-LOAD, **start), "unit": unit}
    return made("winch", bodies, joints, 0.05)


def worm(beyond: float) -> sm.Scene:
    """A wheel with a load, held by its worm if μ ≥ tan γ cos α. beyond: relative excess over this μ."""
    mu = math.tan(LEAD) * math.cos(PRESSURE) * (1 + beyond)
    threads, teeth, module = 1, 40, 4e-3
    apart = module / 2 * (threads / math.tan(LEAD) + teeth)
    mesh = {"type": "worm", "inboard": {"body": "worm", "axis": "x"}, "outboard": {"body": "wheel", "axis": "y"},
            "teeth": [threads, teeth], "module": module, "lead_angle": LEAD,
            "friction": {"mu": mu, "pressure_angle": PRESSURE}}  # fmt: skip
    bodies = {"worm": {"mass": 1, "inertia": [1e-3] * 3}, "wheel": {"mass": 5, "inertia": [0.02] * 3}}
    start = revolute("worm", "x", start={"q": 0.0, "qd": 0.0})
    wheel = {**revolute("wheel", "y"), "inboard": {"body": "ground", "point": [0, 0, apart]}}
    joints = {"worm_shaft": start, "wheel_shaft": {**wheel, "effort": -50.0}, "mesh": mesh}
    return made("worm", bodies, joints, 0.05)


def elbow(torque: float) -> sm.Scene:
    """A robot's joint with a level arm and a torque."""
    rub = {"torque": CONSTANT, "load_friction": PART, "load_friction_backward": PART_BACK}
    arm = {"mass": 10, "center": [0.4, 0, 0], "inertia": [1, 1, 1]}
    joint = revolute("arm", "-y", friction=rub, effort=torque, start={"q": 0.0, "qd": 0.0})
    return made("elbow", {"arm": arm}, {"elbow": joint}, 0.02, gravity=[0, 0, -9.81])


def short_rod(beyond: float) -> sm.Scene:
    """A crank of 0.1 m, a slide on a guide that passes 0.3 m from the crank's pivot, and a rod between crank and slide. beyond:
    relative excess over the rod's least length."""
    bodies = {"crank": {"mass": 1, "inertia": [0.01] * 3}, "slide": {"mass": 1, "inertia": [0.01] * 3}}
    aside = {"body": "ground", "point": [0, 0.3, 0]}
    guide = {"type": "prismatic", "axis": "x", "inboard": aside, "outboard": "slide", "effort": 1.0}
    rod = {"type": "rod", "inboard": {"body": "crank", "point": [0, 0.1, 0]}, "outboard": "slide", "length": 0.2 * (1 + beyond)}
    return made("short_rod", bodies, {"pivot": revolute("crank"), "guide": guide, "rod": rod}, 1.0)


def coils(stretch: float, speed: float = 0.0, until: float = 0.02) -> sm.Scene:
    """A block with given friction on a spring whose coils touch. When they touch, the spring is a hundred times as stiff."""
    at, force = (-3 * PLAY, -PLAY, 0.0, PLAY), [STIFF * x for x in (-201 * PLAY, -PLAY, 0.0, PLAY)]
    start, rubs = {"q": stretch, "qd": speed}, {"force": HELD if not speed else 0.1 * HELD}
    joint = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block", "start": start, "friction": rubs,
             "nonlinear": {"spring_curve": {"at": list(at), "effort": force}}}  # fmt: skip
    return made("coils", {"block": {"mass": 1, "inertia": [0.01] * 3}}, {"guide": joint}, until)


held = partial(holding, round_off=1e-11)
"""The verdict of ``holding``, for couplings."""


def pulse(beyond: float) -> sm.Scene:
    """A block with given friction, and a pulse of a millisecond in ten seconds. beyond: relative excess of the pulse over the
    friction."""
    push = {"pulse": {"peak": HELD * (1 + beyond), "duration": SHORT, "begin": 4.0 + 1 / 3}}
    joint = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block", "effort": push}
    block = {"mass": 1, "inertia": [0.01] * 3}
    return made("short_pulse", {"block": block}, {"guide": joint | {"friction": {"force": HELD}}}, 10.0)


def slips(scene: sm.Scene) -> str:
    """Number of times that the guide begins to slip; for an incorrect run, the verdict in words."""
    r = ran(scene)
    return f"{sum(e.kind == 'slip' for e in r.events)} slips" if r.outcome.ok else r.outcome.name


def flyby(_: float) -> sm.Scene:
    """A body that falls past an attracting point. The closest distance is a hundredth of the first distance."""
    joints = {"free": {"type": "free", "inboard": "ground", "outboard": "probe",
                       "start": {"q": [1, 0, 0, 1, 0, 0, 0], "qd": [0, 0.14, 0, 0, 0, 0]}}}  # fmt: skip
    forces = {"sun": {"type": "point_gravity", "on": "probe", "towards": "ground.sun", "gm": 1.0}}
    ground = {"points": {"sun": [0, 0, 0]}}
    return made("flyby", {"probe": {"mass": 1, "inertia": [0.01] * 3}}, joints, 3.0, forces=forces, ground=ground)


def rotor(beyond: float) -> sm.Scene:
    """A rotor with inertia about its axis only. Above the threshold it is on an axle; below, it is in a ball, where nothing
    determines its tilt."""
    body = {"mass": 1, "inertia": {"axial": 0.01, "axis": "x"}}
    joint = {"inboard": "ground", "outboard": "rotor"}
    way = {"type": "revolute", "axis": "x", "start": {"q": 0.0, "qd": 100.0}} if beyond > 0 else {"type": "spherical"}
    return made("axial_rotor", {"rotor": body}, {"axle": joint | way}, 0.1)


LIFTS = LOAD / (RATIO * DRIVING) + IDLE
LOWERS = LOAD * DRIVEN / RATIO - IDLE
RAISES = WEIGHT * (1 + PART) + CONSTANT
SINKS = WEIGHT * (1 - PART_BACK) - CONSTANT

ROWS = (
    Row(29, "gear_unit", "a gear unit at rest: power either way", (
        Edge("torque that lifts the load, T/(i η_f) + T_0", lambda b: winch(LIFTS * (1 + b)), held, "holds", "slips"),
        Edge("torque below which the load sinks, η_b T/i − T_0", lambda b: winch(LOWERS * (1 + b)), held, "slips", "holds"),
        Edge("η_b = 0, no torque", lambda _: winch(0.0, 0.0), held, "holds"),),
        "an efficiency multiplies the torque: the torque jumps where the motion reverses, and is undefined at rest"),
    Row(30, "worm", "a worm that locks itself", (
        Edge("μ = tan γ cos α", worm, held, "slips", "holds"),),
        "a fixed efficiency: the worm creeps back, or locks in both senses"),
    Row(31, "loaded_joint", "joint friction that grows with the load", (
        Edge("torque that raises the arm, W (1 + b) + a", lambda b: elbow(RAISES * (1 + b)), holding, "holds", "slips"),
        Edge("torque below which the arm sinks, W (1 − b_b) − a", lambda b: elbow(SINKS * (1 + b)), holding, "slips", "holds"),),
        "friction from the torque of the last step: the joint chatters at reversal"),
    Row(32, "short_rod", "a rod across its guide", (
        Edge("rod just long enough", short_rod, honest, "open_loop", "right"),),
        "a rod as a stiff spring closes at any length; a rod as a light body makes the equations stiff"),
    Row(33, "coils", "a spring whose coils touch", (
        Edge("stretch at which the spring overcomes friction", lambda b: coils(HELD / STIFF * (1 + b)), holding, "holds", "slips"),
        Edge("thrown against the touching coils", lambda _: coils(0.0, -8.0, 0.2), honest, "right"),),
        "a step across the corner gains energy"),
    Row(34, "flyby", "a close passage", (Edge("a hundredth of the first distance", flyby, honest, "right"),),
        "fixed steps fling the body away"),
    Row(35, "short_pulse", "a pulse shorter than a step", (
        Edge("peak = friction", pulse, slips, "0 slips", "1 slips"),), "a long step misses the pulse"),
    Row(36, "axial_rotor", "inertia about one axis only", (
        Edge("in a ball / on an axle", rotor, honest, "no_inertia", "right"),), "a singular mass matrix"),
)  # fmt: skip
