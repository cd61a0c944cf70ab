"""Each joint is a pin in a bearing, and every constrained direction is a spring. In joints with friction, the contacts are springs
with friction.

A joint without friction has the stiffness of two contacts whose arm is a tenth of its block's size. Their centre is the point of
the part that has the ends, as for contacts with friction. """

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.compliant import contact_springs
from tests.reference.compliant.friction_laws import Laws, NotJudged, Signals
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, Pairs, back, cross, dot, times
from tests.reference.mechanics.bodies_and_joint_frames import GROUND
from tests.reference.mechanics.joint_constraints import of

USUAL = 1e8
"""Stiffness of a joint for which the scene gives none, N/m; only ratios count."""
KINDS = {"revolute": "shaft", "cylindrical": "shaft", "prismatic": "sleeve", "spherical": "ball"}
SIZES = ("radius", "half_length", "half_width", "half_height", "thrust_radius")


@dataclass(frozen=True)
class Level:
    """Distance of the model from the rigid limit. stiffness of a contact, N/m; delay: damping over stiffness, s; speed, rate:
    limits below which friction rests, m/s and rad/s."""

    stiffness: float
    delay: float
    speed: float
    rate: float


def arm(frames: Frames, name: str) -> float:
    """A tenth of the size of the joint's block. For a joint on no loop, a tenth of the radius of gyration of its parts; the result
    does not depend on this number."""
    f = frames.frames[name]
    both = [frames.parts[b] for b in (f.inboard, f.outboard) if b != GROUND]
    return frames.arms[name] or 0.1 * float(np.sqrt(np.mean([np.trace(b.inertia) / 2 / b.mass for b in both])))


def thread_arm(frames: Frames, name: str, joint) -> float:
    """The arm at which a thread carries torques and bending. It is the radius of the thread, if the thread has one."""
    return float(joint.friction.radius) if joint.friction is not None and joint.friction.radius else arm(frames, name)


def is_given(friction) -> bool:
    """True if friction is a given force or torque."""
    return friction is not None and (friction.force is not None or friction.torque is not None)


def is_loaded(friction) -> bool:
    """True if friction grows with the load that the joint transmits."""
    return friction is not None and getattr(friction, "load_friction", None) is not None


def _one(value, what: str) -> float:
    if isinstance(value, (tuple, list)):
        raise NotJudged(f"two values of {what}")
    return value


class Fits:
    """The springs and contacts of the joints of a scene."""

    def __init__(self, scene, frames: Frames, level: Level):
        self.scene, self.frames, self.level = scene, frames, level
        self.names = list(scene.joints)
        joints = list(scene.joints.values())
        rubs = [j.friction is not None and not is_given(j.friction) for j in joints]
        self.turned = [r and j.pin == "outboard" for r, j in zip(rubs, joints, strict=True)]
        self.sign = np.array([-1.0 if x else 1.0 for x in self.turned])
        self.sides = frames.sides(self.names, self.turned)
        first = ["outboard" if t else "inboard" for t in self.turned]
        self.ended = np.array([float((j.ends or j.pin or "inboard") == f) for j, f in zip(joints, first, strict=True)])
        for name, j, r in zip(self.names, joints, rubs, strict=True):
            if r and j.type not in (*KINDS, "screw"):
                raise NotJudged(f"{name}: friction of a {j.type} joint")
            if j.friction is not None and (j.friction.normal_force or scene.friction.normal_force) == "adams":
                raise NotJudged(f"{name}: friction as Adams computes it")
            if r and j.ends == "overlap":
                raise NotJudged(f"{name}: ends at the overlap")
        self._stiffness(joints, rubs)
        self.rubbing = [g for kind in ("shaft", "sleeve", "ball") if (g := self._group(kind, joints, rubs))]
        self.given = self._given(joints)

    def _stiffness(self, joints, rubs) -> None:
        """Stiffness of the six directions of joints without friction. Other joints have the stiffness of their contacts."""
        n = len(joints)
        self.k, self.held, self.kr = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        self.way, self.crossed = np.zeros((n, 3)), np.array([of(j.type).crossed for j in joints], bool)
        self.loose = np.array([len([d for d in of(j.type).free if d >= 3]) == 0 for j in joints], bool)
        self.each = self.level.stiffness * np.array([(j.stiffness or USUAL) / USUAL for j in joints])
        for i, (name, j) in enumerate(zip(self.names, joints, strict=True)):
            kind, k, c = of(j.type), self.each[i], arm(self.frames, name)
            self.held[i] = [d not in kind.free for d in range(3)]
            if kind.lead:
                self.held[i, 0] = 0.0
            if rubs[i] and j.type in KINDS:
                continue
            if kind.lead:
                c = thread_arm(self.frames, name, j)
            single = kind.ball
            self.k[i] = self.held[i] * (k if single else 2 * k)
            pin = j.type in KINDS
            if pin and not single and 0 not in kind.free:
                self.k[i, 0] = k
            turns = np.array([d not in kind.free for d in (3, 4, 5)], float)
            self.kr[i] = turns * k * c * c * np.array([1.0 if pin else 2.0, 2.0, 2.0])

    def _group(self, kind: str, joints, rubs) -> tuple | None:
        at = [i for i, j in enumerate(joints) if rubs[i] and KINDS.get(j.type) == kind]
        if not at:
            return None
        some, names = [joints[i] for i in at], [self.names[i] for i in at]
        frictions = [j.friction for j in some]
        size = {s: np.array([_one(getattr(f, s) or 0.0, s) for f in frictions], float) for s in SIZES}
        size["preload"] = Signals(self.scene, [_one(f.preload, "preload") for f in frictions])
        size["slides"] = np.array([float(j.type == "cylindrical") for j in some])
        eps = np.full(len(at), self.level.speed) if kind == "sleeve" else size["radius"] * self.level.rate
        ends = np.array([float((j.ends or j.pin) == j.pin) for j in some])
        return getattr(contact_springs, kind), np.array(at), size, Laws(self.scene, frictions, eps), ends, names

    def _given(self, joints) -> tuple | None:
        at = [i for i, j in enumerate(joints) if is_given(j.friction) and not is_loaded(j.friction)]
        if not at:
            return None
        f = [joints[i].friction for i in at]
        size = {}
        for one, other in (("torque", "back_torque"), ("force", "back_force")):
            first = [_one(getattr(x, one), one) for x in f]
            size[one] = Signals(self.scene, first)
            both = [getattr(x, other) if getattr(x, other) is not None else a for x, a in zip(f, first, strict=True)]
            size[other] = Signals(self.scene, both)
        n = len(at)
        turn = Laws(self.scene, f, np.full(n, self.level.rate), given=True)
        return np.array(at), size, turn, Laws(self.scene, f, np.full(n, self.level.speed), given=True)

    # -- forces ----------------------------------------------------------------------------------------------------------

    def relative_motion(self, m: Motion) -> tuple[Pairs, contact_springs.RelativeMotion]:
        """Motion of bearings relative to pins: in the world and in the pins' frames."""
        pairs = self.sides.pairs(m)
        x, slide, spin = back(pairs.A, pairs.q - pairs.p), back(pairs.A, pairs.slide), back(pairs.A, pairs.turn)
        R = pairs.A.swapaxes(-1, -2) @ pairs.B
        tilt = np.stack([np.where(self.loose, R[..., 2, 1], 0.0), -R[..., 2, 0], R[..., 1, 0]], axis=-1)
        tau = self.level.delay
        turn = tilt + tau * spin
        return pairs, contact_springs.RelativeMotion(m.t, x * self.held + tau * slide * self.held, turn, slide, spin, -x[..., 0])

    def violations(self, m: Motion) -> np.ndarray:
        """Displacements against the constraints (with delay 0) or, with ``rates`` alone, their rates: n x joints x 6, for the held
        directions."""
        pairs, s = self.relative_motion(m)
        out = np.concatenate([s.x, s.turn], axis=-1)
        third = cross(pairs.A[..., 0], pairs.B[..., 1])
        skewed = -dot(pairs.A[..., 0], pairs.B[..., 1]) + self.level.delay * dot(pairs.turn, third)
        out[..., 5] = np.where(self.crossed, skewed, out[..., 5])
        return out * self.mask

    @property
    def mask(self) -> np.ndarray:
        """1 for the directions that a joint holds: joints x 6."""
        rows = []
        for i, name in enumerate(self.names):
            free = of(self.scene.joints[name].type).free
            turns = [0.0, 0.0, 1.0] if self.crossed[i] else [float(d not in free) for d in (3, 4, 5)]
            rows.append([*self.held[i], *turns])
        return np.array(rows).reshape(-1, 6)

    def act(self, m: Motion, out: Forces) -> None:
        """Add the forces of all joints."""
        if not self.names:
            return
        pairs, s = self.relative_motion(m)
        # position of the springs along the axis, as for contacts with friction
        at = np.where(self.crossed, 0.0, s.ends * self.ended)
        force, torque = self.k * s.x, self.kr * s.turn
        force[..., 1] += self.k[:, 1] * at * s.turn[..., 2]
        force[..., 2] -= self.k[:, 2] * at * s.turn[..., 1]
        torque[..., 2] += at * force[..., 1]
        torque[..., 1] -= at * force[..., 2]
        taken = np.zeros(len(m.t))
        for solve, at, size, law, ends, _ in self.rubbing:
            part = contact_springs.RelativeMotion(m.t, *(a[:, at] for a in (s.x, s.turn, s.slide, s.spin)), s.ends[:, at] * ends)
            w = solve(part, self.each[at], size, lambda v, law=law: law.slope(m.t, v))
            force[:, at] += w.force
            torque[:, at] += w.torque
            taken += w.taken.sum(-1)
        if self.given is not None:
            at, size, turn, way = self.given
            part = contact_springs.RelativeMotion(m.t, *(a[:, at] for a in (s.x, s.turn, s.slide, s.spin)), s.ends[:, at])
            w = contact_springs.given(part, size, lambda v: turn.slope(m.t, v), lambda v: way.slope(m.t, v), self.sign[at])
            force[:, at] += w.force
            torque[:, at] += w.torque
            taken += w.taken.sum(-1)
        torque[..., :] = np.where(self.crossed[:, None], 0.0, torque)
        push, moment = times(pairs.A, force), times(pairs.A, torque)
        if self.crossed.any():
            third = cross(pairs.A[..., 0], pairs.B[..., 1])
            skewed = -dot(pairs.A[..., 0], pairs.B[..., 1]) + self.level.delay * dot(pairs.turn, third)
            moment += np.where(self.crossed, self.kr[:, 2] * skewed, 0.0)[..., None] * third
        out.between(self.sides.two, self.sides.one, pairs.q, push, moment)
        out.taken += taken


