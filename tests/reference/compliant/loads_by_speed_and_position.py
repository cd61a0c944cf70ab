"""Loads that depend on speed and position: springs and dampers with curves, drag, fields, attracting points."""

from __future__ import annotations

import numpy as np

from tests.reference.compliant.devices import Freedoms
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, cross, dot
from tests.reference.mechanics.bodies_and_joint_frames import place
from tests.reference.mechanics.characteristic_curves import nonlinear
from tests.reference.mechanics.time_signals import formula_value

KINDS = ("drag", "field", "point_gravity")


class Spot:
    """A point of a body, or of the ground."""

    def __init__(self, scene, frames: Frames, text: str, centre: bool):
        body, local = place(scene, text)
        self.body = frames.index[body]
        middle = frames.center[self.body]
        self.x = (middle if centre else np.zeros(3)) - middle if local is None else local - middle

    def place_and_velocity(self, m: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Place and velocity."""
        arm = m.R[:, self.body] @ self.x
        return m.c[:, self.body] + arm, m.v[:, self.body] + cross(m.w[:, self.body], arm)

    def push(self, m: Motion, force: np.ndarray, out: Forces) -> None:
        """Apply a force at this point."""
        out.force[:, self.body] += force
        out.torque[:, self.body] += cross(m.R[:, self.body] @ self.x, force)


class MotionLoads:
    """All loads of a scene that depend on speed or position."""

    def __init__(self, scene, frames: Frames, free: Freedoms, curves: list):
        self.free, self.curves, self.mass = free, curves, frames.mass
        loads = scene.forces.values()
        self.loads = [(x, Spot(scene, frames, x.on, True)) for x in loads if x.type in KINDS]
        self.suns = {id(x): Spot(scene, frames, x.towards, False) for x in loads if x.type == "point_gravity"}
        self.struts = [(x.nonlinear, [Spot(scene, frames, text, False) for text in x.between])
                       for x in loads if x.type == "spring_damper" and x.nonlinear is not None]  # fmt: skip

    def __bool__(self) -> bool:
        return bool(self.curves or self.loads or self.struts)

    def act(self, m: Motion, out: Forces) -> None:
        """Add the forces."""
        if self.curves:
            q, qd, axes, at = self.free.coordinates(m)
            effort, taken = self.efforts(q, qd)
            out.taken += taken
            self.free.act(effort, axes, at, out)
        for group, (one, two) in self.struts:
            (p, v), (q, w) = one.place_and_velocity(m), two.place_and_velocity(m)
            length = np.sqrt(dot(q - p, q - p))
            along = (q - p) / length[:, None]
            pull, power, _ = nonlinear(group, length, dot(along, w - v))
            one.push(m, pull[:, None] * along, out)
            two.push(m, -pull[:, None] * along, out)
            out.taken -= power
        for load, spot in self.loads:
            getattr(self, f"_{load.type}")(load, spot, m, out)

    def efforts(self, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Efforts of springs and dampers along the freedoms, and the power that the dampers take."""
        effort, taken = np.zeros_like(q), np.zeros(len(q))
        for i, group in self.curves:
            force, power, _ = nonlinear(group, q[:, i], qd[:, i])
            effort[:, i] -= force
            taken -= power
        return effort, taken

    def _drag(self, load, spot: Spot, m: Motion, out: Forces) -> None:
        v = spot.place_and_velocity(m)[1]
        force = -load.density * load.coefficient * load.area / 2 * np.sqrt(dot(v, v))[:, None] * v
        spot.push(m, force, out)
        out.taken -= dot(force, v)

    def _field(self, load, spot: Spot, m: Motion, out: Forces) -> None:
        at = dict(zip("xyz", spot.place_and_velocity(m)[0].T, strict=True))
        parts = [np.zeros(len(m.t)) if x is None else formula_value(x.formula, at) for x in (load.fx, load.fy, load.fz)]
        spot.push(m, np.stack(np.broadcast_arrays(*parts), axis=-1), out)

    def _point_gravity(self, load, spot: Spot, m: Motion, out: Forces) -> None:
        sun = self.suns[id(load)]
        to = sun.place_and_velocity(m)[0] - spot.place_and_velocity(m)[0]
        force = load.gm * self.mass[spot.body] * to / dot(to, to)[:, None] ** 1.5
        spot.push(m, force, out)
        sun.push(m, -force, out)
