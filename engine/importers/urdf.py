"""Importer of URDF: links become bodies, joints keep their frames. Notes list what a scene cannot represent."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.importers.intermediate_linkage import GROUND, MOMENTS, Link, Linkage, Names, Tie, floats, plain_name, tensor
from trunnion.importers.pose_matrices import Pose, along, pose, rpy
from trunnion.importers.visual_meshes import Pictures
from trunnion.importers.visual_shapes import Solid, drawn
from trunnion.importers.xml_reader import Element, Findings, existing, read_root
from trunnion.scene.data_classes.scene import Scene

TYPES = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "floating": "free",
    "planar": "planar",
}  # fmt: skip
GEOMETRY = {"box": ("size", 3), "cylinder": ("radius", 1), "sphere": ("radius", 1)}


def scene_of_urdf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on omissions). A root link without mass is the ground; otherwise the root link is fixed to the ground. Gravity
    is along −z. ``stops`` is the stiffness of end stops at joint limits, N/m and N m/rad; None omits the limits.

    SceneError lists every joint or link that a scene cannot represent, each with its line."""
    path = existing(file)
    hint = "URDF files begin with <robot>; expand a xacro file first: xacro robot.xacro > robot.urdf"
    root, found = read_root(path, "robot", hint)
    reader = UrdfReader(root, found, Pictures(path.resolve().parent, found))
    scene = reader.linkage(path.stem).scene(stops)
    reader.meshes.tell()
    return scene, found.notes


class UrdfReader:
    def __init__(self, root: Element, found: Findings, meshes: Pictures):
        self.root, self.found, self.names, self.meshes = root, found, Names(), meshes
        self.made: dict[str, str] = {}
        self.links = {e.get("name"): e for e in root.all("link")}
        self.joints = [e for e in root.all("joint") if self._has_links(e)]
        self.name = root.get("name")
        children = {_link_of(j, "child") for j in self.joints}
        self.roots = [n for n in self.links if n not in children]
        for e in root.inside():
            if e.tag.startswith("xacro:"):
                found.add(e, e.tag, "a xacro macro that is not expanded", "xacro robot.xacro > robot.urdf")
                break

    def _has_links(self, j: Element) -> bool:
        """Whether both links of a joint exist; a missing link is a problem."""
        missing = [(side, _link_of(j, side)) for side in ("parent", "child") if _link_of(j, side) not in self.links]
        for side, name in missing:
            self.found.add(j, j.get("name"), f"its {side} {name!r} is not a link", "name a link of the file")
        return not missing

    def linkage(self, name: str) -> Linkage:
        """The linkage of all links and joints; ``found`` collects faults."""
        if len(self.roots) != 1:
            self.found.add(self.root, "links", f"{len(self.roots)} roots instead of one: {', '.join(self.roots)}")
            self.found.end()
        root = self.roots[0]
        grounded = self._is_massless(root)
        ends = self._end_points()
        bodies = [n for n in self.links if n not in ends and not (grounded and n == root)]
        self.place = {n: self.names.new(n, "link") for n in bodies} | ({root: GROUND} if grounded else {})
        out = Linkage(plain_name(self.name or name, ascii_only=False), self.found)
        for n in bodies:
            out.links[self.place[n]] = self._link(n)
        if not grounded:
            out.ties[self.names.new("base", "joint")] = Tie("fixed", GROUND, self.place[root], np.eye(4), np.eye(4))
        for j in self.joints:
            if _link_of(j, "child") in ends:
                holder = self.place[_link_of(j, "parent")]
                points = out.ground if holder == GROUND else out.links[holder].points
                points[Names().new(_link_of(j, "child"), "point")] = floats(self._origin(j)[:3, 3])
            else:
                self._joint(j, out)
        for j in self.joints:
            for m in j.all("mimic"):
                ratio, offset = (self.found.attribute(m, k, d) for k, d in (("multiplier", 1.0), ("offset", 0.0)))
                out.follow(j, self.made.get(j.get("name"), ""), self.made.get(m.get("joint"), ""), ratio, offset)
        return out

    def _is_massless(self, link: str) -> bool:
        inertial = self.links[link].first("inertial")
        mass = inertial.first("mass") if inertial is not None else None
        return mass is None or not self.found.attribute(mass, "value")

    def _end_points(self) -> set[str]:
        """Names of the massless links without children on fixed joints; these links become named points."""
        parents = {_link_of(j, "parent") for j in self.joints}
        fixed = {_link_of(j, "child") for j in self.joints if j.get("type") == "fixed"}
        return {n for n in fixed - parents if self._is_massless(n)}

    # -- links --------------------------------------------------------------------------------------------------------------

    def _origin(self, e: Element | None) -> Pose:
        """The pose of an element's <origin>."""
        at = e.first("origin") if e is not None else None
        if at is None:
            return np.eye(4)
        xyz = self.found.numbers(at, "xyz", at.get("xyz", "0 0 0"), (3,)) or [0.0] * 3
        angles = self.found.numbers(at, "rpy", at.get("rpy", "0 0 0"), (3,)) or [0.0] * 3
        return pose(xyz, rpy(*angles))

    def _link(self, name: str) -> Link:
        link = self.links[name]
        inertial = link.first("inertial")
        if inertial is None or self._is_massless(name):
            self.found.add(link, name, "moves and has no mass", "give the link an <inertial>")
            return Link(1.0, np.zeros(3), np.zeros((3, 3)))
        frame, mass, moments = self._origin(inertial), inertial.first("mass"), inertial.first("inertia") or inertial
        inertia = tensor([self.found.attribute(moments, k) for k in MOMENTS], frame)
        weight = self.found.attribute(mass, "value") if mass is not None else 0.0
        return Link(weight, frame[:3, 3], inertia, drawn([s for v in link.all("visual") for s in self._solids(v)], frame[:3, 3]))

    def _solids(self, visual: Element) -> list[Solid]:
        """The solids of a <visual>."""
        at = self._origin(visual)
        for e in visual.within("geometry"):
            if e.tag in GEOMETRY:
                key, count = GEOMETRY[e.tag]
                sizes = self.found.numbers(e, key, e.get(key), (count,)) or []
                sizes += [self.found.attribute(e, "length")] if e.tag == "cylinder" else []
                return [Solid(e.tag, tuple(sizes), at)]
            if e.tag == "mesh":
                scale = self.found.numbers(e, "scale", e.get("scale", "1 1 1"), (3,)) or [1.0] * 3
                return self.meshes.solids(e.get("filename"), at, scale)
        return []

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _joint(self, j: Element, out: Linkage) -> None:
        """Add joint j with the frames of both sides; they coincide at q = 0."""
        name, said = j.get("name"), j.get("type")
        if said not in TYPES:
            self.found.add(j, name, f"has type {said!r}, which scenes do not support", "remove it from the file")
            return
        kind, given = TYPES[said], j.first("axis")
        axis = (self.found.numbers(given, "xyz", given.get("xyz"), (3,)) if given is not None else None) or [1.0, 0.0, 0.0]
        if REGISTRY[kind].needs_axis and not any(axis):
            self.found.add(given or j, name, "its axis is a zero vector")
            return
        frame = along(axis) if REGISTRY[kind].needs_axis else np.eye(4)
        sides = self.place[_link_of(j, "parent")], self.place[_link_of(j, "child")]
        made = self.made[name] = self.names.new(name, "joint")
        out.ties[made] = Tie(kind, *sides, self._origin(j) @ frame, frame, self._devices(j, kind, out))
        limit = j.first("limit")
        if limit is not None and said != "continuous" and REGISTRY[kind].nv == 1:
            ends = [self.found.attribute(limit, key) for key in ("lower", "upper")]
            out.limits[made] = (ends[0], ends[1])

    def _devices(self, j: Element, kind: str, out: Linkage) -> dict[str, Any]:
        more: dict[str, Any] = {}
        dynamics = j.first("dynamics")
        if dynamics is not None:
            damping = self.found.attribute(dynamics, "damping")
            rates = REGISTRY[kind].nv
            if damping and rates:
                more["damping"] = damping if rates == 1 else [damping] * rates
            more |= out.friction(j.get("name"), kind, self.found.attribute(dynamics, "friction"))
        return more


def _link_of(j: Element, side: str) -> str:
    """Name of the link on one side of a joint; "" if it is not given."""
    e = j.first(side)
    return e.get("link") if e is not None else ""
