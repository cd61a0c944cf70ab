"""Importer of URDF. Links become bodies; joints keep their frames. Notes list content that a scene cannot represent."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.importers.intermediate_linkage import GROUND, MOMENTS, Link, Linkage, LinkageJoint, Names, floats, plain_name, tensor
from trunnion.importers.pose_matrices import Pose, along, inverse, pose, rpy
from trunnion.importers.schema_coverage import schema
from trunnion.importers.visual_meshes import MeshReader
from trunnion.importers.visual_shapes import Solid, drawn
from trunnion.importers.xml_reader import Element, Findings, existing, read_root
from trunnion.scene.data_classes.scene import Scene

TYPES = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "floating": "free",
    "planar": "planar",
}  # fmt: skip
GEOMETRY = {"box": ("size", 3), "cylinder": ("radius", 1), "sphere": ("radius", 1)}


def scene_of_urdf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on omissions). A root link without mass is the ground. A root link with mass is fixed to the ground. Gravity
    is along −z. ``stops`` is the stiffness of end stops at joint limits, N/m and N m/rad; None omits the limits.

    SceneError lists every joint or link that a scene cannot represent, each with its line."""
    path = existing(file)
    hint = "URDF files begin with <robot>; expand a xacro file first: xacro robot.xacro > robot.urdf"
    root, found = read_root(path, "robot", hint)
    reader = UrdfReader(root, found, MeshReader(path.resolve().parent, found))
    schema("URDF").tell(root, found)
    scene = reader.linkage(path.stem).scene(stops)
    reader.meshes.tell()
    return scene, found.notes


class UrdfReader:
    def __init__(self, root: Element, found: Findings, meshes: MeshReader):
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
        """Whether both links of a joint exist. For a missing link, a problem is added."""
        missing = [(side, _link_of(j, side)) for side in ("parent", "child") if _link_of(j, side) not in self.links]
        for side, name in missing:
            self.found.add(j, j.get("name"), f"its {side} {name!r} is not a link", "name a link of the file")
        return not missing

    def linkage(self, name: str) -> Linkage:
        """The linkage of all links and joints. ``found`` collects the faults of the file."""
        if len(self.roots) != 1:
            self.found.add(self.root, "links", f"{len(self.roots)} roots instead of one: {', '.join(self.roots)}")
            self.found.end()
        root = self.roots[0]
        grounded = self._is_massless(root)
        frames = self._frames(root)
        holding = {id(j) for j in frames.values()}
        bodies = [n for n in self.links if n not in frames and not (grounded and n == root)]
        self.place = {n: (self.names.new(n, "link"), np.eye(4)) for n in bodies} | ({root: (GROUND, np.eye(4))} if grounded else {})
        out = Linkage(plain_name(self.name or name, ascii_only=False), self.found)
        for n in bodies:
            out.links[self.place[n][0]] = self._link(n)
        out.complete_masses()
        self._place_frames(frames, out)
        if not grounded:
            out.joints[self.names.new("base", "joint")] = LinkageJoint("fixed", GROUND, self.place[root][0], np.eye(4), np.eye(4))
        for j in self.joints:
            if id(j) not in holding:
                self._joint(j, out)
        for j in self.joints:
            for m in j.all("mimic"):
                if j.get("type") == "fixed":
                    self.found.notes.append(f"mimic of a fixed joint left out: <mimic> in line {m.line}")
                    continue
                ratio, offset = (self.found.attribute(m, k, d) for k, d in (("multiplier", 1.0), ("offset", 0.0)))
                out.follow(j, self.made.get(j.get("name"), ""), self.made.get(m.get("joint"), ""), ratio, offset)
        return out

    def _is_massless(self, link: str) -> bool:
        inertial = self.links[link].first("inertial")
        mass = inertial.first("mass") if inertial is not None else None
        return mass is None or not self.found.attribute(mass, "value")

    def _carries_mass(self, link: str) -> bool:
        """Whether this link, or a link that it carries directly or through other links, has mass."""
        after = [link]
        for n in after:  # the loop appends to this list
            after += [_link_of(j, "child") for j in self.joints if _link_of(j, "parent") == n and _link_of(j, "child") not in after]
        return not all(map(self._is_massless, after))

    def _frames(self, root: str) -> dict[str, Element]:
        """{massless link: joint} for the massless links that chains of fixed joints connect to the root or to a link with mass. The
        joint is the last of the chain. The link on its other side is not massless, or comes earlier in the result."""
        fixed: dict[str, list[Element]] = {n: [] for n in self.links}
        for j in self.joints:
            for side in ("parent", "child") if j.get("type") == "fixed" else ():
                fixed[_link_of(j, side)].append(j)
        light = {n for n in self.links if n != root and self._is_massless(n)}
        frames: dict[str, Element] = {}
        reached = [n for n in self.links if n not in light]
        for n in reached:
            for j in fixed[n]:
                other = _other_link(j, n)
                if other in light and other not in frames:
                    frames[other] = j
                    reached.append(other)
        return frames

    def _place_frames(self, frames: dict[str, Element], out: Linkage) -> None:
        """Make each massless link in a chain of fixed joints a named point of the body that holds the link. The body gets the
        moments of inertia of the link."""
        for n, j in frames.items():
            holder, at = self.place[_other_link(j, n)]
            origin = self._origin(j)
            self.place[n] = holder, at @ (origin if _link_of(j, "child") == n else inverse(origin))
            inertial = self.links[n].first("inertial")
            moments = self._moments(inertial)
            if holder != GROUND and any(moments):
                out.links[holder].inertia = out.links[holder].inertia + tensor(moments, self.place[n][1] @ self._origin(inertial))
            points = out.ground if holder == GROUND else out.links[holder].points
            points[Names().new(n, "point")] = floats(self.place[n][1][:3, 3])

    # -- links --------------------------------------------------------------------------------------------------------------

    def _origin(self, e: Element | None) -> Pose:
        """The pose of an element's <origin>."""
        at = e.first("origin") if e is not None else None
        if at is None:
            return np.eye(4)
        xyz = self.found.numbers(at, "xyz", at.get("xyz", "0 0 0"), (3,)) or [0.0] * 3
        angles = self.found.numbers(at, "rpy", at.get("rpy", "0 0 0"), (3,)) or [0.0] * 3
        return pose(xyz, rpy(*angles))

    def _moments(self, inertial: Element | None) -> list[float]:
        """The moments and products of inertia of an <inertial>."""
        given = (inertial.first("inertia") or inertial) if inertial is not None else None
        return [self.found.attribute(given, k) for k in MOMENTS] if given is not None else [0.0] * len(MOMENTS)

    def _link(self, name: str) -> Link:
        link = self.links[name]
        inertial = link.first("inertial")
        if inertial is None or self._is_massless(name):
            if not self._carries_mass(name):
                self.found.add(link, name, "moves and has no mass", "give the link an <inertial>")
            return Link(0.0, np.zeros(3), tensor(self._moments(inertial), self._origin(inertial)))
        frame, mass = self._origin(inertial), inertial.first("mass")
        inertia = tensor(self._moments(inertial), frame)
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
                return [Solid(e.tag, tuple(sizes), at)] if len(sizes) == count + (e.tag == "cylinder") else []
            if e.tag == "mesh":
                scale = self.found.numbers(e, "scale", e.get("scale", "1 1 1"), (3,)) or [1.0] * 3
                return self.meshes.solids(e.get("filename"), at, scale)
        return []

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _joint(self, j: Element, out: Linkage) -> None:
        """Add joint j with the frames of both sides. The two frames coincide at q = 0."""
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
        (inboard, holder), (outboard, carried) = self.place[_link_of(j, "parent")], self.place[_link_of(j, "child")]
        made = self.made[name] = self.names.new(name, "joint")
        more = self._devices(j, kind, out)
        out.joints[made] = LinkageJoint(kind, inboard, outboard, holder @ self._origin(j) @ frame, carried @ frame, more)
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


def _other_link(j: Element, link: str) -> str:
    """Name of the link on the other side of a joint."""
    return _link_of(j, "parent" if _link_of(j, "child") == link else "child")


def _link_of(j: Element, side: str) -> str:
    """Name of the link on one side of a joint; "" if the file does not give it."""
    e = j.first(side)
    return e.get("link") if e is not None else ""
