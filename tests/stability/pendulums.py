"""Rows about example 8.1's pendulum on its ball, and a sphere that spins on one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from engine.scene import load_scene
from engine.scene import model as sm
from engine.simulation.run import simulate
from tests.stability.row import Row
from tests.stability.verdicts import holding, ran

STEEL, G = 7800.0, 9.81
MU, RADIUS = 0.6, 0.05
PAINLEVE = 26.065 / 78.0 / 0.5 * math.hypot(1, MU) / MU


def pendulum(angle: float, radius: float = RADIUS, rate: float = 0.0, until: float = 0.05, **rub: float | str) -> sm.Scene:
    """8.1 at an angle (rad) from the downward vertical."""
    scene = load_scene("spherical_pendulum")
    joint = scene.joints["ball"]
    friction = sm.Friction(**{"mu": MU, "radius": radius, **rub})  # type: ignore[arg-type]
    start = sm.Start(sm.AxisAngle("y", math.pi / 2 - angle), (0.0, -rate, 0.0))
    joints = {"ball": replace(joint, friction=friction, start=start)}
    return replace(scene, joints=joints, simulation=sm.Simulation(until=until), outputs=("*",))


CONE = math.asin(RADIUS * MU / math.hypot(1, MU) / 0.5)


def regularised_error(scene: sm.Scene) -> str:
    """Against dry friction: in proportion to v_eps, without more steps than 2,000."""
    joint = scene.joints["ball"]
    assert joint.friction is not None
    dry = replace(scene, joints={"ball": replace(joint, friction=replace(joint.friction, law="coulomb", v_eps=None))})
    soft, exact = ran(scene), ran(dry)
    speed = float(joint.friction.v_eps or 0.0) / (0.5 * float(exact["ball.qd[2]"][-1]) or 1.0)
    gap = abs(soft["ball.qd[2]"][-1] / exact["ball.qd[2]"][-1] - 1.0)
    return "right" if gap <= max(3.0 * abs(speed), 1e-6) and soft.stats.steps < 2000 else f"off by {gap:.1e} in {soft.stats.steps}"


def spinner(angle: float) -> sm.Scene:
    """A sphere on a ball joint at its centre, spinning at an angle from the force it carries."""
    body = sm.Body(sphere=0.1, mass=4.0)
    rub = sm.Friction(mu=0.5, radius=0.02)
    start = sm.Start((1.0, 0.0, 0.0, 0.0), (10.0 * math.sin(angle), 0.0, 10.0 * math.cos(angle)))
    joint = sm.Joint("spherical", "ground", "ball", friction=rub, start=start)
    return sm.Scene({"ball": body}, {"socket": joint}, "spinner", gravity=(0.0, 0.0, -G), simulation=sm.Simulation(until=1e-3))


def rubs(scene: sm.Scene) -> str:
    """Friction power at the start."""
    r = ran(scene, rows=1)
    w = np.array([r[f"socket.qd[{k}]"][0] for k in (1, 2, 3)])
    t = np.array([r[f"socket.friction.torque[{k}]"][0] for k in (1, 2, 3)])
    power = float(t @ w) / (np.linalg.norm(t) * np.linalg.norm(w))
    return "rubs" if power > 1e-7 else "spins free" if abs(power) <= 1e-12 else f"power {power:.1e}"


def counted(scene: sm.Scene) -> str:
    """Roots of the complement equations at the start, or the named outcome."""
    r = ran(scene)
    return r.outcome.name if not r.outcome.ok else "one root" if r.certificate.roots[0] == 1 else "several roots"


def jumps(scene: sm.Scene) -> str:
    """Events of a swing: how many ends of sliding, whether each normal turned by less than 2 atan μ and no wrap was reported."""
    r = ran(scene)
    turns = [t for e in r.events if e.kind == "reversal" for t in e.turn]
    good = all(0.5 * math.atan(MU) < t <= 2 * math.atan(MU) for t in turns) and not any(e.kind == "separation" for e in r.events)
    return f"{len(turns)} reversals" if good else f"turns {np.degrees(turns)}"


FIRST_STOP = 0.944980


def swing(until: float) -> sm.Scene:
    """8.1 from horizontal, for some time."""
    return replace(load_scene("spherical_pendulum"), simulation=sm.Simulation(until=until), outputs=("*",))


def same_end(scene: sm.Scene) -> str:
    """Rows laid any way, and a run cut at the end, say the same as the solver's own steps."""
    until = float(scene.simulation.until)
    ends = [simulate(scene, until=until, every=e, rtol=1e-9).data[-1] for e in (until, until / 7, until / 1000)]
    scale = np.abs(ends[0]).max()
    return "same" if max(np.abs(e - ends[0]).max() for e in ends) <= 1e-9 * scale else "rows change the run"


ROWS = (
    Row(1, "zero_speed", "zero sliding speed", lambda b: pendulum(CONE * (1 + b)), holding, "holds", "slips",
        "a law through zero creeps; smooth laws never hold"),
    Row(2, "small_v_eps", "v_eps → 0 (stiffness)", lambda b: pendulum(1.0, law="regularized", v_eps=1e-6 if b < 0 else 1e-9,
        until=0.3),
        regularised_error, "right", "right", "explicit methods need steps ∝ v_eps"),
    Row(4, "spin_about_force", "reaction ∥ spin axis (ball)", lambda b: spinner(math.atan(0.5) * (1 + b)), rubs,
        "spins free", "rubs",
        "normal from a cross product: 0/0"),
    Row(7, "painleve", "large μ r: no root or two", lambda b: pendulum(1.0, PAINLEVE * (1 + b), -2.0, 1e-7), counted, "one root",
        "jammed", "fixed point diverges or a root is picked silently"),
    Row(16, "contact_jumps", "contact angle: wrap, reversal, jump", lambda b: swing(FIRST_STOP * (1 + b)), jumps, "0 reversals",
        "1 reversals", "not reported"),
    Row(18, "step_over_event", "time step across an event", lambda b: swing(1.0 if b < 0 else FIRST_STOP), same_end, "same", "same",
        "results depend on the output grid"),
)  # fmt: skip
