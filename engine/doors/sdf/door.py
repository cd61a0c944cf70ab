"""A scene from SDF: models with their links and joints, nested or included, as one linkage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.doors.linkage import GROUND, LIGHT, Link, Linkage, Names, Tie, floats
from engine.doors.pictures import Pictures
from engine.doors.placing import Pose, along, inverse, pose, to_quaternion
from engine.doors.sdf.frames import WORLD
from engine.doors.sdf.joints import TYPES, acting, axis_of, crossed, pitch_of
from engine.doors.sdf.models import Held, Models, said
from engine.doors.shapes import Solid, drawn
from engine.doors.xml import Element, Findings, read_xml
from engine.scene.model import Scene

SOLIDS = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}


def scene_of_sdf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on what was left out). Models that are static are the ground; links that no joint carries fly freely.
    stops: stiffness of limits, N/m and N m/rad; None leaves them out.

    SceneError with everything that cannot be represented, each with its line.
    """
    path = Path(file)
    if not path.is_file():
        raise SceneError([Problem(str(file), "there is no such file")])
    root, found = read_xml(path), Findings()
    if root.tag != "sdf":
        found.add(root, root.tag, "the file begins with no <sdf>", "SDF does")
        found.end()
    folder = path.resolve().parent
    reader = _Reader(root, Models(root, folder, found), Pictures(folder, found))
    scene = reader.linkage(path.stem).scene(stops)
    reader.meshes.tell()
    return scene, found.notes


class _Reader:
    def __init__(self, root: Element, models: Models, meshes: Pictures):
        self.root, self.models, self.meshes, self.found, self.frames = root, models, meshes, models.found, models.frames
        self.links, self.joints = models.links, models.joints
        self.names, self.place = Names(), {WORLD: GROUND}
        self.made: dict[str, str] = {}

    # -- the linkage --------------------------------------------------------------------------------------------------------

    def linkage(self, name: str) -> Linkage:
        """All links and joints; what is wrong is among ``found``."""
        models = [m for e in (self.root, *self.root.all("world")) for m in e.all("model")]
        called = models[0].get("name") if len(models) == 1 else name
        out = Linkage("".join(c if c.isalnum() or c == "_" else "_" for c in called), self.found, self.models.gravity)
        moving = {n: held for n, held in self.links.items() if not held.still and n in self.frames.known}
        self.place |= {n: GROUND for n in self.links if n not in moving}
        for n, held in moving.items():
            self.place[n] = self.names.new(held.element.get("name"), "link")
            out.links[self.place[n]] = self._link(held.element)
        self.found.end()
        carried = {self._end(j, "child") for j in self.joints if not j.still}
        for n in moving:
            if n not in carried:
                at = self.frames.place(n)
                more = {"start": {"q": [*floats(at[:3, 3]), *to_quaternion(at[:3, :3])]}}
                flies = Tie("free", GROUND, self.place[n], np.eye(4), np.eye(4), more)
                out.ties[self.names.new(f"{self.place[n]}_flies", "joint")] = flies
        for j in self.joints:
            self._joint(j, out)
        for j in self.joints:
            self._follows(j, out)
        for n, held in moving.items():
            self._lifted(self.place[n], held.element, out)
        if not out.links:
            self.found.add(self.root, "sdf", "nothing in it moves")
        return out

    def _follows(self, j: Held, out: Linkage) -> None:
        """Joints that follow others: multiplier · (position of the other − reference) + offset."""
        for m in (m for a in j.element.all("axis", "axis2") for m in a.all("mimic")):
            ratio, offset, ref = (self._entry(m, k, d) for k, d in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0)))
            follower, leader = (self.made.get(self.frames.full(j.scope, n), "") for n in (j.element.get("name"), m.get("joint")))
            out.follow(j.element, follower, leader, ratio, offset - ratio * ref)

    def _lifted(self, name: str, e: Element, out: Linkage) -> None:
        off = e.first("gravity")
        if off is not None and off.text in ("false", "0") and any(out.gravity):
            force = [-out.links[name].mass * g for g in out.gravity]
            out.forces[self.names.new(f"{name}_lift", "force")] = {"type": "force", "on": name, "force": floats(force)}

    def _link(self, e: Element) -> Link:
        given = e.first("inertial")
        if given is None:
            self.found.notes.append(f"{e.get('name')}: no <inertial>, so SDF's own 1 kg and 1 kg m²")
            return Link(1.0, np.zeros(3), np.eye(3), drawn(self._solids(e), np.zeros(3)))
        if given.get("auto") == "true" or given.first("fluid_added_mass") is not None:
            what = "inertial is computed from collisions" if given.get("auto") == "true" else "a fluid adds to its mass"
            self.found.add(given, e.get("name"), what, "give mass and inertia")
        mass, at = given.first("mass"), self.frames.read(given)
        moments = given.first("inertia")
        six = [self._entry(moments, k, 1.0 if k[1] == k[2] else 0.0) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        xx, yy, zz, xy, xz, yz = six
        R = at[:3, :3]
        inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        weight = self.found.number(mass, "text", mass.text, 1.0) if mass is not None else 1.0
        return Link(weight, at[:3, 3], inertia, drawn(self._solids(e), at[:3, 3]))

    def _entry(self, moments: Element | None, key: str, default: float) -> float:
        e = moments.first(key) if moments is not None else None
        return self.found.number(e, "text", e.text, default) if e is not None else default

    def _solids(self, link: Element) -> list[Solid]:
        """What the visuals of a link are made of."""
        out = []
        for v in link.all("visual"):
            geometry = v.first("geometry")
            for g in geometry.children if geometry is not None else ():
                parts = [g.first(k) for k in SOLIDS.get(g.tag, ())]
                if parts and None not in parts:
                    sizes = [x for p in parts if p is not None for x in self.found.numbers(p, "text", p.text, (1, 3)) or []]
                    out.append(Solid(g.tag, tuple(sizes), self.frames.read(v)))
                if g.tag == "mesh":
                    scale = self.found.numbers(g, "scale", said(g, "scale") or "1 1 1", (3,)) or [1.0] * 3
                    out += self.meshes.solids(said(g, "uri"), self.frames.read(v), scale)
        return out

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _end(self, j: Held, side: str) -> str:
        """The full name of the link on one side of a joint; "" where there is none."""
        return self.frames.link(self.frames.full(j.scope, said(j.element, side))) or ""

    def _joint(self, j: Held, out: Linkage) -> None:
        e, kind = j.element, j.element.get("type")
        ends = [self._end(j, side) for side in ("parent", "child")]
        missing = [side for side, end in zip(("parent", "child"), ends, strict=True) if end not in self.place]
        for side in missing:
            self.found.add(e, e.get("name"), f"its {side} {said(e, side)!r} is no link", "name a link of the model, or world")
        if missing or self.place[ends[0]] == self.place[ends[1]] == GROUND:
            return
        if kind not in TYPES:
            self.found.add(e, e.get("name"), f"has type {kind!r}, which a scene does not have", "take it out of the file")
            return
        at = self.frames.place(self.frames.full(j.scope, e.get("name")))
        first = self._axis(j, at, "axis")
        if kind == "revolute2":
            self._in_series(j, out, ends, at, first)
            return
        frame = at @ (crossed(first, self._axis(j, at, "axis2")) if kind == "universal" else first)
        more = acting(self.found, e, TYPES[kind], out) | pitch_of(self.found, e)
        made = self.made[self.frames.full(j.scope, e.get("name"))] = self._tie(e.get("name"), TYPES[kind], ends, frame, more, out)
        self._limit(e, "axis", made, out)

    def _limit(self, e: Element, tag: str, made: str, out: Linkage) -> None:
        axis = e.first(tag)
        limit = axis.first("limit") if axis is not None else None
        if limit is not None and e.get("type") != "continuous":
            out.limits[made] = (self._entry(limit, "lower", -np.inf), self._entry(limit, "upper", np.inf))

    def _axis(self, j: Held, at: Pose, tag: str) -> Pose:
        """The frame of an axis in the joint's: its first direction along the axis."""
        e = j.element.first(tag)
        given, expressed = axis_of(self.found, j.element, e)
        if expressed is None and (self.models.old or (e is not None and said(e, "use_parent_model_frame") in ("true", "1"))):
            expressed = "__model__"
        if expressed:
            name = self.frames.full(j.scope, expressed)
            if name != WORLD and name not in self.frames.known:
                self.found.add(j.element, j.element.get("name"), f"its axis is expressed in {expressed!r}, which there is not")
                return along(given)
            given = at[:3, :3].T @ self.frames.place(name)[:3, :3] @ given
        return along(given)

    def _in_series(self, j: Held, out: Linkage, ends: list[str], at: Pose, first: Pose) -> None:
        """Two hinges with a link between them that weighs next to nothing."""
        name, child = j.element.get("name"), self.place[ends[1]]
        light = LIGHT * (out.links[child].mass if child in out.links else 1.0)
        middle = self.names.new(f"{name}_middle", "link")
        out.links[middle] = Link(light, np.zeros(3), np.zeros((3, 3)))
        self.place[middle] = middle
        where = at @ pose()
        one = self._tie(f"{name}_1", TYPES["revolute"], [ends[0], middle], at @ first, {}, out, {middle: where})
        last = at @ self._axis(j, at, "axis2")
        two = self._tie(f"{name}_2", TYPES["revolute"], [middle, ends[1]], last, {}, out, {middle: where})
        self._limit(j.element, "axis", one, out)
        self._limit(j.element, "axis2", two, out)

    def _tie(self, name: str, kind: str, ends: list[str], frame: Pose, more: dict[str, Any], out: Linkage,
             given: dict[str, Pose] | None = None) -> str:  # fmt: skip
        """A joint whose frame is given in the world, and its name; given: where links are that have no frame of their own."""
        at = [(given or {}).get(n) if n in (given or {}) else self._stands(n) for n in ends]
        sides = [inverse(where if where is not None else np.eye(4)) @ frame for where in at]
        made = self.names.new(name, "joint")
        out.ties[made] = Tie(kind, self.place[ends[0]], self.place[ends[1]], sides[0], sides[1], more)
        return made

    def _stands(self, name: str) -> Pose:
        return np.eye(4) if self.place[name] == GROUND else self.frames.place(name)

