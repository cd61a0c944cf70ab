"""A scene at its start as plain numbers in the world frame. Other programs can build the mechanism from these numbers."""

from __future__ import annotations

from dataclasses import field
from typing import TypeGuard

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.pose_matrices import of_quaternion
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_references import point_of
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.joint_frames import matrix
from trunnion.system.structure.bodies_and_joints import GROUND, Joint


@dataclass(frozen=True)
class Part:
    """A body in the world frame.

    Attributes:
        mass: kg.
        center: mass centre (3), m.
        R: the body's axes as columns (3×3).
        inertia: inertia about the mass centre, in the body's axes (3×3), kg m².
        velocity: velocity of the mass centre (3), m/s.
        omega: angular velocity (3), rad/s.
        parent: index of the parent body in the tree, or GROUND.
    """

    name: str
    mass: float
    center: np.ndarray
    R: np.ndarray
    inertia: np.ndarray
    velocity: np.ndarray
    omega: np.ndarray
    parent: int


@dataclass(frozen=True)
class Freedom:
    """A freedom of a joint. axis: world axis (3); turns: whether the freedom is a rotation; rate: rate of the outboard part
    relative to the inboard part."""

    axis: np.ndarray
    turns: bool
    rate: float


@dataclass(frozen=True)
class Link:
    """A joint between two bodies, in the world frame.

    Attributes:
        inboard: index of the inboard body, or GROUND.
        outboard: index of the outboard body, or GROUND.
        point: the joint's point (3), m.
        frame: axes of the inboard frame as columns (3×3).
        cut: whether the joint closes a loop.
        child: index of the child body in the tree.
        forward: whether the child body is the outboard body.
        omega: angular velocity of the outboard part relative to the inboard part (3), rad/s.
        effort: constant effort of each freedom, N or N m.
        rubs: whether the joint has friction.
    """

    name: str
    kind: str
    inboard: int
    outboard: int
    point: np.ndarray
    frame: np.ndarray
    freedoms: tuple[Freedom, ...]
    cut: bool
    child: int
    forward: bool
    omega: np.ndarray
    effort: tuple[float, ...]
    rubs: bool


@dataclass(frozen=True)
class Spring:
    """A spring-damper between two points. points: for each end, the position relative to the mass centre in the body's axes, m; for
    the ground, the world position.

    stiffness, N/m; damping, N s/m; length: free length, m.
    """

    bodies: tuple[int, int]
    points: tuple[np.ndarray, np.ndarray]
    stiffness: float
    damping: float
    length: float


@dataclass(frozen=True)
class Snapshot:
    """The mechanism at its start, in SI units. missing: names of the scene's parts that the snapshot cannot represent."""

    parts: tuple[Part, ...]
    links: tuple[Link, ...]
    springs: tuple[Spring, ...]
    gravity: np.ndarray
    missing: tuple[str, ...] = field(default=())

    @property
    def loops(self) -> bool:
        """Whether any joint closes a loop."""
        return any(link.cut for link in self.links)

    @property
    def rubs(self) -> bool:
        """Whether any joint has friction."""
        return any(link.rubs for link in self.links)


def take_snapshot(ready: BenchmarkModel) -> Snapshot:
    """The snapshot of a compiled scene with its loops assembled."""
    scene = ready.scene
    model = Model(scene, ["*.position[*", "*.orientation[*", "*.velocity[*", "*.angular_velocity[*", "*.qd[*"])
    model.block.configure(Settings())
    model.block.assemble()
    row = np.zeros(model.block.width)
    model.begin(Settings(), 0.0, 1.0, 1.0, row)
    at = dict(zip(["time", *(c.name for c in model.columns)], row.tolist(), strict=True))
    system = model.system
    parts = tuple(_part(scene, at, b.name, b.parent) for b in system.bodies)
    links = tuple(_link(model, parts, j, at) for j in system.joints)
    springs = tuple(_spring(model, parts, s) for s in scene.forces.values() if _is_linear(s))
    return Snapshot(parts, links, springs, np.array(scene.gravity, float), tuple(_unsupported_parts(scene)))


def _vector(at: dict[str, float], name: str, n: int = 3) -> np.ndarray:
    return np.array([at[f"{name}[{k + 1}]"] for k in range(n)])


def _part(scene: sm.Scene, at: dict[str, float], name: str, parent: int) -> Part:
    mass, _, inertia = mass_properties(scene.bodies[name])
    center, R = _vector(at, f"{name}.position"), of_quaternion(_vector(at, f"{name}.orientation", 4))
    velocity, omega = _vector(at, f"{name}.velocity"), _vector(at, f"{name}.angular_velocity")
    return Part(name, float(mass), center, R, np.array(inertia, float), velocity, omega, parent)


def _link(model: Model, parts: tuple[Part, ...], j: Joint, at: dict[str, float]) -> Link:
    """Joint j in the world frame. Its point is the outboard point; the inboard point differs from this point only along sliding
    axes."""
    system, values = model.system, model.built.parameters.values
    number = [values[x.index] if not isinstance(x, float) else x for x in j.out_point]
    body = system.bodies[j.out] if j.out != GROUND else None
    R_in = parts[j.inb].R if j.inb != GROUND else np.eye(3)
    R_out = parts[j.out].R if j.out != GROUND else np.eye(3)
    point = np.array(number, float)
    if body is not None:
        center = np.array([values[x.index] if not isinstance(x, float) else x for x in body.center])
        point = parts[j.out].center + R_out @ (point - center)
    frame_in, frame_out = R_in @ matrix(j.inb_frame), R_out @ matrix(j.out_frame)
    freedoms = []
    for k, axes in enumerate(j.kind.axes):
        a = axes[0]
        freedoms.append(Freedom((frame_in if a.side == "in" else frame_out)[:, a.index], a.rot, at[f"{j.name}.qd[{k + 1}]"]))
    w_in = parts[j.inb].omega if j.inb != GROUND else np.zeros(3)
    w_out = parts[j.out].omega if j.out != GROUND else np.zeros(3)
    effort = _efforts(model.built.scene.joints[j.name], len(freedoms))
    rubs = j.friction is not None
    return Link(
        j.name, j.kind_name, j.inb, j.out, point, frame_in, tuple(freedoms), j.cut, j.child, j.forward, w_out - w_in, effort, rubs,
    )  # fmt: skip


def _efforts(j: sm.Joint, n: int) -> tuple[float, ...]:
    given = j.effort if isinstance(j.effort, tuple) else (j.effort,) * n
    return tuple(float(e) if isinstance(e, int | float) else 0.0 for e in given)


def _spring(model: Model, parts: tuple[Part, ...], s: sm.SpringDamper) -> Spring:
    index = {p.name: i for i, p in enumerate(parts)} | {"ground": GROUND}
    bodies, points = [], []
    for side in s.between:
        name, point = point_of(model.built.scene, side)
        middle = mass_properties(model.built.scene.bodies[name])[1] if name != "ground" else (0.0, 0.0, 0.0)
        bodies.append(index[name])
        points.append(np.array(point, float) - np.array(middle, float))
    return Spring((bodies[0], bodies[1]), (points[0], points[1]), float(s.stiffness), float(s.damping), float(s.length))


UNSUPPORTED = ("spring", "damping", "nonlinear", "rotor_inertia", "end_stops", "drive", "motor", "latch")
"""Parts of joints that a snapshot cannot represent."""


def _is_linear(f: sm.Applied) -> TypeGuard[sm.SpringDamper]:
    """Whether a load is a linear spring-damper."""
    return isinstance(f, sm.SpringDamper) and f.nonlinear is None


def _unsupported_parts(scene: sm.Scene) -> list[str]:
    """Parts of the scene that a snapshot cannot represent, such as "spring of hinge"."""
    out = []
    for name, j in scene.joints.items():
        out += [f"{what} of {name}" for what in UNSUPPORTED if getattr(j, what) is not None]
        efforts = j.effort if isinstance(j.effort, tuple) else (j.effort,)
        out += [f"effort of {name}"] if any(e is not None and not isinstance(e, int | float) for e in efforts) else []
    return out + [f"force {n}" for n, f in scene.forces.items() if not _is_linear(f)]
