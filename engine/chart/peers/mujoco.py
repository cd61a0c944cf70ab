"""MuJoCo: the mechanism as MJCF, loops closed by its soft constraints."""

from __future__ import annotations

import time

import numpy as np

from engine.chart.peers.base import STEPS_A_SAMPLE, Peer, Setting, Unable
from engine.chart.peers.snapshot import Link, Part, Snapshot, quaternion
from engine.chart.runs import Prepared
from engine.system.structure import GROUND

SOLVERS = {"RK4": "RK4", "implicitfast": "implicitfast"}


class Mujoco(Peer):
    """A scene in MuJoCo, stepped with a fixed step; between samples the loop over steps runs in C."""

    name = "mujoco"
    package = "mujoco"

    def __init__(self, ready: Prepared, scene: Snapshot):
        super().__init__(ready, scene)
        wrong = list(scene.missing)
        wrong += [f"{k.kind} {k.name} closing a loop" for k in scene.links if k.cut and k.kind not in ("revolute", "spherical")]
        wrong += [f"screw {k.name}" for k in scene.links if k.kind == "screw"]
        if wrong:
            raise Unable("not represented: " + ", ".join(wrong))
        if any(p.inertia.trace() <= 0 for p in scene.parts):
            raise Unable("a point mass (it wants inertia about every axis)")
        import mujoco

        try:
            mujoco.MjModel.from_xml_string(self.xml(self.settings()[0]))
        except ValueError as e:
            raise Unable(str(e)) from e

    def leaves_out(self) -> str:
        """What is left out of the scene, and how the program differs."""
        words = ["fixed steps, no error control"]
        thin = any(np.abs(possible(p.inertia) - p.inertia).max() > 0 for p in self.scene.parts)
        words += ["inertia added about axes that had none"] if thin else []
        words += ["joint friction (it has none that follows the load)"] if self.scene.rubs else []
        words += ["loops closed by soft constraints, made as stiff as the step allows"] if self.scene.loops else []
        return "; ".join(words)

    def settings(self) -> list[Setting]:
        """Both integrators with ever smaller steps."""
        return [Setting(m, step=self.ready.every / n) for m in SOLVERS for n in STEPS_A_SAMPLE]

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Step from sample to sample (see ``Peer.run``)."""
        import mujoco

        mujoco.set_mju_user_warning(_unstable)
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
        """Start rates (qvel) in the order of the joints; those of a ball joint in the child's axes, rad/s."""
        out: list[float] = []
        for i, p in enumerate(self.scene.parts):
            link = next(k for k in self.scene.links if not k.cut and k.child == i)
            sign = 1.0 if link.forward else -1.0
            if link.kind == "free":
                out += [*p.velocity, *(p.R.T @ p.omega)]
            elif link.kind == "spherical":
                out += list(p.R.T @ (sign * link.omega))
            else:
                out += [f.rate for f in _ordered(link)]
        return out

    def xml(self, s: Setting) -> str:
        """The scene as MJCF. A body's frame has its origin at the mass centre and the body's axes; all joints start at zero."""
        tight = f'solref="{2 * s.step:.17g} 1" solimp="0.9999 0.9999 0.001 0.5 2"'
        head = (
            '<mujoco><compiler angle="radian" autolimits="true" inertiafromgeom="false" balanceinertia="false"/>'
            f'<option timestep="{s.step:.17g}" integrator="{SOLVERS[s.method]}" gravity="{_text(self.scene.gravity)}" '
            'tolerance="1e-14" iterations="50"><flag contact="disable"/></option><worldbody>'
        )
        ground = "".join(self._sites(GROUND))
        tree = "".join(self._body(i) for i, p in enumerate(self.scene.parts) if p.parent == GROUND)
        return head + ground + tree + "</worldbody>" + self._closures(tight) + self._springs() + self._motors() + "</mujoco>"

    def _body(self, i: int) -> str:
        p = self.scene.parts[i]
        parent = self.scene.parts[p.parent] if p.parent != GROUND else None
        R = parent.R if parent else np.eye(3)
        at = R.T @ (p.center - (parent.center if parent else 0.0))
        link = next(k for k in self.scene.links if not k.cut and k.child == i)
        inside = _inertial(p) + _joints(link, p)
        children = "".join(self._body(c) for c, q in enumerate(self.scene.parts) if q.parent == i)
        place = f'pos="{_text(at)}" quat="{_text(quaternion(R.T @ p.R))}"'
        return f'<body name="{p.name}" {place}>{inside}{"".join(self._sites(i))}{children}</body>'

    def _sites(self, body: int) -> list[str]:
        """MJCF sites of a body at which springs end."""
        return [
            f'<site name="spring{n}_{end}" pos="{_text(s.points[end])}"/>'
            for n, s in enumerate(self.scene.springs) for end in (0, 1) if s.bodies[end] == body
        ]

    def _closures(self, tight: str) -> str:
        """The joints that close loops as point constraints: one for a ball, two along the axis for a revolute."""
        out = []
        for link in (k for k in self.scene.links if k.cut):
            arms = [0.0] if link.kind == "spherical" else [-0.5, 0.5]
            body = link.outboard if link.outboard != GROUND else link.inboard
            other = link.inboard if link.outboard != GROUND else GROUND
            p = self.scene.parts[body]
            for a in arms:
                anchor = p.R.T @ (link.point + (a * link.freedoms[0].axis if a else 0.0) - p.center)
                second = f' body2="{self.scene.parts[other].name}"' if other != GROUND else ""
                out.append(f'<connect body1="{p.name}"{second} anchor="{_text(anchor)}" {tight}/>')
        return f"<equality>{''.join(out)}</equality>" if out else ""

    def _springs(self) -> str:
        out = [
            f'<spatial stiffness="{s.stiffness:.17g}" damping="{s.damping:.17g}" springlength="{s.length:.17g}">'
            f'<site site="spring{n}_0"/><site site="spring{n}_1"/></spatial>'
            for n, s in enumerate(self.scene.springs)
        ]
        return f"<tendon>{''.join(out)}</tendon>" if out else ""

    def _motors(self) -> str:
        """Constant efforts of joints, as motors whose control stays at one."""
        out = [
            f'<general joint="{k.name}_{i}" gaintype="fixed" gainprm="0" biastype="affine" biasprm="{e:.17g} 0 0"/>'
            for k in self.scene.links if not k.cut for i, e in enumerate(k.effort if k.forward else k.effort[::-1]) if e
        ]
        return f"<actuator>{''.join(out)}</actuator>" if out else ""


def possible(inertia: np.ndarray) -> np.ndarray:
    """The inertia with the two smaller principal moments raised until a body can have it (their sum is at least the third), which
    MuJoCo wants: thin rods and planar bodies have none about some axes. Planar motion does not feel it."""
    moments, axes = np.linalg.eigh(inertia)
    lack = moments[2] * (1 + 1e-9) - moments[0] - moments[1]
    if lack > 0:
        moments = moments + np.array([0.5 * lack, 0.5 * lack, 0.0])
    return axes @ np.diag(np.maximum(moments, 1e-9 * moments[2])) @ axes.T


def _inertial(p: Part) -> str:
    """The MJCF inertia of a part: principal moments where their axes are the body's (MuJoCo accepts smaller ones in this form
    than in a full matrix), else the matrix."""
    inertia = possible(p.inertia)
    if np.count_nonzero(inertia - np.diag(np.diag(inertia))):
        six = f'fullinertia="{_text(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])}"'
    else:
        six = f'diaginertia="{_text(np.diag(inertia))}"'
    return f'<inertial pos="0 0 0" mass="{p.mass:.17g}" {six}/>'


def _unstable(message: str) -> None:
    """Drop MuJoCo's warnings: they come from states that are no longer finite, which the result shows."""


def _ordered(link: Link):
    """Freedoms in the order MuJoCo meets them, from parent to child, with axes turned so that each is the child's motion."""
    from dataclasses import replace

    chosen = link.freedoms if link.forward else link.freedoms[::-1]
    return [f if link.forward else replace(f, axis=-f.axis) for f in chosen]


def _joints(link: Link, p: Part) -> str:
    """The MJCF joint elements of the body that a link carries; their coordinates are zero at the start."""
    at = _text(p.R.T @ (link.point - p.center))
    if link.kind == "free":
        return "<freejoint/>"
    if link.kind == "spherical":
        return f'<joint name="{link.name}_0" type="ball" pos="{at}"/>'
    return "".join(
        f'<joint name="{link.name}_{k}" type="{"hinge" if f.turns else "slide"}" pos="{at}" axis="{_text(p.R.T @ f.axis)}"/>'
        for k, f in enumerate(_ordered(link))
    )


def _text(values) -> str:
    return " ".join(f"{x:.17g}" for x in np.asarray(values).ravel())
