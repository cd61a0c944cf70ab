"""The drawing of a scene: bodies as meshes, joints with their pins, and the places of contacts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import ContactElement
from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.elements.contact.journal import LENGTHS
from trunnion.elements.joints import REGISTRY
from trunnion.plots.geometry import meshes
from trunnion.plots.geometry.belts_and_brake_bands import cage, straps
from trunnion.plots.geometry.cams import cams
from trunnion.plots.geometry.contact_marks import ContactMark, Patch
from trunnion.plots.geometry.gear_wheels import wheels
from trunnion.plots.geometry.meshes import SORTED, Grain, Mesh
from trunnion.plots.geometry.slots import slots
from trunnion.plots.style.palette import BODIES
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.body_references import GROUND, body_of, point_of
from trunnion.scene.queries.joint_contact_elements import sizes_given, touching
from trunnion.scene.queries.packed_surfaces import unpacked
from trunnion.system.construction.joint_frames import frame, matrix
from trunnion.system.construction.load_builder import as_joint

ON_GROUND = -1
RUBBER = 0.05
"""Radius of a drawn bushing, divided by the mechanism's length."""
CAGE, THIN = 0.07, 0.008
"""CAGE: radius of the circles that show the place of a load. THIN: thickness of their lines. Both are divided by the mechanism's
length."""
STOUT = 12.0
"""Largest drawn length of a pin without sizes, in thicknesses of the thinner body."""

Place = sm.Drag | sm.Field | sm.PointGravity
"""Loads whose point of action is drawn."""
RODS = tuple(k.name for k in REGISTRY.values() if k.keeps_distance)
"""Types of joints that are drawn as rods."""


@dataclass(frozen=True)
class Part:
    """A body, with its mesh and its named points, relative to the mass centre and in the axes of the body."""

    name: str
    color: str
    mesh: Mesh
    points: dict[str, np.ndarray]


@dataclass(frozen=True)
class JointMark:
    """A joint or bushing: its parts (−1: ground), and points and frames (columns e1, e2, e3) on the two parts, inboard first.

    side: 0 if the inboard part carries the pin, 1 if the outboard part carries it. pins: (part, mesh in that part's axes).
    """

    name: str
    type: str
    parts: tuple[int, int]
    points: tuple[np.ndarray, np.ndarray]
    frames: tuple[np.ndarray, np.ndarray]
    side: int
    pins: tuple[tuple[int, Mesh], ...] = ()
    contacts: tuple[ContactMark, ...] = ()


Ends = tuple[tuple[int, np.ndarray], ...]
"""The two ends of a spring or rod: (part, point relative to the part's mass centre)."""


@dataclass(frozen=True)
class Scenery:
    """All parts, joints, springs and rods of a scene. size: length of a typical body, m. up: unit vector against gravity."""

    parts: tuple[Part, ...]
    joints: tuple[JointMark, ...]
    size: float
    up: np.ndarray
    springs: tuple[Ends, ...] = ()
    rods: tuple[Ends, ...] = ()


def scenery(scene: sm.Scene, grain: Grain = SORTED) -> Scenery:
    """The drawing of a scene without motion. grain: fineness of the drawn shapes."""
    index = {GROUND: ON_GROUND, **{name: i for i, name in enumerate(scene.bodies)}}
    size = _size(scene)
    rolling = [*wheels(scene), *cams(scene), *slots(scene)]
    rims = [[w.mesh for w in rolling if w.body == name] for name in scene.bodies]
    parts = tuple(_part(scene, name, i, size, rims[i], grain) for i, name in enumerate(scene.bodies))
    marks = [_joint(scene, name, j, index, size, grain) for name, j in scene.joints.items()]
    marks += [_bushing(scene, name, f, index, size, grain) for name, f in scene.forces.items() if isinstance(f, sm.Bushing)]
    marks += [_place(scene, name, f, index, size) for name, f in scene.forces.items() if isinstance(f, Place)]
    fixed = {m.name: tuple((ON_GROUND, w.mesh) for w in rolling if w.body == GROUND and w.pair == m.name) for m in marks}
    for name, body, mesh in straps(scene):
        fixed[name] += ((index[body], meshes.placed(mesh, np.eye(3), _from_center(scene, body, (0.0, 0.0, 0.0)))),)
    joints = tuple(replace(m, pins=m.pins + fixed[m.name]) for m in marks)
    g = np.array(scene.gravity, float)
    up = -g / np.linalg.norm(g) if np.any(g) else np.array([0.0, 0.0, 1.0])
    springs = [f.between for f in scene.forces.values() if isinstance(f, sm.SpringDamper)]
    coils = tuple(tuple((index[body_of(e)], _point(scene, e)) for e in s) for s in springs)
    rods = tuple(tuple(zip(m.parts, m.points, strict=True)) for m in joints if m.type in RODS)
    return Scenery(parts, joints, size, up, coils, rods)


def _attached(scene: sm.Scene, body: str) -> list[np.ndarray]:
    """Joint points of a body, relative to its mass centre."""
    sides = [s for j in scene.joints.values() for s in sides_of(scene, j)]
    return [_from_center(scene, body, s.point) for s in sides if s.body == body]


def _point(scene: sm.Scene, end: str) -> np.ndarray:
    """The point of a spring's end, relative to the body's mass centre, in the body's axes."""
    return _from_center(scene, *point_of(scene, end))


def _from_center(scene: sm.Scene, body: str, p: tuple[float, float, float]) -> np.ndarray:
    """A point of a body relative to its mass centre (for the ground: to the origin), in the body's axes."""
    center = (0.0, 0.0, 0.0) if body == GROUND else scene.bodies[body].center
    return np.array(p, float) - np.array(center, float)


def _size(scene: sm.Scene) -> float:
    """Median extent of the bodies, m."""
    sizes = []
    for name, b in scene.bodies.items():
        spots = [np.zeros(3), *_attached(scene, name), *(np.array(p) - np.array(b.center) for p in b.points.values())]
        sizes.append(max([float(np.linalg.norm(p - q)) for p in spots for q in spots] + [max(_extents(b))]))
    return float(np.median([s for s in sizes if s > 0] or [1.0]))


def _extents(b: sm.Body) -> tuple[float, ...]:
    """Edges of the box around a body's shape, m; 0 for a body without shape."""
    if b.surface is not None:
        return tuple(map(float, np.ptp(np.array(unpacked(b.surface)[0]), axis=0)))
    if b.box is not None:
        return b.box
    if b.cylinder is not None:
        return b.cylinder.length, 2 * b.cylinder.radius
    return (2 * b.sphere if b.sphere is not None else 0.0,)


def _symbol(scene: sm.Scene, bodies: tuple[str, str], size: float) -> float:
    """The length, m, of a drawn pin whose sizes are unknown. The length follows from the size of the mechanism and the thickness of
    the thinner body."""
    thin = [min(_extents(scene.bodies[name])) for name in bodies if name != GROUND]
    return min([size, *(STOUT * t for t in thin if t > 0)])


def _part(scene: sm.Scene, name: str, i: int, size: float, rims: list[Mesh], grain: Grain) -> Part:
    b = scene.bodies[name]
    around = [meshes.placed(rim, np.eye(3), -np.array(b.center, float)) for rim in rims]
    points = {n: np.array(p, float) - np.array(b.center, float) for n, p in b.points.items()}
    shape = meshes.join([_mesh(scene, name, b, points, size, grain), *around])
    return Part(name, b.color or BODIES[i % len(BODIES)], shape, points)


def _mesh(scene: sm.Scene, name: str, b: sm.Body, points: dict[str, np.ndarray], size: float, grain: Grain) -> Mesh:
    """The surface or the shape of a body. A body without surface and shape is drawn as rods from its mass centre to its joints and
    named points."""
    if b.surface is not None:
        spots, faces = unpacked(b.surface)
        return meshes.surface(np.array(spots) - np.array(b.center, float), np.array(faces))
    if b.box is not None:
        return meshes.box(*b.box, grain)
    if b.cylinder is not None:
        return meshes.cylinder(b.cylinder.radius, b.cylinder.length, "xyz".index(b.cylinder.axis[-1]), grain)
    if b.sphere is not None:
        return meshes.sphere(b.sphere, grain.around)
    joints = _attached(scene, name)
    thick = 0.015 * size
    ends = _distinct([*joints, *points.values()], thick)
    straight = len(ends) == 2 and not any(np.allclose(p, 0) for p in ends)
    pairs = [(ends[0], ends[1])] if straight and _collinear(*ends) else [(np.zeros(3), p) for p in ends]
    rods = [meshes.rod(p, q, thick) for p, q in pairs if np.linalg.norm(q - p) > thick]
    return meshes.join([*rods, meshes.sphere(2.2 * thick, grain.around // 2)])


def _collinear(p: np.ndarray, q: np.ndarray) -> bool:
    return bool(np.linalg.norm(np.cross(p, q)) < 1e-6 * np.linalg.norm(p) * np.linalg.norm(q))


def _distinct(points: list[np.ndarray], apart: float) -> list[np.ndarray]:
    out: list[np.ndarray] = []
    for p in points:
        if all(np.linalg.norm(p - q) > apart for q in out):
            out.append(p)
    return out


def _joint(scene: sm.Scene, name: str, j: sm.Joint, index: dict[str, int], size: float, grain: Grain) -> JointMark:
    a, b = sides_of(scene, j)
    parts = (index[a.body], index[b.body])
    points = (_from_center(scene, a.body, a.point), _from_center(scene, b.body, b.point))
    frames = (matrix(frame(a.axis, a.reference)), matrix(frame(b.axis, b.reference)))
    bare = JointMark(name, j.type, parts, points, frames, int(j.pin == "outboard"))
    pins = tuple(_pins(bare, j, _symbol(scene, (a.body, b.body), size), grain))
    return replace(bare, pins=pins, contacts=tuple(_contacts(bare, j)))


def _bushing(scene: sm.Scene, name: str, f: sm.Bushing, index: dict[str, int], size: float, grain: Grain) -> JointMark:
    """A bushing: a sleeve of rubber on its first part, along e1."""
    free = _joint(scene, name, as_joint(f), index, size, grain)
    thick = RUBBER * _symbol(scene, (body_of(f.between[0]), body_of(f.between[1])), size)
    sleeve = meshes.placed(meshes.cylinder(thick, 2 * thick, 0, grain), free.frames[0], free.points[0])
    return replace(free, type=f.type, pins=((free.parts[0], sleeve),))


def _place(scene: sm.Scene, name: str, f: Place, index: dict[str, int], size: float) -> JointMark:
    """The point of a load that depends on speed or position, as circles. A point of attraction has circles, too."""
    ends = [(index[body_of(e)], _point(scene, e)) for e in ([f.on, f.towards] if isinstance(f, sm.PointGravity) else [f.on])]
    pins = tuple((part, meshes.placed(cage(CAGE * size, THIN * size), np.eye(3), p)) for part, p in ends)
    (part, p), (last, q) = ends[0], ends[-1]
    return JointMark(name, f.type, (part, last), (p, q), (np.eye(3), np.eye(3)), 0, pins)


def _sizes(element: ContactElement, f: sm.Friction | None, size: float) -> dict[str, float]:
    """Sizes of an element by label, m. A size that the scene does not give is a fraction of the mechanism's size."""
    given = sizes_given(f, element) if f is not None else {}
    usual = [s for s in element.sizes if f is None or not s.ends]  # omit sizes that apply only to another placement of the contacts
    return {label: s.drawn * size for s in usual for label in s.labels} | given


def _pins(m: JointMark, j: sm.Joint, size: float, grain: Grain) -> Iterator[tuple[int, Mesh]]:
    """(part, mesh) of each piece of a joint's pin. The pin has its true size if the keys of friction give the size. Otherwise a
    small symbol is drawn.

    A joint of a type without friction is drawn with the pin of a journal.
    """
    kind = REGISTRY[j.type]
    if kind.nv in (0, 6):
        return
    usual = CONTACTS[kind.friction] if kind.friction else next(iter(CONTACTS.values()))
    own = touching(j) if j.friction is not None else None
    element, rub = (own, j.friction) if own is not None and own.count else (usual, None)
    for solid in element.pins(_sizes(element, rub, size)):
        side = _side(m, solid.on if rub is not None or element.ideal == "pin" else element.ideal)
        yield (
            m.parts[side],
            meshes.placed(meshes.solid(solid.shape, solid.sizes, solid.axis, grain), m.frames[side], m.points[side]),
        )


def _side(m: JointMark, on: str) -> int:
    """The part that carries the pin: 0 inboard, 1 outboard."""
    return m.side if on == "pin" else ("inboard", "outboard").index(on)


def _contacts(m: JointMark, j: sm.Joint) -> Iterator[ContactMark]:
    """The places of joint j's contacts on its pin (notation, "Reactions, friction and contacts")."""
    if j.friction is None:
        return
    element = touching(j)
    assert element is not None
    sizes = _sizes(element, j.friction, 0.0)
    solids = element.pins(sizes)
    for i, p in enumerate(element.places(sizes)):
        names = f"{m.name}.contact[{i + 1}]", f"{m.name}.friction.state[{p.pair + 1}]"
        patch = Patch.at(p, solids[min(p.pair, len(solids) - 1)].shape)
        if j.ends == OVERLAP:
            inner, outer = (sizes[s.name] for s in LENGTHS)
            follows = (f"{m.name}.q[1]", inner, outer, float(np.sign(p.along)))
            yield ContactMark(*names, m.parts[0], m.points[0], p.arm, m.frames[0][:, p.axis], patch, follows)
            continue
        side = _side(m, p.on) if j.ends is None else _side(m, j.ends)
        axis = m.frames[side][:, p.axis]
        yield ContactMark(*names, m.parts[side], m.points[side] + p.along * axis, p.arm, axis, patch)
