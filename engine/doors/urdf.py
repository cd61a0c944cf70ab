"""A scene from a URDF: links are bodies, joints keep their frames; what a URDF says and a scene does not is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.doors.linkage import GROUND, Link, Linkage, Names, Tie, floats
from engine.doors.pictures import Pictures
from engine.doors.placing import Pose, along, pose, rpy
from engine.doors.shapes import Solid, drawn
from engine.doors.xml import Element, Findings, read_xml
from engine.joints import REGISTRY
from engine.scene.model import Scene

TYPES = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "floating": "free",
    "planar": "planar",
}  # fmt: skip
GEOMETRY = {"box": ("size", 3), "cylinder": ("radius", 1), "sphere": ("radius", 1)}


def scene_of_urdf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on what was left out). The root link is the ground when it has no inertia, else fixed to it; gravity along −z.
    stops: stiffness of limits, N/m and N m/rad; None leaves them out.

    SceneError with every joint or link that cannot be represented, each with its line.
    """
    path = Path(file)
    if not path.is_file():
        raise SceneError([Problem(str(file), "there is no such file")])
    root = read_xml(path)
    found = Findings()
    if root.tag != "robot":
        found.add(root, root.tag, "the file begins with no <robot>", "URDF does; xacro writes it: xacro robot.xacro > robot.urdf")
        found.end()
    reader = _Reader(root, found, Pictures(path.resolve().parent, found))
    scene = reader.linkage(path.stem).scene(stops)
    reader.meshes.tell()
    return scene, found.notes


class _Reader:
    def __init__(self, root: Element, found: Findings, meshes: Pictures):
        self.root, self.found, self.names, self.meshes = root, found, Names(), meshes
        self.made: dict[str, str] = {}
        self.links = {e.get("name"): e for e in root.all("link")}
        self.joints = [e for e in root.all("joint") if self._known(e)]
        self.name = root.get("name")
        children = {_end(j, "child") for j in self.joints}
        self.roots = [n for n in self.links if n not in children]
        for e in root.inside():
            if e.tag.startswith("xacro:"):
                found.add(e, e.tag, "a macro that is not written out", "xacro robot.xacro > robot.urdf")
                break

    def _known(self, j: Element) -> bool:
        """Whether both links of a joint are there."""
        missing = [(side, _end(j, side)) for side in ("parent", "child") if _end(j, side) not in self.links]
        for side, name in missing:
            self.found.add(j, j.get("name"), f"its {side} {name!r} is no link", "name a link of the file")
        return not missing

    def linkage(self, name: str) -> Linkage:
        """All links and joints; what is wrong is among ``found``."""
        if len(self.roots) != 1:
            self.found.add(self.root, "links", f"{len(self.roots)} roots instead of one: {', '.join(self.roots)}")
            self.found.end()
        root = self.roots[0]
        grounded = self._massless(root)
        ends = self._ends()
        bodies = [n for n in self.links if n not in ends and not (grounded and n == root)]
        self.place = {n: self.names.new(n, "link") for n in bodies} | ({root: GROUND} if grounded else {})
        out = Linkage("".join(c if c.isalnum() or c == "_" else "_" for c in self.name or name), self.found)
        for n in bodies:
            out.links[self.place[n]] = self._link(n)
        if not grounded:
            out.ties[self.names.new("base", "joint")] = Tie("fixed", GROUND, self.place[root], np.eye(4), np.eye(4))
        for j in self.joints:
            if _end(j, "child") in ends:
                holder = self.place[_end(j, "parent")]
                points = out.ground if holder == GROUND else out.links[holder].points
                points[Names().new(_end(j, "child"), "point")] = floats(self._origin(j)[:3, 3])
            else:
                self._joint(j, out)
        for j in self.joints:
            for m in j.all("mimic"):
                ratio, offset = (self.found.number(m, k, m.attributes.get(k), d) for k, d in (("multiplier", 1.0), ("offset", 0.0)))
                out.follow(j, self.made.get(j.get("name"), ""), self.made.get(m.get("joint"), ""), ratio, offset)
        return out

    def _massless(self, link: str) -> bool:
        inertial = self.links[link].first("inertial")
        mass = inertial.first("mass") if inertial is not None else None
        return mass is None or not self.found.number(mass, "value", mass.attributes.get("value"), 0.0)

    def _ends(self) -> set[str]:
        """Massless links at the end of fixed joints, which are named points of what they are fixed to."""
        parents = {_end(j, "parent") for j in self.joints}
        fixed = {_end(j, "child") for j in self.joints if j.get("type") == "fixed"}
        return {n for n in fixed - parents if self._massless(n)}

    # -- links --------------------------------------------------------------------------------------------------------------

    def _origin(self, e: Element | None) -> Pose:
        """Where an element's <origin> puts it."""
        at = e.first("origin") if e is not None else None
        if at is None:
            return np.eye(4)
        xyz = self.found.numbers(at, "xyz", at.get("xyz", "0 0 0"), (3,)) or [0.0] * 3
        angles = self.found.numbers(at, "rpy", at.get("rpy", "0 0 0"), (3,)) or [0.0] * 3
        return pose(xyz, rpy(*angles))

    def _link(self, name: str) -> Link:
        link = self.links[name]
        inertial = link.first("inertial")
        if inertial is None or self._massless(name):
            self.found.add(link, name, "moves and has no mass", "give the link an <inertial>")
            return Link(1.0, np.zeros(3), np.zeros((3, 3)))
        frame, mass, moments = self._origin(inertial), inertial.first("mass"), inertial.first("inertia")
        get = lambda key: self.found.number(moments or inertial, key, (moments or inertial).attributes.get(key), 0.0)  # noqa: E731
        xx, yy, zz, xy, xz, yz = (get(k) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
        R = frame[:3, :3]
        inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        weight = self.found.number(mass, "value", mass.attributes.get("value"), 0.0) if mass is not None else 0.0
        return Link(weight, frame[:3, 3], inertia, drawn([s for v in link.all("visual") for s in self._solids(v)], frame[:3, 3]))

    def _solids(self, visual: Element) -> list[Solid]:
        """What a visual is made of."""
        geometry, at = visual.first("geometry"), self._origin(visual)
        for e in geometry.children if geometry is not None else ():
            if e.tag in GEOMETRY:
                key, count = GEOMETRY[e.tag]
                sizes = self.found.numbers(e, key, e.get(key), (count,)) or []
                sizes += [self.found.number(e, "length", e.attributes.get("length"), 0.0)] if e.tag == "cylinder" else []
                return [Solid(e.tag, tuple(sizes), at)]
            if e.tag == "mesh":
                scale = self.found.numbers(e, "scale", e.get("scale", "1 1 1"), (3,)) or [1.0] * 3
                return self.meshes.solids(e.get("filename"), at, scale)
        return []

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _joint(self, j: Element, out: Linkage) -> None:
        """Joint j of the file, with the frames of both sides written out; they coincide at q = 0."""
        name, said = j.get("name"), j.get("type")
        if said not in TYPES:
            self.found.add(j, name, f"has type {said!r}, which a scene does not have", "take it out of the file")
            return
        kind, given = TYPES[said], j.first("axis")
        axis = (self.found.numbers(given, "xyz", given.get("xyz"), (3,)) if given is not None else None) or [1.0, 0.0, 0.0]
        if REGISTRY[kind].needs_axis and not any(axis):
            self.found.add(given or j, name, "its axis has no length")
            return
        frame = along(axis) if REGISTRY[kind].needs_axis else np.eye(4)
        sides = self.place[_end(j, "parent")], self.place[_end(j, "child")]
        made = self.made[name] = self.names.new(name, "joint")
        out.ties[made] = Tie(kind, *sides, self._origin(j) @ frame, frame, self._acting(j, kind, out))
        limit = j.first("limit")
        if limit is not None and said != "continuous" and REGISTRY[kind].nv == 1:
            ends = [self.found.number(limit, key, limit.attributes.get(key), 0.0) for key in ("lower", "upper")]
            out.limits[made] = (ends[0], ends[1])

    def _acting(self, j: Element, kind: str, out: Linkage) -> dict[str, Any]:
        more: dict[str, Any] = {}
        dynamics = j.first("dynamics")
        if dynamics is not None:
            damping = self.found.number(dynamics, "damping", dynamics.attributes.get("damping"), 0.0)
            rates = REGISTRY[kind].nv
            if damping and rates:
                more["damping"] = damping if rates == 1 else [damping] * rates
            constant = self.found.number(dynamics, "friction", dynamics.attributes.get("friction"), 0.0)
            more |= out.friction(j.get("name"), kind, constant)
        return more


def _end(j: Element, side: str) -> str:
    """The link on one side of a joint."""
    e = j.first(side)
    return e.get("link") if e is not None else ""
