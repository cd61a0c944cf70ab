"""Pinocchio computes the accelerations, and SciPy integrates them. Pinocchio uses its articulated-body algorithm or, for loops, its
constraint dynamics."""

from __future__ import annotations

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import Link, Snapshot
from trunnion.analysis.work_precision.reference_solvers.scipy import integrate
from trunnion.analysis.work_precision.reference_solvers.solver_interface import ReferenceSolver, SceneNotSupported, Setting
from trunnion.system.structure.bodies_and_joints import GROUND


class Pinocchio(ReferenceSolver):
    """A scene in Pinocchio. At the start every joint frame has its origin at the joint's point and its axes parallel to the world
    axes."""

    name = "pinocchio"
    package = "pin"
    methods = ("DOP853", "LSODA")

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        super().__init__(ready, scene)
        wrong = list(scene.missing) + (["springs between points"] if scene.springs else [])
        closing = ("revolute", "spherical")
        wrong += [f"{k.kind} {k.name}" for k in scene.links if k.kind in ("screw", "fixed") or (k.cut and k.kind not in closing)]
        if wrong:
            raise SceneNotSupported("not represented: " + ", ".join(wrong))
        self._build()

    def describe_omissions(self) -> str:
        """The parts of the scene that Pinocchio omits, and its differences from the engine."""
        words = ["integrated by SciPy, called from Python"]
        words += ["joint friction"] if self.scene.rubs else []
        words += ["loops drift (only their accelerations are constrained)"] if self.scene.loops else []
        return "; ".join(words)

    def _build(self) -> None:
        import pinocchio as pin

        self.pin, self.model = pin, pin.Model()
        self.model.gravity = pin.Motion(self.scene.gravity, np.zeros(3))
        self.ids: list[int] = []
        self.points: list[np.ndarray] = []
        rates: list[float] = []
        effort: list[float] = []
        for i, p in enumerate(self.scene.parts):
            link = next(k for k in self.scene.links if not k.cut and k.child == i)
            point = p.center if link.kind == "free" else link.point
            parent = self.ids[p.parent] if p.parent != GROUND else 0
            origin = self.points[p.parent] if p.parent != GROUND else np.zeros(3)
            for joint, given, load in _joints(pin, link, p):
                parent = self.model.addJoint(parent, joint, pin.SE3(np.eye(3), point - origin), f"{link.name}{len(rates)}")
                origin = point
                rates += given
                effort += load
            inertia = pin.Inertia(p.mass, p.center - point, p.R @ p.inertia @ p.R.T)
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
            self.ids.append(parent)
            self.points.append(point)
        self.data = self.model.createData()
        self.start = np.concatenate([pin.neutral(self.model), rates])
        self.effort = np.array(effort)
        self.closures = pin.StdVec_RigidConstraintModel()
        self.closures.extend(c for k in self.scene.links if k.cut for c in self._closure(k))
        if len(self.closures):
            self.closing = pin.StdVec_RigidConstraintData()
            self.closing.extend(c.createData() for c in self.closures)
            pin.initConstraintDynamics(self.model, self.data, self.closures, self.closing)
            self.accuracy = pin.ProximalSettings(1e-12, 1e-10, 20)

    def _closure(self, link: Link) -> list:
        """Point constraints for a joint that closes a loop: one point for a ball joint, two points on the axis for a revolute."""
        pin, out = self.pin, []
        for a in [0.0] if link.kind == "spherical" else [-0.5, 0.5]:
            at = link.point + (a * link.freedoms[0].axis if a else 0.0)
            sides = [(self.ids[b], at - self.points[b]) if b != GROUND else (0, at) for b in (link.inboard, link.outboard)]
            places = [pin.SE3(np.eye(3), s[1]) for s in sides]
            ends = (sides[0][0], places[0], sides[1][0], places[1])
            out.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, self.model, *ends, pin.ReferenceFrame.LOCAL))
        return out

    def _rate(self, t: float, y: np.ndarray) -> np.ndarray:
        pin, nq = self.pin, self.model.nq
        q, v = pin.normalize(self.model, y[:nq]), y[nq:]
        if len(self.closures):
            a = pin.constraintDynamics(self.model, self.data, q, v, self.effort, self.closures, self.closing, self.accuracy)
        else:
            a = pin.aba(self.model, self.data, q, v, self.effort)
        return np.concatenate([self._turned(q, v), a])

    def _turned(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """q̇ (nq) of configuration q (nq) and velocity v (nv)."""
        out = v
        if self.model.nq != self.model.nv:
            out = np.zeros(self.model.nq)
            for j in range(1, self.model.njoints):
                joint = self.model.joints[j]
                a, b, n = joint.idx_q, joint.idx_v, joint.nq
                out[a : a + n] = v[b : b + n] if n == joint.nv else _quaternion_rate(q[a : a + n], v[b : b + joint.nv])
        return out

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate, then compute the positions of the mass centres at the samples (see ``ReferenceSolver.run``)."""
        y, seconds = integrate(self._rate, self.start, s, self.times)
        return self.by_position(np.array([self._centers(v) for v in y])), seconds

    def _centers(self, y: np.ndarray) -> np.ndarray:
        pin = self.pin
        pin.forwardKinematics(self.model, self.data, pin.normalize(self.model, y[: self.model.nq]))
        return np.array([
            self.data.oMi[i].act(p.center - at) for i, p, at in zip(self.ids, self.scene.parts, self.points, strict=True)
        ])


def _joints(pin, link: Link, part) -> list:
    """(joint, start rates, efforts) from parent to child. A joint with several ordered freedoms becomes several joints."""
    sign = 1.0 if link.forward else -1.0
    if link.kind == "free":
        return [(pin.JointModelFreeFlyer(), [*part.velocity, *part.omega], [0.0] * 6)]
    if link.kind == "spherical":
        return [(pin.JointModelSpherical(), list(sign * link.omega), [0.0] * 3)]
    chosen = list(zip(link.freedoms, link.effort, strict=True))
    make = {True: pin.JointModelRevoluteUnaligned, False: pin.JointModelPrismaticUnaligned}
    return [(make[f.turns](*(sign * f.axis)), [f.rate], [e]) for f, e in (chosen if link.forward else chosen[::-1])]


def _quaternion_rate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """q̇ for the local velocity v. q is the quaternion (x, y, z, w) of a ball joint, or the position and quaternion of a free
    body."""
    x, y, z, w = q[-4:]
    wx, wy, wz = v[-3:]
    turn = 0.5 * np.array([
        w * wx + y * wz - z * wy, w * wy + z * wx - x * wz, w * wz + x * wy - y * wx, -x * wx - y * wy - z * wz,
    ])  # fmt: skip
    if len(q) == 4:
        return turn
    u = np.array([x, y, z])
    cross = np.cross(2 * u, v[:3])
    return np.concatenate([v[:3] + w * cross + np.cross(u, cross), turn])
