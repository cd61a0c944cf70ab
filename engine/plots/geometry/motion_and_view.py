"""Motion of the drawn parts (positions, orientations, rails), extent of the motion, first view, and scales of arrows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.plots.geometry.mechanism_geometry import ON_GROUND, Scenery
from trunnion.simulation.results.result import Result

NEEDED = ("*.position[*]", "*.orientation[*]", "*.q[*]", "*.contact[*].*", "*.friction.*")
"""Patterns of the columns that an animation needs."""
SAMPLES = 60
"""Largest number of rows from which the extent of a motion is measured."""
VIEW = (24.0, 16.0)
"""Angles of the viewer, degrees: to the left of the motion's front, and above the horizontal."""


@dataclass(frozen=True)
class Motion:
    """The motion of all parts. positions: mass centres (rows × parts × 3). turns: unit quaternions, scalar first (rows × parts ×
    4)."""

    positions: np.ndarray
    turns: np.ndarray

    def pose(self, part: int, row: int) -> tuple[np.ndarray, np.ndarray]:
        """(position, rotation matrix) of a part; −1 is the ground."""
        if part == ON_GROUND:
            return np.zeros(3), np.eye(3)
        return self.positions[row, part], rotation(self.turns[row, part])


def rotation(e: np.ndarray) -> np.ndarray:
    """3×3 matrix of a quaternion (scalar first)."""
    from trunnion.elements.joints.joint_kind import of_quaternion

    return np.array(of_quaternion([float(x) for x in e]))


def motion(result: Result, parts: list[str]) -> Motion:
    """Positions and orientations of the parts. SceneError when the result lacks their columns or has no rows."""
    missing = [p for p in parts if f"{p}.position[1]" not in result or f"{p}.orientation[1]" not in result]
    if missing:
        what = f"the result has no positions and orientations of {', '.join(missing[:5])}"
        raise SceneError([Problem("outputs", what, f"add the patterns {' '.join(NEEDED[:2])}")])
    if not len(result):
        raise SceneError([Problem("result", "the result has no rows", "see its outcome")])
    positions = np.stack([_columns(result, f"{p}.position", 3) for p in parts], axis=1)
    turns = np.stack([_columns(result, f"{p}.orientation", 4) for p in parts], axis=1)
    if not np.all(np.linalg.norm(turns, axis=2) > 0.5):
        raise SceneError([Problem("result", "there are rows without a position: the run did not start", "see its outcome")])
    return Motion(positions, turns)


def _columns(result: Result, name: str, n: int) -> np.ndarray:
    return np.column_stack([result[f"{name}[{k + 1}]"] for k in range(n)])


def rails(result: Result, scene: Scenery) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """(inboard part, end, end) of the line along which each sliding joint travels."""
    out = []
    for j in scene.joints:
        column = f"{j.name}.q[1]"
        along = REGISTRY[j.type].slides_along if j.type in REGISTRY else -1
        if along < 0 or column not in result:
            continue
        q = result[column]
        q = q[np.isfinite(q)]
        margin = 0.3 * scene.size
        e, p = j.frames[0][:, along], j.points[0]
        out.append((j.parts[0], p + (float(q.min()) - margin) * e, p + (float(q.max()) + margin) * e))
    return out


def _swept(scene: Scenery, moved: Motion) -> Iterator[tuple[int, np.ndarray]]:
    """(row, vertices of all parts in the world's axes) for a sample of rows."""
    for row in map(int, np.unique(np.linspace(0, len(moved.positions) - 1, SAMPLES).astype(int))):
        poses = [moved.pose(i, row) for i in range(len(scene.parts))]
        yield row, np.concatenate([part.mesh.vertices @ r.T + p for part, (p, r) in zip(scene.parts, poses, strict=True)])


def bounds(scene: Scenery, moved: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest coordinates of all parts over a sample of rows."""
    ends = [(spots.min(axis=0), spots.max(axis=0)) for _, spots in _swept(scene, moved)]
    return np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)


def reach(scene: Scenery, moved: Motion, view: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(middle of the motion in the world's axes; width and height of the motion in a view's axes; width and height of the
    mechanism).

    The mechanism's width and height are measured about the mean of its mass centres. Width and height are the largest values over a
    sample of rows.
    """
    low, high, near = np.full(3, np.inf), np.full(3, -np.inf), np.zeros(3)
    lines = (*scene.springs, *scene.rods)
    for row, shapes in _swept(scene, moved):
        ends = [r @ point + p for s in lines for (p, r), point in ((moved.pose(part, row), point) for part, point in s)]
        spots = np.concatenate([shapes, np.reshape(ends, (-1, 3))]) @ view.T
        low, high = np.minimum(low, spots.min(axis=0)), np.maximum(high, spots.max(axis=0))
        near = np.maximum(near, 2 * np.abs(spots - moved.positions[row].mean(axis=0) @ view.T).max(axis=0))
    return (low + high) / 2 @ view, np.maximum(high - low, 1e-9)[:2], np.maximum(near, 1e-9)[:2]


def first_view(up: np.ndarray, low: np.ndarray, high: np.ndarray, aside: tuple[float, float] = VIEW) -> np.ndarray:
    """The view as a 3×3 matrix whose rows point right, up and towards the viewer.

    The viewer looks along the horizontal axis in which the motion is thinnest, turned by the angles ``aside`` (``VIEW``).
    """
    level = [k for k in range(3) if abs(up[k]) < 0.9]
    thin = min(level, key=lambda k: high[k] - low[k])
    toward = np.eye(3)[thin] - up[thin] * up
    toward /= np.linalg.norm(toward)
    right = np.cross(up, toward)
    if right[int(np.argmax(np.abs(right)))] < 0:
        toward, right = -toward, -right
    a, e = np.radians(aside)
    toward, right = np.cos(a) * toward - np.sin(a) * right, np.cos(a) * right + np.sin(a) * toward
    return np.array([right, np.cos(e) * up - np.sin(e) * toward, np.cos(e) * toward + np.sin(e) * up])


@dataclass(frozen=True)
class Framing:
    """View and position of an animation. view: result of ``first_view``; centre, wide, near: results of ``reach``.

    follows: whether the picture moves with the mechanism, because the motion is much wider than the mechanism. floor: height of the
    ground, m. """

    view: np.ndarray
    centre: np.ndarray
    wide: np.ndarray
    near: np.ndarray
    follows: bool
    floor: float


def frame_motion(scene: Scenery, moved: Motion) -> Framing:
    """The rectangle of the view that shows the whole motion."""
    low, high = bounds(scene, moved)
    view = first_view(scene.up, low, high)
    centre, wide, near = reach(scene, moved, view)
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)
    floor = float((corners @ scene.up).min() - 0.08 * scene.size)
    return Framing(view, centre, wide, near, bool(max(wide) > 3.0 * max(near)), floor)


def arrow_scale(result: Result, scene: Scenery) -> float:
    """Length of arrows per force, m/N. A force at the 98th percentile has an arrow 0.45 times as long as a typical body. Without
    contacts, the scale is 0."""
    top = _largest_usual([force for _, force in _normal_forces(result, scene)])
    return 0.45 * scene.size / top if top > 0 else 0.0


def pressure_scale(result: Result, scene: Scenery) -> float:
    """The 98th percentile, Pa, of the nominal pressures (normal force per projected area). Without contacts, the result is 0."""
    return max(0.0, _largest_usual([force / area for area, force in _normal_forces(result, scene) if area > 0]))


def _normal_forces(result: Result, scene: Scenery) -> list[tuple[float, np.ndarray]]:
    """(projected area, normal force in all rows) of each contact with a column."""
    marks = {f"{c.columns}.normal_force": c for j in scene.joints for c in j.contacts}
    return [(c.patch.area, result[name]) for name, c in marks.items() if name in result]


def _largest_usual(values: list[np.ndarray]) -> float:
    return float(np.nanpercentile(np.concatenate(values), 98)) if values else 0.0


def round_force(scale: float, size: float) -> float:
    """A force of 1, 2 or 5 times a power of ten whose arrow is about a third of a body long, N."""
    if scale <= 0:
        return 0.0
    wanted = 0.35 * size / scale
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(k * power for k in (1, 2, 5) if k * power <= wanted * 1.0001))
