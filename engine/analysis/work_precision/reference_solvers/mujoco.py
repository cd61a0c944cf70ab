"""MuJoCo: the mechanism as an MJCF model. Soft constraints close the loops."""

from __future__ import annotations

import time

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import Link, Part, Snapshot
from trunnion.analysis.work_precision.reference_solvers.solver_interface import ReferenceSolver, SceneNotSupported, Setting
from trunnion.importers.pose_matrices import to_quaternion
from trunnion.system.structure.bodies_and_joints import GROUND


class Mujoco(ReferenceSolver):
    """A scene in MuJoCo with fixed steps. MuJoCo's own C loop makes all steps between two samples."""

    name = "mujoco"
    package = "mujoco"
    methods = ("RK4", "implicitfast")
    steps = (1, 3, 10, 30, 100, 300, 1000)

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        super().__init__(ready, scene)
        wrong = list(scene.missing)
        wrong += [f"{k.kind} {k.name} closing a loop" for k in scene.links if k.cut and k.kind not in ("revolute", "spherical")]
        wrong += [f"screw {k.name}" for k in scene.links if k.kind == "screw"]
        if wrong:
            raise SceneNotSupported("not represented: " + ", ".join(wrong))
        if any(p.inertia.trace() <= 0 for p in scene.parts):
            raise SceneNotSupported("a point mass (MuJoCo needs inertia about every axis)")
        import mujoco

        try:
            mujoco.MjModel.from_xml_string(self.xml(self.settings()[0]))
        except ValueError as e:
            raise SceneNotSupported(str(e)) from e

    def describe_omissions(self) -> str:
        """The parts of the scene that MuJoCo omits, and its differences from the engine."""
        words = ["fixed steps, no error control"]
        thin = any(np.abs(repair_inertia(p.inertia) - p.inertia).max() > 0 for p in self.scene.parts)
        words += ["inertia added about axes that had none"] if thin else []
        words += ["joint friction (MuJoCo has none that depends on the load)"] if self.scene.rubs else []
        words += ["loops closed by soft constraints, made as stiff as the step allows"] if self.scene.loops else []
        return "; ".join(words)

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Step from sample to sample (see ``ReferenceSolver.run``)."""
        import mujoco

        mujoco.set_mju_user_warning(_ignore_warning)
        model = mujoco.MjModel.from_xml_string(self.xml(s))
        data = mujoco.MjData(model)
        data.qvel[:] = self.velocities()
        steps = round(self.ready.every / s.step)
        ids = [model.body(p.name).id for p in self.scene.parts]
        mujoco.mj_forward(model, data)
        out = [data.xipos[ids].copy()]
        started = time.perf_counter()
        for _ in range(self.samples):
            mujoco.mj_step(model, data, nstep=steps)
            mujoco.mj_kinematics(model, data)
            out.append(data.xipos[ids].copy())
        seconds = time.perf_counter() - started
        return self.by_position(np.array(out)), seconds

    def velocities(self) -> list[float]:
        """Start rates (qvel) in the order of the joints, m/s and rad/s. The rates of a ball joint refer to the child's axes."""
        out: list[float] = []
        for i, p in enumerate(self.scene.parts):
            link = next(k for k in self.scene.links if not k.cut and k.child == i)
            sign = 1.0 if link.forward else -1.0
            if link.kind == "free":
                out += [*p.velocity, *(p.R.T @ p.omega)]
            elif link.kind == "spherical":
                out += list(p.R.T @ (sign * link.omega))
            else:
                out += [f.rate for f in _freedoms_from_parent(link)]
        return out

    def xml(self, s: Setting) -> str:
        """The scene as MJCF. Each body frame has its origin at the mass centre and its axes along those of the body. All joint
        coordinates are zero at the start."""
        tight = f'solref="{2 * s.step:.17g} 1" solimp="0.9999 0.9999 0.001 0.5 2"'
        head = (
            '<mujoco><compiler angle="radian" autolimits="true" inertiafromgeom="false" balanceinertia="false"/>'
            f'<option timestep="{s.step:.17g}" integrator="{s.method}" gravity="{_format(self.scene.gravity)}" '
            'tolerance="1e-14" iterations="50"><flag contact="disable"/></option><worldbody>'
        )
        ground = "".join(self._sites(GROUND))
        tree = "".join(self._body(i) for i, p in enumerate(self.scene.parts) if p.parent == GROUND)
        return head + ground + tree + "</worldbody>" + self._closures(tight) + self._springs() + self._motors() + "</mujoco>"

    def _body(self, i: int) -> str:
        p = self.scene.parts[i]
        parent = self.scene.parts[p.parent] if p.parent != GROUND else None
        R = parent.R if parent else np.eye(3)
        origin = parent.center if parent else np.zeros(3)
        at = R.T @ (p.center - origin)
        link = next(k for k in self.scene.links if not k.cut and k.child == i)
        inside = _inertial_element(p) + _joint_elements(link, p)
        children = "".join(self._body(c) for c, q in enumerate(self.scene.parts) if q.parent == i)
        place = f'pos="{_format(at)}" quat="{_format(to_quaternion(R.T @ p.R))}"'
        return f'<body name="{p.name}" {place}>{inside}{"".join(self._sites(i))}{children}</body>'

    def _sites(self, body: int) -> list[str]:
        """MJCF sites of a body: the end points of springs."""
        return [
            f'<site name="spring{n}_{end}" pos="{_format(s.points[end])}"/>'
            for n, s in enumerate(self.scene.springs) for end in (0, 1) if s.bodies[end] == body
        ]

    def _closures(self, tight: str) -> str:
        """Point constraints for joints that close loops: one point for a ball joint, two points on the axis for a revolute."""
        out = []
        for link in (k for k in self.scene.links if k.cut):
            arms = [0.0] if link.kind == "spherical" else [-0.5, 0.5]
            body = link.outboard if link.outboard != GROUND else link.inboard
            other = link.inboard if link.outboard != GROUND else GROUND
            p = self.scene.parts[body]
            for a in arms:
                anchor = p.R.T @ (link.point + (a * link.freedoms[0].axis if a else 0.0) - p.center)
                second = f' body2="{self.scene.parts[other].name}"' if other != GROUND else ""
                out.append(f'<connect body1="{p.name}"{second} anchor="{_format(anchor)}" {tight}/>')
        return f"<equality>{''.join(out)}</equality>" if out else ""

    def _springs(self) -> str:
        out = [
            f'<spatial stiffness="{s.stiffness:.17g}" damping="{s.damping:.17g}" springlength="{s.length:.17g}">'
            f'<site site="spring{n}_0"/><site site="spring{n}_1"/></spatial>'
            for n, s in enumerate(self.scene.springs)
        ]
        return f"<tendon>{''.join(out)}</tendon>" if out else ""

    def _motors(self) -> str:
        """Constant efforts of joints, expressed as motors of constant force."""
        out = [
            f'<general joint="{k.name}_{i}" gaintype="fixed" gainprm="0" biastype="affine" biasprm="{e:.17g} 0 0"/>'
            for k in self.scene.links if not k.cut for i, e in enumerate(k.effort if k.forward else k.effort[::-1]) if e
        ]
        return f"<actuator>{''.join(out)}</actuator>" if out else ""


def repair_inertia(inertia: np.ndarray) -> np.ndarray:
    """The inertia with its two smaller principal moments raised until their sum is at least the largest moment, as MuJoCo
    requires.

    Only bodies with zero moments about some axes (thin rods, planar bodies) need this. Planar motion does not depend on the change.
    """
    moments, axes = np.linalg.eigh(inertia)
    lack = moments[2] * (1 + 1e-9) - moments[0] - moments[1]
    if lack > 0:
        moments = moments + np.array([0.5 * lack, 0.5 * lack, 0.0])
    return axes @ np.diag(np.maximum(moments, 1e-9 * moments[2])) @ axes.T


def _inertial_element(p: Part) -> str:
    """The MJCF inertia of a part: principal moments if the body's axes are principal axes, else the full matrix.

    MuJoCo accepts smaller values as principal moments than as diagonal entries of a full matrix.
    """
    inertia = repair_inertia(p.inertia)
    if np.count_nonzero(inertia - np.diag(np.diag(inertia))):
        six = f'fullinertia="{_format(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])}"'
    else:
        six = f'diaginertia="{_format(np.diag(inertia))}"'
    return f'<inertial pos="0 0 0" mass="{p.mass:.17g}" {six}/>'


def _ignore_warning(message: str) -> None:
    """Ignore MuJoCo's warnings about states that are not finite: the result contains these states."""


def _freedoms_from_parent(link: Link):
    """Freedoms in the order from parent to child. A positive rate along each axis moves the child relative to the parent."""
    from dataclasses import replace

    chosen = link.freedoms if link.forward else link.freedoms[::-1]
    return [f if link.forward else replace(f, axis=-f.axis) for f in chosen]


def _joint_elements(link: Link, p: Part) -> str:
    """The MJCF joint elements of a body. The joint coordinates are zero at the start."""
    at = _format(p.R.T @ (link.point - p.center))
    if link.kind == "free":
        return "<freejoint/>"
    if link.kind == "spherical":
        return f'<joint name="{link.name}_0" type="ball" pos="{at}"/>'
    return "".join(
        f'<joint name="{link.name}_{k}" type="{"hinge" if f.turns else "slide"}" pos="{at}" axis="{_format(p.R.T @ f.axis)}"/>'
        for k, f in enumerate(_freedoms_from_parent(link))
    )


def _format(values) -> str:
    return " ".join(f"{x:.17g}" for x in np.asarray(values).ravel())
