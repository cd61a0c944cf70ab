"""Rows of the gallery about sleeves on guides: their scenes and verdicts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import bundled, holding, honest, ran
from trunnion.scene.data_classes import scene as sm

GUIDE = sm.Friction(mu=0.4, half_length=0.08, half_width=0.03, half_height=0.02)


def carriage(offset: float) -> sm.Scene:
    """A sleeve on a guide. A force at a distance ``offset`` (m) from the axis pushes the sleeve along the guide."""
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=2.0, points={"push": (0.0, offset, 0.0)})
    joint = sm.Joint("prismatic", "ground", "carriage", axis="x", friction=GUIDE, start=sm.Start(0.0, 0.0))
    push = sm.Force("force", "carriage.push", (50.0, 0.0, 0.0))
    return sm.Scene({"carriage": body}, {"guide": joint}, "wedge", gravity=(0.0, 0.0, 0.0), forces={"push": push},
                    simulation=sm.Simulation(until=0.01))  # fmt: skip


def pushed(beyond: float, v_eps: float = 1e-9) -> sm.Scene:
    """A sleeve on a level guide with the regularised law. A push along the guide is about the sliding friction."""
    body, push = sm.Body(box=(0.1, 0.1, 0.1), mass=2.0), 0.4 * 2.0 * 9.81 * (1 + beyond)
    rub = replace(GUIDE, law="regularized", v_eps=v_eps)
    joint = sm.Joint("prismatic", "ground", "carriage", axis="x", friction=rub, start=sm.Start(0.0, 0.0))
    forces: dict[str, sm.Applied] = {"push": sm.Force("force", "carriage", (push, 0.0, 0.0))}
    return sm.Scene({"carriage": body}, {"guide": joint}, "pushed", forces=forces, simulation=sm.Simulation(until=0.05))


def creeping(scene: sm.Scene) -> str:
    """Verdict on the sleeve, whose run must take less than 500 steps. Below a push of μN, the sleeve creeps at v_eps F/(μN). Beyond
    this push, the sleeve slides with (F − μN)/m."""
    joint, r = scene.joints["guide"], ran(scene, 1e-9)
    assert joint.friction is not None
    v_eps, mass = float(joint.friction.v_eps or 0.0), float(scene.bodies["carriage"].mass or 0.0)
    push = math.hypot(*(float(f.force[k]) for f in scene.forces.values() for k in range(3)))
    most = 0.4 * mass * math.hypot(*scene.gravity)
    speed, end = float(r["guide.qd[1]"][-1]), float(scene.simulation.until)
    if not r.outcome.ok or r.stats.steps > 500:
        return f"{r.outcome.name} in {r.stats.steps} steps"
    if abs(speed / (v_eps * push / most) - 1.0) <= 1e-8:
        return "creeps"
    return "slides" if abs(speed - (push - most) / mass * end - v_eps) <= 1e-4 * v_eps else f"at {speed / v_eps} v_eps"


def light(beyond: float, mass: float = 1e-6) -> sm.Scene:
    """A cart of 1 mg on a rail with friction, and a pole of 1 kg that hangs from the cart at an angle. The cart stays at rest while
    tan φ is less than the friction ratio."""
    mu = 0.4
    angle = 0.5 * (math.atan(mu) + math.asin(mu * (1 + 2 * mass) / math.hypot(1, mu))) * (1 + beyond)
    bodies = {
        "cart": sm.Body(mass=mass, inertia=(0.0, 0.0, 0.0)),
        "pole": sm.Body(mass=1.0, center=(0.0, 0.0, -1.0), inertia=(0.0, 0.0, 0.0)),
    }
    joints = {
        "rail": sm.Joint("prismatic", "ground", "cart", axis="x", friction=GUIDE, start=sm.Start(0.0, 0.0)),
        "hinge": sm.Joint("revolute", "cart", "pole", axis="y", start=sm.Start(angle, 0.0)),
    }  # fmt: skip
    return sm.Scene(bodies, joints, "light_cart", simulation=sm.Simulation(until=0.05))


def carried(scene: sm.Scene) -> str:
    """Verdict on whether the cart stays in its place while the pole swings."""
    r = ran(scene)
    moved = np.any(r["rail.qd[1]"] != 0.0) or any(e.kind in ("slip", "stick", "reversal") for e in r.events)
    return r.outcome.name if not r.outcome.ok else "slips" if moved else "holds"


ROWS = (
    Row(2, "small_v_eps", "v_eps → 0 (stiffness)", (
        Edge("push μ N at v_eps = 1e-9 m/s", pushed, creeping, "creeps", "slides"),), "explicit methods need steps ∝ v_eps"),
    Row(8, "wedge", "wedging of a guide", (
        Edge("offset c/μ of the push", lambda b: carriage(0.2 * (1 + b)), holding, "slips", "holds"),),
        "depends on the size of the force"),
    Row(9, "light_cart", "tiny inertias", (
        Edge("pole at tan φ = μ (+ 1e-6 for the cart of 1 mg)", light, carried, "holds", "slips"),
        Edge("free cart of 1 mg, 2 s", bundled("cart_pole", 2.0), honest, "right"),), "default solvers are silently wrong"),
)  # fmt: skip
