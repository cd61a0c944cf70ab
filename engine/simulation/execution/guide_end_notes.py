"""Notes about sliding parts whose contacts leave their guide during a run (theory, "Sleeve")."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from trunnion.elements.joints.cylindrical import CYLINDRICAL
from trunnion.elements.joints.prismatic import PRISMATIC
from trunnion.kernel.interface.output_columns import Column
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.queries.body_poses_and_joint_sides import JointSide, sides_of, vector
from trunnion.scene.queries.part_extents import extent

SLIDING = (PRISMATIC.name, CYLINDRICAL.name)


def guide_end_notes(scene: Scene, columns: Sequence[Column], data: np.ndarray) -> list[str]:
    """A note for every sliding joint with a contact that leaves the other part, with the first time. data: rows of a run, with the
    time before the columns. Joints without columns of position and speed along the axis are not examined. Between rows, the
    position is the cubic polynomial that has the positions and speeds of the rows."""
    sliding = {name: j for name, j in scene.joints.items() if j.type in SLIDING}
    places = {c.name: 1 + i for i, c in enumerate(columns)} if sliding else {}
    notes = []
    for name, j in sliding.items():
        q, speed = (places.get(f"{name}.{x}[1]") for x in ("q", "qd"))
        span = covered(scene, j) if q is not None and speed is not None else None
        if span is None:
            continue
        time = _first_outside(data[:, 0], data[:, q], data[:, speed], *span[:2])
        if time is not None:
            notes.append(f"{name}: from t = {time:.10g} s a contact at the ends of {span[2]} is beyond {span[3]}, which ends there")
    return notes


def covered(scene: Scene, j: Joint) -> tuple[float, float, str, str] | None:
    """(range of the position, m; part with the contacts; other part). In this range, both contacts of a sliding joint are on the
    other part. None if the scene does not give the distance of the contacts or the other part's length."""
    half = j.friction.half_length if j.friction is not None else None
    if not isinstance(half, float) or j.ends == "overlap":
        return None
    inboard = (j.ends or j.pin) == "inboard"
    carrier, other = sides_of(scene, j) if inboard else sides_of(scene, j)[::-1]
    length = extent(scene, other)
    if not math.isfinite(length) or length < 2 * half:
        return None
    middle, play = _shape_middle(scene, other), 0.5 * length - half
    middle = -middle if inboard else middle
    return middle - play, middle + play, carrier.body, other.body


def _shape_middle(scene: Scene, side: JointSide) -> float:
    """Position of the middle of a part's shape along the joint's axis, from the joint's point, m."""
    assert side.axis is not None
    axis, centre = np.array(vector(side.axis)), np.array([float(x) for x in scene.bodies[side.body].center])
    return float(axis @ (centre - np.array(side.point, float)) / np.linalg.norm(axis))


def _first_outside(time: np.ndarray, q: np.ndarray, speed: np.ndarray, low: float, high: float) -> float | None:
    """The first time at which q leaves the range low…high. None if q never leaves the range, or starts outside it."""
    if not len(q) or not low <= q[0] <= high:
        return None
    steps = np.diff(time)
    # Each cubic lies between the least and the largest of its four Bernstein coefficients.
    around = np.stack([q[:-1], q[:-1] + steps * speed[:-1] / 3, q[1:] - steps * speed[1:] / 3, q[1:]])
    for i in np.flatnonzero((steps > 0.0) & ((around.max(axis=0) > high) | (around.min(axis=0) < low))):
        h = steps[i]
        a, b, va, vb = q[i], q[i + 1], h * speed[i], h * speed[i + 1]
        cubic = np.array([2 * (a - b) + va + vb, 3 * (b - a) - 2 * va - vb, va, a])
        ways = [_least_root(cubic - np.array([0, 0, 0, end]), sense) for end, sense in ((high, 1.0), (low, -1.0))]
        if found := [x for x in ways if x is not None]:
            return float(time[i] + h * min(found))
    return None


def _least_root(cubic: np.ndarray, sense: float) -> float | None:
    """The least root in 0…1 at which a cubic polynomial rises (sense 1) or falls (sense −1) through zero; None without one."""
    if sense * np.polyval(cubic, 0.0) > 0.0:
        return 0.0
    roots = np.roots(cubic)
    real = [float(r.real) for r in roots if abs(r.imag) < 1e-12 and 0.0 <= r.real <= 1.0]
    rising = [r for r in real if sense * np.polyval(np.polyder(cubic), r) > 0.0]
    return min(rising, default=None)
