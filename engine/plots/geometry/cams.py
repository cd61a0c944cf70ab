"""Cams and rollers, drawn as discs on their bodies. The edge of a cam's disc is the curve of the cam."""

from __future__ import annotations

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.plots.geometry.gear_wheels import Wheel
from trunnion.plots.geometry.meshes import Mesh, box, cylinder, placed, ring
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import JointSide, sides_of
from trunnion.system.construction.cam_profile_spline import closed, profile
from trunnion.system.construction.joint_frames import frame, matrix

STATIONS = 120
"""Corners of a drawn cam."""
THICK = 0.2
"""Thickness of a disc, divided by its largest radius."""
HUB = 0.3
"""Radius of a disc's hole, divided by the disc's smallest radius."""


def cams(scene: sm.Scene) -> list[Wheel]:
    """The discs, rollers and plates of all cams. (An internal cam is a wall, which ``slots`` draws.)"""
    out = []
    for name, j in scene.joints.items():
        follows = REGISTRY[j.type].follows
        if not follows or j.profile is None:
            continue
        a, b = sides_of(scene, j)
        edge = outline(j)
        width = THICK * float(np.hypot(*edge.T).max())
        if not j.internal:
            out.append(Wheel(a.body, name, mounted(a, disc(edge, width))))
        if follows == "face":
            plate = placed(box(width, 1.5 * width / THICK, 1.5 * width), np.eye(3), np.array([0.5 * width, 0.0, 0.0]))
            out.append(Wheel(b.body, name, mounted(b, plate)))
        if j.roller:
            roller = cylinder(float(j.roller), 1.2 * width)
            out.append(Wheel(b.body, name, mounted(b, roller)))
    return out


def mounted(s: JointSide, mesh: Mesh) -> Mesh:
    """A mesh in the frame of the body, from a mesh in a joint frame."""
    return placed(mesh, matrix(frame(s.axis, s.reference)), np.array(s.point, float))


def outline(j: sm.Joint) -> np.ndarray:
    """The edge of a cam along e2 and e3 (n×2), m. The edge is the follower's path minus the roller's radius, or the envelope of a
    flat follower."""
    given = j.profile
    assert given is not None
    curve = profile(given, 0.0)
    first, last = float(given.angle[0]), float(given.angle[-1])
    angle = np.linspace(first, last, STATIONS + 1)[: STATIONS if closed(given) else None]
    middle, starts, pieces = 0.5 * (first + last), np.array(curve.starts), np.array(curve.pieces)
    of = np.clip(np.searchsorted(starts, angle - middle, "right") - 1, 0, None)
    x, (c0, c1, c2, c3) = angle - middle - starts[of], pieces[of].T
    r, slope = c0 + x * (c1 + x * (c2 + x * c3)), c1 + x * (2 * c2 + 3 * x * c3)
    e = np.exp(1j * angle)
    if REGISTRY[j.type].follows == "face":
        edge = (r + 1j * slope) * e
    else:
        n = (r - 1j * slope) * e
        edge = r * e + (1.0 if j.internal else -1.0) * float(j.roller or 0.0) * n / abs(n)
    if not (closed(given) or j.internal):  # if the profile spans less than a turn, close the edge along the hub
        edge = np.append(edge, [HUB * abs(edge).min() * e[-1], HUB * abs(edge).min() * e[0]])
    return np.column_stack([edge.real, edge.imag])


def disc(edge: np.ndarray, width: float) -> Mesh:
    """A disc about x with an edge (n×2) along y, z and a round hole."""
    size = np.hypot(*edge.T)
    hole = edge / size[:, None] * HUB * size.min()
    return ring([np.column_stack([np.full(len(edge), x), e]) for x in (-0.5 * width, 0.5 * width) for e in (hole, edge)])
