"""Wheels that roll on each other, drawn as toothed rims on their bodies. The drawn teeth mesh."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.declaration_checks import Numeric
from trunnion.plots.geometry.meshes import Mesh, cylinder, placed, ring
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import JointSide, sides_of
from trunnion.scene.queries.wheel_sizes import rolls_of, sizes
from trunnion.system.construction.joint_frames import frame, matrix
from trunnion.system.construction.spanning_tree import span
from trunnion.system.construction.wheel_pairs import stands

FACE = 8.0
"""Width of a toothed wheel, in modules."""
THIN = 0.3
"""Width divided by radius, for a wheel without teeth. For a wheel with teeth, this is the largest value."""
RIM = 0.35
"""Depth of a drawn rim, divided by its radius."""
STATIONS = ((-0.29, -1.1), (-0.13, 0.95), (0.13, 0.95), (0.29, -1.1))
"""Outline of a tooth: angle divided by the pitch angle, height above the pitch circle in modules."""


@dataclass(frozen=True)
class Wheel:
    """A wheel: its body, the first pair that contains the wheel, and its mesh in the frame of the body."""

    body: str
    pair: str
    mesh: Mesh


def wheels(scene: sm.Scene) -> list[Wheel]:
    """The wheels of all pairs. A wheel that rolls on several other wheels is drawn once."""
    pairs = {name: j for name, j in scene.joints.items() if REGISTRY[j.type].rolls is not None}
    if not pairs:
        return []
    where, drawn = stands(scene, span(scene)), {}
    for name, j in pairs.items():
        sides, of = sides_of(scene, j), sizes(j)
        spots = [where[s.body].side(s) for s in sides]
        for k, mesh in _pair(j, spots):
            key = (sides[k].body, sides[k].point, of.teeth[k], of.module)
            if key not in drawn:
                drawn[key] = Wheel(sides[k].body, name, placed(mesh, _frame(sides[k]), np.array(sides[k].point, float)))
    return list(drawn.values())


def _frame(s: JointSide) -> np.ndarray:
    return matrix(frame(s.axis, s.reference))


def _pair(j: sm.Joint, spots: list[tuple[np.ndarray, np.ndarray]]) -> Iterator[tuple[int, Mesh]]:
    """The wheels of a pair about e1 of their own joint frames."""
    of, rolls, toothed = sizes(j), rolls_of(j), j.teeth is not None
    (E1, p1), (E2, p2) = spots
    cones = rolls.touch == "cones"
    if rolls.touch == "skew":
        r1, r2 = of.radii(rolls.touch, Numeric)
        yield 0, cylinder(r1, 2 * np.pi * of.module)
        towards = E2.T @ (p1 - p2)
        yield 1, rim(r2, of.teeth[1], of.module, min(r1, THIN * r2), False, 0.0, float(np.arctan2(towards[2], towards[1])))
        return
    for k, (E, other) in enumerate(((E1, E2), (E2, E1))[: rolls.wheels]):
        z, r = of.teeth[k], 0.5 * of.module * abs(of.teeth[k])
        apart = p2 - p1 if k == 0 else p1 - p2
        if rolls.touch == "straight":
            apart = apart - (apart @ other[:, 0]) * other[:, 0]
        if rolls.opposite and z > 0 > of.teeth[1 - k]:
            apart = -apart  # a pinion in a wheel with internal teeth meshes on the side away from the axis of the wheel
        towards = E.T @ (other[:, 0] if cones else apart)
        width = min(FACE * of.module, THIN * r) if toothed else THIN * r
        if not toothed:
            yield k, cylinder(r, width)
            continue
        tooth = float(np.arctan2(towards[2], towards[1])) + (np.pi / abs(z) if k else 0.0)
        reach = _reach(E1[:, 0], E2[:, 0], of.module, of.teeth, k) if cones else 0.0
        yield k, rim(r, abs(round(z)), of.module, width, z < 0 and rolls.opposite, reach, tooth)


def _reach(a: np.ndarray, b: np.ndarray, module: float, teeth: tuple[float, float], k: int) -> float:
    """Distance of a bevel wheel's middle from the intersection of the axes."""
    sine, cosine = float(np.linalg.norm(np.cross(a, b))), float(a @ b)
    mine, other = 0.5 * module * teeth[k], 0.5 * module * teeth[1 - k]
    return (other + mine * cosine) / sine


def rim(radius: float, teeth: int, module: float, width: float, inside: bool, reach: float, angle: float) -> Mesh:
    """A toothed rim about x, m. reach: distance of the middle from the tip of a cone (0 if there is no cone). angle: angle of the
    middle of a tooth, from y towards z."""
    pitch = 2 * np.pi / teeth
    sign = -1.0 if inside else 1.0
    turns = np.array([angle + pitch * (n + s) for n in range(teeth) for s, _ in STATIONS])
    tips = np.array([radius + sign * h * module for _ in range(teeth) for _, h in STATIONS])
    base = radius + 3 * module if inside else max(radius * (1 - RIM), radius - 6 * module)
    count, outlines = len(turns), []
    for x in (-0.5 * width, 0.5 * width):
        scale = (reach + x) / reach if reach else 1.0
        for r in (np.full(count, base), tips):
            outlines.append(np.column_stack([np.full(count, reach + x), scale * r * np.cos(turns), scale * r * np.sin(turns)]))
    return ring(outlines, inside)
