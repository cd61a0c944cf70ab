"""Rows of the gallery about example 8.1's pendulum on its ball, and about a sphere that spins on a ball joint."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tests.stability.gallery_entry import EDGE, Edge, Row
from tests.stability.scene_verdicts import holding, ran
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

STEEL, G = 7800.0, 9.81
MU, RADIUS = 0.6, 0.05
FIRST_STOP = 0.94498035248
"""Time of the first stop, s; integrated without the engine."""
PAINLEVE = 26.065 / 78.0 / 0.5 * math.hypot(1, MU) / MU


def pendulum(angle: float, radius: float = RADIUS, rate: float = 0.0, until: float = 0.05, **rub: float | str) -> sm.Scene:
    """Example 8.1, started at an angle (rad) from the downward vertical."""
    scene = load_scene("spherical_pendulum")
    joint = scene.joints["ball"]
    friction = sm.Friction(**{"mu": MU, "radius": radius, **rub})  # type: ignore[arg-type]
    start = sm.Start(sm.AxisAngle("y", math.pi / 2 - angle), (0.0, -rate, 0.0))
    joints = {"ball": replace(joint, friction=friction, start=start)}
    return replace(scene, joints=joints, simulation=sm.Simulation(until=until), outputs=("*",))


CONE = math.asin(RADIUS * MU / math.hypot(1, MU) / 0.5)


def spinner(angle: float) -> sm.Scene:
    """A sphere on a ball joint at its centre, spinning at an angle from the force it carries."""
    body = sm.Body(sphere=0.1, mass=4.0)
    rub = sm.Friction(mu=0.5, radius=0.02)
    start = sm.Start((1.0, 0.0, 0.0, 0.0), (10.0 * math.sin(angle), 0.0, 10.0 * math.cos(angle)))
    joint = sm.Joint("spherical", "ground", "ball", friction=rub, start=start)
    return sm.Scene({"ball": body}, {"socket": joint}, "spinner", gravity=(0.0, 0.0, -G), simulation=sm.Simulation(until=1e-3))


def rubs(scene: sm.Scene) -> str:
    """The word "rubs" or "spins free" for the two correct powers of friction at the start. In all other cases, the power itself."""
    r = ran(scene, rows=1)
    w = np.array([r[f"socket.qd[{k}]"][0] for k in (1, 2, 3)])
    t = np.array([r[f"socket.friction.torque[{k}]"][0] for k in (1, 2, 3)])
    power = float(t @ w) / (np.linalg.norm(t) * np.linalg.norm(w))
    return "rubs" if power > 1e-7 else "spins free" if abs(power) <= 1e-12 else f"power {power:.1e}"


def counted(scene: sm.Scene) -> str:
    """Number of roots of the complement equations at the start, or the named outcome."""
    r = ran(scene)
    return r.outcome.name if not r.outcome.ok else "one root" if r.certificate.roots[0] == 1 else "several roots"


def jumps(scene: sm.Scene) -> str:
    """Events of a swing, in words: the number of ends of sliding, if each normal turned by at most 2 atan μ and no separation was
    reported; otherwise the turns, degrees."""
    r = ran(scene)
    turns = [t for e in r.events if e.kind == "reversal" for t in e.turn]
    good = all(0.5 * math.atan(MU) < t <= 2 * math.atan(MU) for t in turns) and not any(e.kind == "separation" for e in r.events)
    return (
        ("1 reversal" if len(turns) == 1 else f"{len(turns)} reversals" if turns else "no event")
        if good
        else f"turns {np.degrees(turns)}"
    )


def swing(until: float) -> sm.Scene:
    """Example 8.1, released from the horizontal, until a time in s."""
    return replace(load_scene("spherical_pendulum"), simulation=sm.Simulation(until=until), outputs=("*",))


def same_end(scene: sm.Scene) -> str:
    """Verdict on rows at any spacing, one of them at the event. The rows must agree with the solver's own steps at the end, and the
    events must be equal."""
    until = float(scene.simulation.until)
    grids = (until, until / 7, until / 1000, until / (1 + EDGE), 0.0)
    runs = [simulate(scene, until=until, every=e, rtol=1e-9) for e in grids]
    events = {tuple((e.kind, e.time) for e in r.events) for r in runs}
    apart = max(np.abs(r.data[-1] - runs[0].data[-1]).max() for r in runs)
    if apart > 1e-9 * np.abs(runs[0].data[-1]).max() or len(events) > 1:
        return f"rows change the run by {apart:.1e}, {events}"
    count = len(events.pop())
    return "same, 1 event" if count == 1 else f"same, {count or 'no'} event"


ROWS = (
    Row(1, "zero_speed", "zero sliding speed", (
        Edge("friction cone, 2.949°", lambda b: pendulum(CONE * (1 + b)), holding, "holds", "slips"),),
        "a law through zero creeps; smooth laws never hold"),
    Row(4, "spin_about_force", "reaction ∥ spin axis (ball)", (
        Edge("spin at atan μ from the force", lambda b: spinner(math.atan(0.5) * (1 + b)), rubs, "spins free", "rubs"),),
        "normal from a cross product: 0/0"),
    Row(7, "painleve", "large μ r: no root or two", (
        Edge("r μ/√(1+μ²) = I/(m l)", lambda b: pendulum(1.0, PAINLEVE * (1 + b), -2.0, 1e-7), counted, "one root", "jammed"),),
        "fixed point diverges or a root is picked silently"),
    Row(16, "contact_jumps", "contact angle: wrap, reversal, jump", (
        Edge("first stop of 8.1", lambda b: swing(FIRST_STOP * (1 + b)), jumps, "no event", "1 reversal"),), "not reported"),
    Row(18, "step_over_event", "time step across an event", (
        Edge("run that ends at an event", lambda b: swing(FIRST_STOP * (1 + b)), same_end, "same, no event", "same, 1 event"),),
        "results depend on the output grid"),
)  # fmt: skip
