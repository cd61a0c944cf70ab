"""Redundant loops in motion, under oblique gravity: Bricard's mechanism, a four-bar with friction, a four-bar of several loops."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from tests.reference import forward
from tests.reference.mechanics.bodies_and_joint_frames import GROUND, part
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.scenes.random_scenes import Case
from tests.scalable_mechanisms import n_four_bar
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate


def four_bar(law: str = "regularized") -> sm.Scene:
    """A plane four-bar. Its bars lie beside each other along z, so that the pins carry bending moments. Gravity also acts out of
    the plane."""
    rub = sm.Friction(mu=0.4, radius=0.02, half_length=0.03, v_eps=1e-3, law=law, viscosity=3.0 if law == "viscous" else None)

    def bar(length: float, mass: float) -> sm.Body:
        return sm.Body(box=(length, 0.06, 0.04), mass=mass, center=(length / 2, 0.01, 0.005), points={"end": (length, 0.0, 0.05)})

    bodies = {"crank": bar(0.3, 1.0), "coupler": bar(0.8, 2.0), "rocker": bar(0.6, 1.5)}
    hinge = {"type": "revolute", "axis": "z"}
    joints = {
        "a": sm.Joint(**hinge, inboard="ground", outboard="crank", start=sm.Start(q=0.0808162551, qd=4.0)),
        "b": sm.Joint(**hinge, inboard="crank.end", outboard="coupler"),
        "c": sm.Joint(**hinge, inboard="coupler.end", outboard="rocker.end", friction=rub),
        "d": sm.Joint(**hinge, inboard=sm.Side("ground", (0.9, 0.0, 0.05)), outboard="rocker", start=sm.Start(q=1.644045465)),
    }
    return sm.Scene(bodies, joints, f"four_bar_{law}", gravity=(1.5, -8.0, 4.0))


def moving(scene: sm.Scene, at: float, tree: tuple[str, ...]) -> Case:
    """The scene's state at a time of its motion. ``tree``: joints whose coordinates determine the whole state."""
    result = simulate(scene, until=at, every=at, rtol=1e-12, outputs=["*.q*"])
    assert result.outcome.ok, result.outcome
    q = {n: np.array([result[f"{n}.q[1]"][-1]]) for n in scene.joints}
    qd = {n: np.array([result[f"{n}.qd[1]"][-1]]) for n in scene.joints}
    return Case(scene, q, qd, 0.0, tree)


@cache
def case_of(which: str) -> Case:
    """The case "bricard", the case "loops" (the four-bar of four loops), or the four-bar with friction by the law of this name."""
    if which == "bricard":
        return moving(load_scene("bricard"), 0.7, ("j0", "j1", "j2", "j3", "j4"))
    if which == "loops":
        several = n_four_bar(4)
        tree = tuple(n for n in several.joints if not n.startswith("right"))
        return moving(replace(several, gravity=(1.5, -8.0, 4.0)), 0.2, tree)
    return moving(four_bar(which), 0.05, ("a", "b", "d"))


def open_reactions(case: Case, eta: np.ndarray | None = None) -> tuple[Equations, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The reference's equations of the case. For every joint: its wrench on the outboard part at the outboard point (6), and the
    open directions of redundancy (6 × count), in the world frame."""
    near = {n: case.q[n] for n in case.tree}
    eq = Equations(forward(case.scene, near, case.qd, case.t))
    x = np.r_[1.0, np.zeros(len(eq.eta)) if eta is None else eta]
    return eq, {n: -eq.total(n) @ x for n in case.scene.joints}, {n: -eq.loose(n) for n in case.scene.joints}


def smallest(case: Case, eq: Equations, wrench: dict[str, np.ndarray], loose: dict[str, np.ndarray]) -> np.ndarray:
    """Amounts of the open directions that minimise Σ |f|²/m + |torque about the mass centre|²/j over both bodies of every joint.
    The number j is half the trace of the inertia."""
    value, change = [], []
    for name in case.scene.joints:
        pose = eq.state.joint_pose(name)
        for body, sign in ((pose.outboard, 1.0), (pose.inboard, -1.0)):
            if body == GROUND:
                continue
            p = part(case.scene.bodies[body])
            arm = pose.p_out - eq.state.c[body]

            def scaled(w, p=p, arm=arm, sign=sign):
                return sign * np.r_[w[:3] / np.sqrt(p.mass), (w[3:] + np.cross(arm, w[:3])) / np.sqrt(np.trace(p.inertia) / 2)]

            value.append(scaled(wrench[name]))
            change.append(np.array([scaled(w) for w in loose[name].T]).T)
    return np.linalg.lstsq(np.vstack(change), -np.concatenate(value), rcond=None)[0]
