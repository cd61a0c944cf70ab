"""Masses of MJCF bodies, either explicit or computed from geoms, with the lower bounds in <compiler>."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers import visual_shapes
from trunnion.importers.intermediate_linkage import tensor
from trunnion.importers.mjcf.includes_and_defaults import Attributes, Model
from trunnion.importers.mjcf.mesh_solids import WAYS, MassProperties, hull, solid
from trunnion.importers.pose_matrices import Pose, least_turn, of_quaternion, pose
from trunnion.importers.triangle_mesh_files import Unreadable, triangles
from trunnion.importers.xml_reader import Element

WATER = 1000.0
"""Default density of geoms, kg/m³."""
FLAT = ("plane", "hfield")
HIDDEN = 3
"""MuJoCo hides geoms whose group is this number or higher."""
STRETCHED = ("capsule", "cylinder", "box", "ellipsoid")
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


@dataclass
class Geom:
    """A geom of a body: kind, half sizes in m, pose in the body, mass. ``corners()`` gives the triangles of a mesh (n×3×3) in the
    geom's frame. Geoms with ``group`` < ``HIDDEN`` are shown."""

    kind: str
    size: list[float]
    at: Pose
    mass: MassProperties
    corners: Callable[[], np.ndarray]
    group: float


def sum_of(parts: list[MassProperties]) -> MassProperties:
    """The sum of several masses."""
    mass = sum(p.mass for p in parts)
    if not mass:
        return MassProperties()
    center = sum((p.mass * p.center for p in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for p in parts:
        d = p.center - center
        inertia += p.inertia + p.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return MassProperties(mass, center, inertia)


def unit_solid(kind: str, s: list[float]) -> MassProperties:
    """The solid of a simple geom with half sizes s, m, about its centre."""
    if kind == "sphere":
        s = [s[0]] * 3
    if kind in ("sphere", "ellipsoid"):
        volume, squares = 4 / 3 * np.pi * s[0] * s[1] * s[2], np.square(s) / 5
    elif kind == "box":
        volume, squares = 8 * s[0] * s[1] * s[2], np.square(s) / 3
    else:
        r, h = s[0], s[1]
        ends = 4 / 3 * np.pi * r**3 if kind == "capsule" else 0.0
        body = 2 * np.pi * r * r * h
        volume = body + ends
        side = (body * r * r / 4 + ends * r * r / 5) / volume
        squares = np.array([side, side, (body * h * h / 3 + ends * (h * h + 0.75 * r * h + r * r / 5)) / volume])
    return MassProperties(float(volume), np.zeros(3), volume * (squares.sum() * np.eye(3) - np.diag(squares)))


class MassReader:
    """Reads geoms and inertias of a model."""

    def __init__(self, model: Model):
        self.model, self.found = model, model.found
        self.meshes: dict[str, tuple[Element, Attributes]] = {}
        for e in (e for e in model.entries("asset") if e.tag == "mesh"):
            said = model.attributes(e, "")
            name = said.get("name") or said.get("file", "").replace("\\", "/").rpartition("/")[2].rpartition(".")[0]
            self.meshes[name] = (e, said)
        self._solids: dict[str, MassProperties | None] = {}
        self._drawn: dict[str, np.ndarray] = {}

    # -- geoms --------------------------------------------------------------------------------------------------------------

    def geom(self, e: Element, around: str, weighs: bool) -> Geom | None:
        """A geom of a body. The geom has a mass only if ``weighs``. None for a plane or height field, and for a geom with a
        fault."""
        said = self.model.attributes(e, around)
        kind = said.get("type", "sphere")
        if kind in FLAT:
            return None
        at, size = self.pose_and_size(e, said, kind)
        group = self.found.number(e, "group", said.get("group"), 0.0)
        given = self.found.number(e, "mass", said.get("mass"), -1.0)
        density = self.found.number(e, "density", said.get("density"), WATER)
        low, high = self.model.settings.groups
        weighs = weighs and low <= group <= high and (given > 0 if "mass" in said else density > 0)
        name = e.get("name") or e.get("mesh") or kind

        def corners() -> np.ndarray:
            return self._drawn_triangles(e, said) if kind == "mesh" else np.zeros((0, 3, 3))

        if not weighs:
            return Geom(kind, size, at, MassProperties(), corners, group)
        if said.get("shellinertia") == "true" or (kind != "mesh" and "mesh" in said):
            what = "is a shell" if kind == "mesh" or "mesh" not in said else f"is a {kind} fitted to a mesh"
            self.found.add(e, name, f"{what}, whose mass is not computed", "give the body an <inertial>")
            return None
        known = len(size) == SIZES.get(kind) and min(size) > 0
        shape = self.solid(e, said) if kind == "mesh" else unit_solid(kind, size) if known else None
        if shape is None or not shape.mass > 0:
            if kind != "mesh" or shape is not None:
                sized = f"a {kind} of size {' '.join(f'{s:g}' for s in size) or 'nothing'}"
                what = sized if kind in SIZES else f"a geom of type {kind}, whose mass is not known"
                self.found.add(e, name, what, "give the body an <inertial>")
            return None
        mass = given if given > 0 else density * shape.mass
        scaled = MassProperties(mass, shape.center, shape.inertia * (mass / shape.mass))
        return Geom(kind, size, at, scaled.placed(at), corners, group)

    def _drawn_triangles(self, e: Element, said: Attributes) -> np.ndarray:
        """Triangles of a mesh for drawing. If the mesh cannot be read, the result is empty and no problem is added."""
        known, name = len(self.found.problems), said.get("mesh", "")
        if name not in self._drawn:
            found = self.corners(e, said)
            self._drawn[name] = np.zeros((0, 3, 3)) if found is None else found
        del self.found.problems[known:]
        return self._drawn[name]

    def pose_and_size(self, e: Element, said: Attributes, kind: str) -> tuple[Pose, list[float]]:
        """(pose in the body, half sizes in m) of a geom or a site."""
        size = self.found.numbers(e, "size", said.get("size", ""), (0, 1, 2, 3)) or []
        count = SIZES.get(kind, 0)
        if "fromto" not in said or kind not in STRETCHED:
            return self.model.pose(e, said), size[:count]
        ends = np.array(self.found.numbers(e, "fromto", said["fromto"], (6,)) or [0, 0, 0, 0, 0, 1.0])
        line = ends[:3] - ends[3:]
        half = float(np.linalg.norm(line)) / 2
        radius = size[0] if size else 0.0
        stretched = [radius, half] if count == 2 else [radius, radius, half]
        return pose((ends[:3] + ends[3:]) / 2, least_turn(line) if half else None), stretched

    def corners(self, e: Element, said: Attributes) -> np.ndarray | None:
        """Triangles of a geom's mesh (n×3×3) in the geom's frame, m. If the mesh cannot be read, the result is None and a problem
        is added."""
        name = said.get("mesh", "")
        if name not in self.meshes:
            self.found.add(e, name or "mesh", "unknown mesh: the assets do not list it")
            return None
        at, asset = self.meshes[name]
        if "builtin" in asset or ("file" not in asset and "vertex" not in asset):
            self.found.add(at, name, "a mesh that MuJoCo generates cannot be read", "give the bodies that use it an <inertial>")
            return None
        scale = self.model.three(at, asset, "scale", "1 1 1")
        turned = self.model.found.numbers(at, "refquat", asset.get("refquat", "1 0 0 0"), (4,)) or [1.0, 0.0, 0.0, 0.0]
        found = self._read(at, name, asset)
        if found is None:
            return None
        return (found * scale - self.model.three(at, asset, "refpos", "0 0 0")) @ of_quaternion(turned)

    def _read(self, at: Element, name: str, asset: Attributes) -> np.ndarray | None:
        if "file" not in asset:
            try:
                points = np.array([float(x) for x in asset["vertex"].split()]).reshape(-1, 3)
                faces = np.array([int(x) for x in asset.get("face", "").split()], int).reshape(-1, 3)
            except ValueError as wrong:
                self.found.add(at, name, f"its vertices or faces: {wrong}", "give three numbers for each vertex and each face")
                return None
            if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
                self.found.add(at, name, f"a face refers to a vertex that is not one of the {len(points)}", "correct the face")
                return None
            if len(faces):
                return points[faces]
            return hull(points)
        path = self.model.asset(at, asset["file"])
        try:
            return triangles(path) if path else None
        except Unreadable as wrong:
            self.found.add(at, name, f"its file {asset['file']}: {wrong}", "save it as binary STL")
            return None

    def solid(self, e: Element, said: Attributes) -> MassProperties | None:
        """The solid of a geom's mesh."""
        name = said.get("mesh", "")
        if name not in self._solids:
            way = self.meshes[name][1].get("inertia", "legacy") if name in self.meshes else "legacy"
            corners = self.corners(e, said) if way in WAYS else None
            if way not in WAYS:
                self.found.add(e, name, f"a mesh with inertia={way!r} is not known", f"one of {', '.join(WAYS)}")
            self._solids[name] = None if corners is None else solid(corners, way)
        return self._solids[name]

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def body(self, body: Element, geoms: list[Geom]) -> MassProperties:
        """The mass properties of a body, raised to the lower bounds in <compiler>."""
        own = body.first("inertial")
        how = self.model.settings.from_geoms
        if own is not None and how != "true":
            return self._within_bounds(body, self._given_mass(own))
        return self._within_bounds(body, sum_of([g.mass for g in geoms]) if how != "false" else MassProperties())

    def principal_frame(self, body: Element) -> Pose | None:
        """Pose, in the body, of the frame at the mass centre with MuJoCo's principal axes. The result is None unless the file gives
        the moments about these axes, because MuJoCo then chooses the axes."""
        own = body.first("inertial")
        known = own is not None and self.model.settings.from_geoms != "true" and "fullinertia" not in own.attributes
        return self.model.pose(own, own.attributes) if own is not None and known else None

    def _given_mass(self, e: Element) -> MassProperties:
        at = self.model.pose(e, e.attributes)
        mass = self.found.attribute(e, "mass")
        full = self.found.numbers(e, "fullinertia", e.attributes["fullinertia"], (6,)) if "fullinertia" in e.attributes else None
        diagonal = self.model.three(e, e.attributes, "diaginertia", "0 0 0")
        return MassProperties(mass, at[:3, 3], tensor(full if full is not None else [*diagonal, 0.0, 0.0, 0.0], at))

    def _within_bounds(self, body: Element, m: MassProperties) -> MassProperties:
        """The mass properties, raised to the lower bounds in <compiler>. With ``balanceinertia``, moments that violate the triangle
        inequality are replaced by their mean."""
        s = self.model.settings
        if not np.isfinite(m.inertia).all():
            self.found.add(body, body.get("name") or "body", "its inertia is not finite", "check sizes and densities of its geoms")
            return MassProperties(1.0)
        moments, axes = np.linalg.eigh(m.inertia)
        bounded = np.maximum(moments, s.least_moment)
        if bounded[0] + bounded[1] < bounded[2] * (1 - 1e-12) and s.balance:
            bounded = np.full(3, bounded.mean())
        inertia = m.inertia if np.array_equal(bounded, moments) else axes @ np.diag(bounded) @ axes.T
        return MassProperties(max(m.mass, s.least_mass), m.center, inertia)


def drawn(geoms: list[Geom], center: np.ndarray) -> dict[str, Any]:
    """Scene keys that draw the geoms which MuJoCo shows. If MuJoCo hides all geoms (under a skin), the keys draw the geoms of the
    lowest group."""
    first = min((g.group for g in geoms), default=0.0)
    return visual_shapes.drawn([s for g in geoms if g.group < HIDDEN or g.group == first for s in _solids(g)], center)


def _solids(g: Geom) -> list[visual_shapes.Solid]:
    corners = g.corners()
    if len(corners):
        return [visual_shapes.Solid("mesh", (), g.at, corners)]
    if len(g.size) != SIZES.get(g.kind, -1):
        return []
    whole = {"sphere": g.size, "ellipsoid": g.size, "box": [2 * x for x in g.size]}.get(g.kind) or [g.size[0], 2 * g.size[1]]
    return [visual_shapes.Solid(g.kind, tuple(whole), g.at)]
