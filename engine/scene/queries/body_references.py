"""References from one part of a scene to another by name: "body", "body.point", joint sides."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.scene import (
    Bushing,
    Direction,
    Drag,
    Field,
    Force,
    Joint,
    PointGravity,
    Scene,
    Side,
    SpringDamper,
    Torque,
)
from trunnion.scene.findings.findings_and_paths import Path

GROUND = "ground"


@dataclass(frozen=True)
class Reference:
    """A reference written at ``path`` to a body and a point ('' for none); ``use`` is side, load or end."""

    path: Path
    body: str
    point: str
    use: str


def split(text: str) -> tuple[str, str]:
    """("body", "point") of "body.point"; the point is '' in "body"."""
    body, _, point = text.partition(".")
    return body, point


def body_of(side: str | Side) -> str:
    """Name of the body of a joint side."""
    return side.body if isinstance(side, Side) else split(side)[0]


def named_point(side: str | Side) -> str:
    """Name of the point of a joint side or a load; '' if no point is named."""
    point = side.point if isinstance(side, Side) else split(side)[1]
    return point if isinstance(point, str) else ""


def point_of(scene: Scene, side: str | Side) -> tuple[str, tuple[float, float, float]]:
    """(body, point in the body's frame, m) of a joint side or of "body.point"; the default point is the frame's origin."""
    name = named_point(side)
    body, x = body_of(side), (0.0, 0.0, 0.0)
    if name:
        x = points_of(scene, body)[name]
    elif isinstance(side, Side) and not isinstance(side.point, str):
        x = side.point
    return body, (float(x[0]), float(x[1]), float(x[2]))


def axes_of(j: Joint, side: str | Side) -> tuple[Direction | None, Direction | None]:
    """(axis, reference) of a joint side: the side's own, else those of the joint."""
    return own_axes(side, j.axis, j.reference)


def own_axes(side: str | Side, axis: Direction | None, reference: Direction | None) -> tuple[Direction | None, Direction | None]:
    """(axis, reference) of a joint side: the side's own, else the given ones."""
    if isinstance(side, str):
        return axis, reference
    return (axis if side.axis is None else side.axis), (reference if side.reference is None else side.reference)


def references(scene: Scene) -> Iterator[Reference]:
    """All references of a scene: joints, then forces, in the order of the scene."""
    for name, j in scene.joints.items():
        yield from _sides(name, j)
    for name, f in scene.forces.items():
        at: Path = ("forces", name)
        if isinstance(f, Force | Torque | Drag | PointGravity | Field):
            yield Reference((*at, "on"), *split(f.on), "load")
        if isinstance(f, PointGravity):
            yield Reference((*at, "towards"), *split(f.towards), "end")
        elif isinstance(f, SpringDamper | Bushing):
            for i, end in enumerate(f.between):
                yield Reference((*at, "between", i), *split(end), "end")


def _sides(name: str, j: Joint) -> Iterator[Reference]:
    if isinstance(j.at, str):
        yield Reference(("joints", name, "at"), *split(j.at), "side")
    for key, side in (("inboard", j.inboard), ("outboard", j.outboard)):
        at: Path = ("joints", name, key)
        if isinstance(side, Side):
            yield Reference((*at, "body"), side.body, "", "side")
            if isinstance(side.point, str):
                yield Reference((*at, "point"), side.body, side.point, "side")
        else:
            yield Reference(at, *split(side), "side")


def points_of(scene: Scene, body: str) -> dict[str, tuple[float, float, float]]:
    """The named points of a body or of the ground, m; an unknown body has none."""
    if body == GROUND:
        return scene.ground.points
    return scene.bodies[body].points if body in scene.bodies else {}


def is_known(scene: Scene, side: str | Side) -> bool:
    """Whether the body and the point that a side names exist. ``checks.names`` reports missing bodies and points."""
    body, point = body_of(side), named_point(side)
    return (body == GROUND or body in scene.bodies) and (not point or point in points_of(scene, body))
