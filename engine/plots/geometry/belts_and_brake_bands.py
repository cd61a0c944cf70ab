"""Belts, chains and brake bands, drawn as straps. Belts and chains go around wheels, brake bands around drums."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from trunnion.elements.contact.wrapped_band import RADIUS, WRAP
from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.declaration_checks import Numeric
from trunnion.plots.geometry.meshes import Mesh, box, join, placed
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.body_references import body_of
from trunnion.scene.queries.joint_contact_elements import sizes_given, touching
from trunnion.scene.queries.wheel_sizes import rolls_of, sizes
from trunnion.system.construction.joint_frames import frame, matrix
from trunnion.system.construction.spanning_tree import span
from trunnion.system.construction.wheel_pairs import stands

WIDE, THICK = 0.24, 0.05
"""Width and thickness of a strap, divided by the radius of its smaller wheel."""
STEP = np.deg2rad(12.0)
"""Angle of one straight piece of a strap on a wheel."""


def straps(scene: sm.Scene) -> list[tuple[str, str, Mesh]]:
    """(joint, body, mesh in the frame of the body) of each strap. A belt is drawn only if one body carries both wheels of the
    belt."""
    pairs = {n: j for n, j in scene.joints.items() if (r := REGISTRY[j.type].rolls) and not r.opposite}
    out = [(name, *found) for name, j in scene.joints.items() if (found := _brake(scene, j))]
    if not pairs:
        return out
    spanning = span(scene)
    where = stands(scene, spanning)
    carrier = {c: body_of(j.inboard if forward else j.outboard)
               for n, c, forward in spanning.tree for j in (scene.joints[n],)}  # fmt: skip
    for name, j in pairs.items():
        sides = sides_of(scene, j)
        on = {carrier.get(s.body, "") for s in sides}
        if len(on) == 1 and (body := on.pop()) in where:
            stand = where[body]
            (E, p), (_, q) = (where[s.body].side(s) for s in sides)
            frame_ = stand.R.T @ E
            out.append((name, body, placed(_belt(j, E.T @ (q - p)), frame_, stand.R.T @ (p - stand.r))))
    return out


def cage(radius: float, thick: float) -> Mesh:
    """Three circles about x, y and z, which show a point where a load acts. radius and thickness in m."""
    circle = join(list(_plates(_circle(np.linspace(0.0, 2 * np.pi, _pieces(2 * np.pi)), radius), thick, thick)))
    return join([placed(circle, np.roll(np.eye(3), k, axis=0), np.zeros(3)) for k in range(3)])


def _belt(j: sm.Joint, other: np.ndarray) -> Mesh:
    """The strap of a belt in the joint frame of its first wheel. other: place of the second wheel in this frame (3), m."""
    of = sizes(j)
    r = np.abs(of.radii(rolls_of(j).touch, Numeric))
    apart, middle = float(np.hypot(other[1], other[2])), float(np.arctan2(other[2], other[1]))
    turn = float(np.arccos(np.clip((r[0] + r[1] if j.crossed else r[0] - r[1]) / apart, -1.0, 1.0)))
    far = np.pi + turn if j.crossed else turn
    first = np.linspace(middle + turn, middle + 2 * np.pi - turn, _pieces(2 * np.pi - 2 * turn))
    last = np.linspace(middle - far, middle + far, _pieces(2 * far)) if not j.crossed else np.linspace(
        middle + np.pi - turn, middle - np.pi + turn, _pieces(2 * np.pi - 2 * turn))  # fmt: skip
    spots = [_circle(first, r[0]), _circle(last, r[1]) + other * [0.0, 1.0, 1.0]]
    return _strap(np.concatenate([*spots, spots[0][:1]]), min(r))


def _brake(scene: sm.Scene, j: sm.Joint) -> tuple[str, Mesh] | None:
    """(inboard body, band around the drum with its two straight ends), for a joint with a band brake."""
    element = touching(j) if j.friction is not None else None
    if element is None or j.friction is None or element.tensions is None:
        return None
    given, side = sizes_given(j.friction, element), sides_of(scene, j)[0]
    wrap = getattr(j.friction, WRAP.name, None)
    if RADIUS.name not in given or wrap is None:
        return None
    radius, half = given[RADIUS.name], 0.5 * abs(float(wrap))
    arc = _circle(np.linspace(-half, half, _pieces(2 * half)), radius)
    ends = [arc[k] + s * radius * _circle(np.array([s * half + np.pi / 2]), 1.0) for k, s in ((0, -1), (-1, 1))]
    mesh = _strap(np.concatenate([ends[0], arc, ends[1]]), radius)
    return side.body, placed(mesh, matrix(frame(side.axis, side.reference)), np.array(side.point, float))


def _pieces(angle: float) -> int:
    return max(2, int(np.ceil(abs(angle) / STEP)) + 1)


def _circle(angles: np.ndarray, radius: float) -> np.ndarray:
    """Points on a circle about x (n×3)."""
    return radius * np.column_stack([np.zeros(len(angles)), np.cos(angles), np.sin(angles)])


def _strap(spots: np.ndarray, radius: float) -> Mesh:
    """A strap along a line of points in the plane x = 0. radius: radius of the smaller wheel."""
    return join(list(_plates(spots, WIDE * radius, THICK * radius)))


def _plates(spots: np.ndarray, wide: float, thick: float) -> Iterator[Mesh]:
    for p, q in pairwise(spots):
        along, length = q - p, float(np.linalg.norm(q - p))
        if length > 0.0:
            e = along / length
            turn = np.column_stack([e, np.array([1.0, 0.0, 0.0]), np.cross(e, [1.0, 0.0, 0.0])])
            yield placed(box(length, wide, thick), turn, (p + q) / 2)
