"""Poses of placed bodies, and the joint points and frames that follow from these poses."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.bodies import Turn
from trunnion.scene.data_classes.scene import Body, Direction, Joint, Scene, Side
from trunnion.scene.queries.body_references import GROUND, axes_of, body_of, named_point, own_axes, point_of, points_of, split

Triple = tuple[float, float, float]
Rotation = tuple[Triple, Triple, Triple]
"""Rows of a rotation matrix that maps components in body axes to components in world axes."""
UPRIGHT: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NAMES = {"x": UPRIGHT[0], "y": UPRIGHT[1], "z": UPRIGHT[2]}
ROUNDING = 1e-15
"""If the magnitude of a sum is below this fraction of its largest term, the sum is rounding error and is set to zero."""


@dataclass(frozen=True)
class Pose:
    """Pose of a body's frame: origin in the world, m, and rotation matrix from body axes to world axes."""

    origin: Triple
    rotation: Rotation

    def world(self, p: Sequence[float]) -> Triple:
        """World coordinates, m, of a point given in the body's frame."""
        rows = zip(self.origin, self.rotation, strict=True)
        x, y, z = (_sum(o, *(r * c for r, c in zip(row, p, strict=True))) for o, row in rows)
        return x, y, z

    def local(self, p: Sequence[float]) -> Triple:
        """Coordinates in the body's frame, m, of a point given in the world."""
        return self.turned_back([_sum(c, -o) for c, o in zip(p, self.origin, strict=True)])

    def turned_back(self, d: Sequence[float]) -> Triple:
        """Components in body axes of a direction given in world axes."""
        x, y, z = (_sum(*(self.rotation[i][k] * d[i] for i in range(3))) for k in range(3))
        return x, y, z


STILL = Pose((0.0, 0.0, 0.0), UPRIGHT)


def _sum(*terms: float) -> float:
    total = math.fsum(terms)
    return 0.0 if abs(total) <= ROUNDING * max(abs(t) for t in terms) else total


def vector(d: Direction) -> Triple:
    """The three components of a direction, not normalised."""
    if isinstance(d, str):
        x, y, z = NAMES[d[-1]]
        return (0.0 - x, 0.0 - y, 0.0 - z) if d[0] == "-" else (x, y, z)
    return float(d[0]), float(d[1]), float(d[2])


def turns(b: Body) -> tuple[Turn, ...]:
    """The turns of a body, in the order in which they are applied."""
    return b.orientation if isinstance(b.orientation, tuple) else () if b.orientation is None else (b.orientation,)


def pose_of(scene: Scene, body: str) -> Pose | None:
    """Pose of a placed body or of the ground; None for a body without position."""
    if body == GROUND:
        return STILL
    b = scene.bodies.get(body)
    if b is None or b.position is None:
        return None
    rotation = UPRIGHT
    for t in turns(b):
        rotation = _product(_rotation(t, rotation), rotation)
    return Pose((float(b.position[0]), float(b.position[1]), float(b.position[2])), rotation)


def _rotation(t: Turn, before: Rotation) -> Rotation:
    """The rotation matrix of a turn; ``before`` is the orientation of the body before the turn."""
    axis = unit(vector(t.axis))
    if t.towards is None:
        angle = float(t.angle or 0.0)
        return _about(axis, _clean(math.cos(angle)), _clean(math.sin(angle)))
    now = tuple(_sum(*(r * a for r, a in zip(row, axis, strict=True))) for row in before)
    goal = unit(vector(t.towards))
    cosine, across = _sum(*(a * b for a, b in zip(now, goal, strict=True))), cross(now, goal)
    sine = math.hypot(*across)
    if sine == 0.0:  # the axis is parallel to its new direction: no rotation, or half a turn about any normal axis
        across = cross(now, min(NAMES.values(), key=lambda e: abs(sum(a * b for a, b in zip(now, e, strict=True)))))
        return UPRIGHT if cosine > 0.0 else _about(unit(across), -1.0, 0.0)
    return _about(unit(across), cosine, sine)


def _about(n: Triple, cosine: float, sine: float) -> Rotation:
    """Rotation matrix about the unit vector n, by Rodrigues' formula."""
    (x, y, z), d = n, 1.0 - cosine
    return (
        (_sum(cosine, d * x * x), _sum(d * x * y, -sine * z), _sum(d * x * z, sine * y)),
        (_sum(d * x * y, sine * z), _sum(cosine, d * y * y), _sum(d * y * z, -sine * x)),
        (_sum(d * x * z, -sine * y), _sum(d * y * z, sine * x), _sum(cosine, d * z * z)),
    )


def _clean(x: float) -> float:
    """A cosine or sine without the rounding error of the angle. For example, cos(90 deg) is 0."""
    return 0.0 if abs(x) < ROUNDING else x


def _product(a: Rotation, b: Rotation) -> Rotation:
    rows = [[_sum(*(a[i][k] * b[k][j] for k in range(3))) for j in range(3)] for i in range(3)]
    return (rows[0][0], rows[0][1], rows[0][2]), (rows[1][0], rows[1][1], rows[1][2]), (rows[2][0], rows[2][1], rows[2][2])


def cross(a: Sequence[float], b: Sequence[float]) -> Triple:
    return _sum(a[1] * b[2], -a[2] * b[1]), _sum(a[2] * b[0], -a[0] * b[2]), _sum(a[0] * b[1], -a[1] * b[0])


def unit(v: Sequence[float]) -> Triple:
    big = max(abs(c) for c in v)
    x, y, z = (c / big for c in v) if big else (1.0, 0.0, 0.0)
    size = math.hypot(x, y, z)
    return x / size, y / size, z / size


# -- joints -------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class JointSide:
    """One side of a joint in its body's frame, with the point in m. ``named`` is the path of the body's named point at this
    position, or ''."""

    body: str
    point: Triple
    named: str
    axis: Direction | None
    reference: Direction | None


def poses_of(scene: Scene, j: Joint) -> tuple[Pose, Pose] | None:
    """Poses of the two parts of a joint; None when a part is not placed."""
    sides = body_of(j.inboard), body_of(j.outboard)
    a, b = (pose_of(scene, s) for s in sides)
    return (a, b) if a is not None and b is not None else None


def sides_of(scene: Scene, j: Joint) -> tuple[JointSide, JointSide]:
    """Both sides of a joint: as written in the scene or, between placed bodies, computed from their poses."""
    poses = poses_of(scene, j)
    sides = (j.inboard, j.outboard)
    if poses is None:
        a, b = (JointSide(*point_of(scene, s), _path(s), *axes_of(j, s)) for s in sides)
        return a, b
    spot = None if REGISTRY[j.type].apart else place_of(scene, j, poses)
    a, b = (_found(scene, j, s, pose, spot, poses) for s, pose in zip(sides, poses, strict=True))
    return a, b


def _path(side: str | Side) -> str:
    body, point = body_of(side), named_point(side)
    return "" if not point else f"ground.points.{point}" if body == GROUND else f"bodies.{body}.points.{point}"


def has_own_point(side: str | Side) -> bool:
    """Whether a side of a joint gives its point itself."""
    return isinstance(side, Side) or bool(named_point(side))


def place_of(scene: Scene, j: Joint, poses: tuple[Pose, Pose]) -> Triple:
    """Position in the world, m, of a joint between placed parts. The position is ``at`` if given, else the point of the first side
    that names a point. If neither side names a point, the position is the frame origin of the outboard part; of the inboard part if
    the outboard part is the ground."""
    if isinstance(j.at, str):
        body, point = split(j.at)
        pose = pose_of(scene, body) or STILL
        return pose.world(points_of(scene, body).get(point, (0.0, 0.0, 0.0)))
    if j.at is not None:
        return float(j.at[0]), float(j.at[1]), float(j.at[2])
    for side, pose in zip((j.inboard, j.outboard), poses, strict=True):
        if has_own_point(side):
            return pose.world(point_of(scene, side)[1])
    return poses[0].origin if body_of(j.outboard) == GROUND else poses[1].origin


def _found(scene: Scene, j: Joint, side: str | Side, pose: Pose, spot: Triple | None, poses: tuple[Pose, Pose]) -> JointSide:
    point = point_of(scene, side)[1] if has_own_point(side) or spot is None else pose.local(spot)
    axis, reference = j.axis, j.reference
    if any(p.rotation != UPRIGHT for p in poses):
        axis, reference = _common(j)
        axis, reference = pose.turned_back(vector(axis)), pose.turned_back(vector(reference))
    return JointSide(body_of(side), point, _path(side), *own_axes(side, axis, reference))


def _common(j: Joint) -> tuple[Direction, Direction]:
    """Axis and reference of a joint in the world, with defaults that both sides share."""
    if j.axis is None:
        return "x", "y"
    if j.reference is not None:
        return j.axis, j.reference
    sizes = [abs(c) for c in vector(j.axis)]
    return j.axis, ("y", "z", "x")[sizes.index(max(sizes))]
