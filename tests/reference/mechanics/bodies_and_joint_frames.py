"""Mass properties of bodies, and the joint frames on both sides of joints, read from a Scene by the rules of notation.md."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.scene.data_classes.bodies import AxialInertia

AXES = {"x": 0, "y": 1, "z": 2}
GROUND = "ground"


@dataclass(frozen=True)
class Part:
    """Mass properties of a body: mass, kg; mass centre in the body's frame, m; inertia about it in the body's axes (3×3), kg m²."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class Frames:
    """Both sides of a joint in their bodies' frames: point and 3x3 frame whose columns are e1, e2, e3."""

    inboard: str
    p_in: np.ndarray
    F_in: np.ndarray
    outboard: str
    p_out: np.ndarray
    F_out: np.ndarray


def solid(body) -> tuple[float, np.ndarray]:
    """Volume and inertia per mass of the body's shape (box edges, cylinder, ball radius)."""
    if body.box is not None:
        x, y, z = body.box
        return x * y * z, np.diag([y * y + z * z, z * z + x * x, x * x + y * y]) / 12
    if body.cylinder is not None:
        r, h = body.cylinder.radius, body.cylinder.length
        along = AXES[body.cylinder.axis[-1]]
        spin = np.full(3, (3 * r * r + h * h) / 12)
        spin[along] = r * r / 2
        return np.pi * r * r * h, np.diag(spin)
    if body.sphere is not None:
        r = body.sphere
        return 4 / 3 * np.pi * r**3, 0.4 * r * r * np.eye(3)
    raise ValueError("a body without shape needs mass and inertia")


def part(body) -> Part:
    """Mass properties of one body. Explicit inertia takes precedence over the shape. An axial inertia is 0 about all lines across
    its axis."""
    mass = body.mass if body.mass is not None else body.density * solid(body)[0]
    if isinstance(body.inertia, AxialInertia):
        axis = direction(body.inertia.axis)
        inertia = body.inertia.axial * np.outer(axis, axis)
    elif body.inertia is not None:
        values = list(body.inertia) + [0.0] * (6 - len(body.inertia))
        xx, yy, zz, xy, xz, yz = values
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)
    else:
        inertia = mass * solid(body)[1]
    return Part(float(mass), np.array(body.center, float), inertia)


def parts(scene) -> dict[str, Part]:
    """Mass properties of all bodies (not of the ground)."""
    return {name: part(body) for name, body in scene.bodies.items()}


def direction(d) -> np.ndarray:
    """Unit vector of an axis name ("-x") or of three numbers."""
    if isinstance(d, str):
        return (-1.0 if d.startswith("-") else 1.0) * np.eye(3)[AXES[d[-1]]]
    d = np.array(d, float)
    return d / np.linalg.norm(d)


def frame(axis, reference) -> np.ndarray:
    """Joint frame: e1 the axis, e2 the part of the reference across it, default reference by the cycle x, y, z."""
    if axis is None:
        return np.eye(3)
    e1 = direction(axis)
    after = np.eye(3)[(int(np.argmax(np.abs(e1))) + 1) % 3]
    e2 = after if reference is None else direction(reference)
    e2 = e2 - (e2 @ e1) * e1
    e2 = e2 / np.linalg.norm(e2)
    return np.column_stack([e1, e2, np.cross(e1, e2)])


def named_point(scene, body: str, point) -> np.ndarray:
    """A point of a body or of the ground, given by name or by position."""
    if not isinstance(point, str):
        return np.array(point, float)
    owner = scene.ground if body == GROUND else scene.bodies[body]
    return np.array(owner.points[point], float)


def place(scene, text: str) -> tuple[str, np.ndarray | None]:
    """The body that "body.point" names, and the point's position on this body; None if the text names only a body."""
    body, _, point = text.partition(".")
    return body, (named_point(scene, body, point) if point else None)


def _side(scene, joint, side) -> tuple[str, np.ndarray, np.ndarray]:
    if isinstance(side, str):
        body, point = place(scene, side)
        return body, (np.zeros(3) if point is None else point), frame(joint.axis, joint.reference)
    axis = side.axis if side.axis is not None else joint.axis
    reference = side.reference if side.reference is not None else joint.reference
    return side.body, named_point(scene, side.body, side.point), frame(axis, reference)


def joint_frames(scene, joint) -> Frames:
    """Points and frames of both sides of a joint."""
    return Frames(*_side(scene, joint, joint.inboard), *_side(scene, joint, joint.outboard))
