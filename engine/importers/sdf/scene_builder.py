"""Importer of SDF. All models of a file, including nested and included models, become one linkage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trunnion.importers.intermediate_linkage import GROUND, LIGHT, MOMENTS, Link, Linkage, LinkageJoint, Names, plain_name, tensor
from trunnion.importers.pose_matrices import Pose, along, inverse
from trunnion.importers.sdf.frames import WORLD
from trunnion.importers.sdf.joints import TYPES, acting, axis_of, crossed, pitch_of
from trunnion.importers.sdf.model_tree import ModelItem, Models
from trunnion.importers.visual_meshes import MeshReader
from trunnion.importers.visual_shapes import Solid, drawn
from trunnion.importers.xml_reader import Element, existing, read_root
from trunnion.scene.data_classes.scene import Scene

SOLIDS = {
    "box": ("size",), "cylinder": ("radius", "length"), "capsule": ("radius", "length"), "sphere": ("radius",),
    "ellipsoid": ("radii",),
}  # fmt: skip


def scene_of_sdf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on omissions). Static models become part of the ground. Links without a joint move freely. ``stops`` is the
    stiffness of end stops at joint limits, N/m and N m/rad; None omits the limits.

    SceneError lists everything that a scene cannot represent, each with its line."""
    path = existing(file)
    root, found = read_root(path, "sdf", "SDF files begin with <sdf>")
    folder = path.resolve().parent
    reader = SdfReader(root, Models(root, folder, found), MeshReader(folder, found))
    scene = reader.linkage(path.stem).scene(stops)
    reader.meshes.tell()
    return scene, found.notes

PARALLEL = 1.0 - 1e-9
"""Two axes count as parallel if the cosine between them is above this value."""


class SdfReader:
    def __init__(self, root: Element, models: Models, meshes: MeshReader):
        self.root, self.models, self.meshes, self.found, self.frames = root, models, meshes, models.found, models.frames
        self.links, self.joints = models.links, models.joints
        self.names, self.place = Names(), {WORLD: GROUND}
        self.made: dict[str, str] = {}
        self.added: dict[str, Pose] = {}

    # -- the linkage --------------------------------------------------------------------------------------------------------

    def linkage(self, name: str) -> Linkage:
        """The linkage of all links and joints. ``found`` collects the faults of the file."""
        models = [m for e in (self.root, *self.root.all("world")) for m in e.all("model")]
        called = models[0].get("name") if len(models) == 1 else name
        out = Linkage(plain_name(called, ascii_only=False), self.found, self.models.gravity)
        moving = {n: held for n, held in self.links.items() if not held.still and n in self.frames.known}
        self.place |= {n: GROUND for n in self.links if n not in moving}
        for n, held in moving.items():
            self.place[n] = self.names.new(held.element.get("name"), "link")
            out.links[self.place[n]] = self._link(held.element, held.scope)
        self.found.end()
        carried = {self._end(j, "child") for j in self.joints if not j.still}
        for n in moving:
            if n not in carried:
                out.release(self.names.new(f"{self.place[n]}_flies", "joint"), self.place[n], self.frames.place(n))
        for j in self.joints:
            self._joint(j, out)
        for j in self.joints:
            self._couple(j, out)
        for n, held in moving.items():
            if held.element.text_of("gravity") in ("false", "0") and any(out.gravity):
                out.lift(self.names.new(f"{self.place[n]}_lift", "force"), self.place[n], 1.0)
        if not out.links:
            self.found.add(self.root, "sdf", "nothing in it moves")
        return out

    def _couple(self, j: ModelItem, out: Linkage) -> None:
        """Add the mimic constraints of a joint: q = multiplier · (q of the leader − reference) + offset."""
        for m in (m for a in j.element.all("axis", "axis2") for m in a.all("mimic")):
            ratio, offset, ref = (self.found.child(m, k, d) for k, d in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0)))
            follower, leader = (self.made.get(self.frames.full(j.scope, n), "") for n in (j.element.get("name"), m.get("joint")))
            out.follow(j.element, follower, leader, ratio, offset - ratio * ref)

    def _link(self, e: Element, scope: str) -> Link:
        given = e.first("inertial")
        if given is None:
            default = "no <inertial>: SDF's default mass (1 kg) and moments of inertia (1 kg m²) are used"
            self.found.notes.append(f"{e.get('name')}: {default}")
            return Link(1.0, np.zeros(3), np.eye(3), drawn(self._solids(e, scope), np.zeros(3)))
        if given.get("auto") == "true" or given.first("fluid_added_mass") is not None:
            what = "inertial is computed from collisions" if given.get("auto") == "true" else "a fluid adds to its mass"
            self.found.add(given, e.get("name"), what, "give mass and inertia")
        at, moments = self.frames.read(given), given.first("inertia")
        inertia = tensor([self.found.child(moments, k, 1.0 if k[1] == k[2] else 0.0) for k in MOMENTS], at)
        return Link(self.found.child(given, "mass", 1.0), at[:3, 3], inertia, drawn(self._solids(e, scope), at[:3, 3]))

    def _solids(self, link: Element, scope: str) -> list[Solid]:
        """The solids of a link's visuals."""
        out, own = [], self.frames.full(scope, link.get("name"))
        for v in link.all("visual"):
            at, base = self.frames.read(v), self.frames.base(v, scope)
            if base == WORLD or base in self.frames.known:
                at = inverse(self.frames.place(own)) @ self.frames.place(base) @ at
            for g in v.within("geometry"):
                parts = [g.first(k) for k in SOLIDS.get(g.tag, ())]
                if parts and None not in parts:
                    sizes = [x for p in parts if p is not None for x in self.found.numbers(p, "text", p.text, (1, 3)) or []]
                    out.append(Solid(g.tag, tuple(sizes), at))
                if g.tag == "mesh":
                    scale = self.found.numbers(g, "scale", g.text_of("scale") or "1 1 1", (3,)) or [1.0] * 3
                    out += self.meshes.solids(g.text_of("uri"), at, scale)
        return out

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _end(self, j: ModelItem, side: str) -> str:
        """Full name of the link on one side of a joint; "" if there is no such link."""
        return self.frames.link(self.frames.full(j.scope, j.element.text_of(side))) or ""

    def _joint(self, j: ModelItem, out: Linkage) -> None:
        e, kind = j.element, j.element.get("type")
        ends = [self._end(j, side) for side in ("parent", "child")]
        missing = [side for side, end in zip(("parent", "child"), ends, strict=True) if end not in self.place]
        for side in missing:
            self.found.add(e, e.get("name"), f"its {side} {e.text_of(side)!r} is not a link", "name a link of the model, or world")
        if missing or self.place[ends[0]] == self.place[ends[1]] == GROUND:
            return
        if kind not in TYPES:
            self.found.add(e, e.get("name"), f"has type {kind!r}, which scenes do not support", "remove it from the file")
            return
        at = self.frames.place(self.frames.full(j.scope, e.get("name")))
        first = self._axis(j, at, "axis")
        if kind == "revolute2":
            self._add_two_hinges(j, out, ends, at, first)
            return
        second = self._axis(j, at, "axis2") if kind == "universal" else first
        if kind == "universal" and abs(first[:3, 0] @ second[:3, 0]) > PARALLEL:
            self.found.add(e, e.get("name"), "its two axes are parallel", "give axis and axis2 different directions")
            return
        frame = at @ (crossed(first, second) if kind == "universal" else first)
        more = acting(self.found, e, TYPES[kind], out) | pitch_of(self.found, e)
        full = self.frames.full(j.scope, e.get("name"))
        made = self.made[full] = self._add_joint(e.get("name"), TYPES[kind], ends, frame, more, out)
        self._store_limit(e, "axis", made, out)

    def _store_limit(self, e: Element, tag: str, made: str, out: Linkage) -> None:
        axis = e.first(tag)
        limit = axis.first("limit") if axis is not None else None
        if limit is not None and e.get("type") != "continuous":
            out.limits[made] = (self.found.child(limit, "lower", -np.inf), self.found.child(limit, "upper", np.inf))

    def _axis(self, j: ModelItem, at: Pose, tag: str) -> Pose:
        """Pose, relative to the joint's frame, of a frame whose first direction is the axis."""
        e = j.element.first(tag)
        given, expressed = axis_of(self.found, j.element, e)
        if expressed is None and (self.models.old or (e is not None and e.text_of("use_parent_model_frame") in ("true", "1"))):
            expressed = "__model__"
        if expressed:
            name = self.frames.full(j.scope, expressed)
            if name != WORLD and name not in self.frames.known:
                self.found.add(j.element, j.element.get("name"), f"its axis is expressed in {expressed!r}, an unknown frame")
                return along(given)
            given = at[:3, :3].T @ self.frames.place(name)[:3, :3] @ given
        return along(given)

    def _add_two_hinges(self, j: ModelItem, out: Linkage, ends: list[str], at: Pose, first: Pose) -> None:
        """Add two hinges and a nearly massless link between them."""
        name, child = j.element.get("name"), self.place[ends[1]]
        light = LIGHT * (out.links[child].mass if child in out.links else 1.0)
        middle = self.names.new(f"{name}_middle", "link")
        out.links[middle] = Link(light, np.zeros(3), np.zeros((3, 3)))
        self.place[middle] = middle
        self.added[middle] = at
        one = self._add_joint(f"{name}_1", TYPES["revolute"], [ends[0], middle], at @ first, {}, out)
        last = at @ self._axis(j, at, "axis2")
        two = self._add_joint(f"{name}_2", TYPES["revolute"], [middle, ends[1]], last, {}, out)
        self._store_limit(j.element, "axis", one, out)
        self._store_limit(j.element, "axis2", two, out)

    def _add_joint(self, name: str, kind: str, ends: list[str], frame: Pose, more: dict[str, Any], out: Linkage) -> str:
        """Add a joint whose frame is given in the world, and return its name."""
        sides = [inverse(self._link_pose(n)) @ frame for n in ends]
        made = self.names.new(name, "joint")
        out.joints[made] = LinkageJoint(kind, self.place[ends[0]], self.place[ends[1]], sides[0], sides[1], more)
        return made

    def _link_pose(self, name: str) -> Pose:
        if name in self.added:
            return self.added[name]
        return np.eye(4) if self.place[name] == GROUND else self.frames.place(name)
