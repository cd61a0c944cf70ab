"""Conversion of MJCF bodies and joints to links and joints of the linkage. A body with several joints becomes a chain of massless
links."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.intermediate_linkage import GROUND, Link, Linkage, LinkageJoint, Names, floats
from trunnion.importers.mass_matrix import mass_matrix
from trunnion.importers.mjcf.body_masses import Geom, MassReader, drawn
from trunnion.importers.mjcf.includes_and_defaults import Model
from trunnion.importers.mjcf.joints import JOINTS, MjcfJoint, freedom
from trunnion.importers.mjcf.mesh_solids import MassProperties
from trunnion.importers.pose_matrices import Pose, along, pose, to_quaternion
from trunnion.importers.xml_reader import Element


@dataclass
class LinkPose:
    """A pose relative to a link, or to the world."""

    link: str
    at: Pose


CONTENT = {"body": "bodies", "joint": "joints", "freejoint": "joints", "geom": "geoms", "site": "sites"}
"""Kind of content of a body, by the tag of an element."""
Inside = dict[str, list[tuple[Element, Pose, str]]]
"""The content of a body by kind, with <frame> elements resolved: (element, pose of its frame in the body, default class)."""


class BodyConverter:
    """Converts the bodies of a model into a linkage.

    places    place of each body by name
    sites     place of each site by name
    world     initial poses of the links in the world
    elements  the joint elements, in the order of the file
    freedoms  the freedoms of these joints, in the same order
    """

    def __init__(self, model: Model, linkage: Linkage):
        self.model, self.linkage, self.found = model, linkage, model.found
        self.masses, self.names = MassReader(model), Names()
        self.places: dict[str, LinkPose] = {"world": LinkPose(GROUND, np.eye(4))}
        self.sites: dict[str, LinkPose] = {}
        self.world: dict[str, Pose] = {GROUND: np.eye(4)}
        self.freedoms: list[MjcfJoint] = []
        self.elements: list[Element] = []
        self.lifted: dict[str, float] = {}
        self.scenery = 0
        for section in model.sections("worldbody"):
            self._inside(self._sorted(section, np.eye(4), section.get("childclass")), self.places["world"])
        if self.scenery:
            self.found.notes.append(f"left out: {self.scenery} bodies that never move")

    # -- content of bodies --------------------------------------------------------------------------------------------------

    def _sorted(self, e: Element, at: Pose, around: str) -> Inside:
        out: Inside = {kind: [] for kind in CONTENT.values()}
        for c in e.children:
            if c.tag == "frame":
                more = self._sorted(c, at @ self.model.pose(c, c.attributes), c.get("childclass") or around)
                for kind, entries in more.items():
                    out[kind] += entries
            elif c.tag in CONTENT:
                out[CONTENT[c.tag]].append((c, at, around))
        return out

    def _inside(self, inside: Inside, place: LinkPose) -> None:
        """Add the sites and the child bodies of a body."""
        for e, at, around in inside["sites"]:
            said = self.model.attributes(e, around)
            if e.get("name"):
                own, _ = self.masses.pose_and_size(e, said, said.get("type", "sphere"))
                self.sites[e.get("name")] = LinkPose(place.link, place.at @ at @ own)
        for e, at, around in inside["bodies"]:
            self._body(e, LinkPose(place.link, place.at @ at), e.get("childclass") or around)

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _body(self, e: Element, carrier: LinkPose, around: str) -> None:
        at = carrier.at @ self.model.pose(e, e.attributes)
        inside = self._sorted(e, np.eye(4), around)
        moving = bool(inside["joints"])
        matters = moving or carrier.link != GROUND or any(c.tag in JOINTS for c in e.inside())
        weighs = matters and e.first("inertial") is None
        geoms = [g for g in (self._geom(*each, weighs) for each in inside["geoms"]) if g is not None]
        mass = self.masses.body(e, geoms) if matters else MassProperties()
        if moving:
            place = self._links_of(e, inside, LinkPose(carrier.link, at), mass, geoms)
        elif mass.mass > 0:
            place = LinkPose(self._link(e.get("name"), "body", mass, geoms, carrier.link, at), np.eye(4))
            mount = LinkageJoint("fixed", carrier.link, place.link, at, np.eye(4))
            self._store_joint(f"{e.get('name') or place.link}_mount", mount)
        else:
            self.scenery += not matters
            place = LinkPose(carrier.link, at)
        self.places[e.get("name")] = place
        if place.link != GROUND and e.get("gravcomp"):
            self.lifted[place.link] = self.found.attribute(e, "gravcomp")
        self._inside(inside, place)

    def _geom(self, e: Element, at: Pose, around: str, weighs: bool) -> Geom | None:
        g = self.masses.geom(e, around, weighs or self.model.settings.from_geoms == "true")
        if g is None or np.array_equal(at, np.eye(4)):
            return g
        return replace(g, at=at @ g.at, mass=g.mass.placed(at))

    def _link(self, name: str, kind: str, mass: MassProperties, geoms: list[Geom], carrier: str, at: Pose) -> str:
        """Add a link and return its name. ``at`` is the initial pose of the new link in the link ``carrier``."""
        made = self.names.new(name, kind)
        self.linkage.links[made] = Link(mass.mass, mass.center, mass.inertia, drawn(geoms, mass.center))
        self.world[made] = self.world[carrier] @ at
        return made

    def _store_joint(self, name: str, joint: LinkageJoint) -> str:
        made = self.names.new(name, "joint")
        self.linkage.joints[made] = joint
        return made

    def _links_of(self, e: Element, inside: Inside, start: LinkPose, mass: MassProperties, geoms: list[Geom]) -> LinkPose:
        """Add one link for each joint of a body; the last link is the body itself."""
        if not mass.mass and not any(c.tag in ("inertial", "geom") for c in e.inside() if c is not e):
            self.found.add(e, e.get("name") or "body", "moves and has no mass", "give it a geom with mass, or an <inertial>")
        last = len(inside["joints"]) - 1
        link, at = start.link, start.at
        for k, (j, framed, around) in enumerate(inside["joints"]):
            own = mass if k == last else MassProperties()
            body = e.get("name") or f"body{len(self.linkage.links)}"
            made = self._link(body if k == last else f"{body}_{k + 1}", "body", own, geoms if k == last else [], link, at)
            self.elements.append(j)
            f = self._add_joint(j, framed, around, link, made, at)
            align = j.get("align", "auto")
            if f.type == "free" and not inside["bodies"] and (align == "true" or (align == "auto" and self.model.settings.align)):
                f.frame = self.masses.principal_frame(e)
            self.freedoms.append(f)
            link, at = made, np.eye(4)
        return LinkPose(link, at)

    def _add_joint(self, e: Element, framed: Pose, around: str, inboard: str, outboard: str, at: Pose) -> MjcfJoint:
        """Add one joint to the linkage. ``at`` is the pose of the body in the inboard link."""
        f = freedom(self.model, e, around, self.linkage)
        frame = framed @ along(f.axis, f.place)
        more: dict[str, Any] = dict(f.more)
        ends = (at @ frame, frame)
        if f.kind.quaternion > 0:  # a free joint's coordinates are relative to the world
            start = self.world[inboard] @ at
            ends = (np.linalg.inv(self.world[inboard]), np.eye(4))
            f.start = [*floats(start[:3, 3]), *to_quaternion(start[:3, :3])]
            more["start"] = {"q": f.start}
        if f.kind.quaternion == 0:
            ends = (at @ pose(frame[:3, 3]), pose(frame[:3, 3]))
        f.name = self._store_joint(e.get("name") or f"{outboard}_joint", LinkageJoint(f.kind.name, inboard, outboard, *ends, more))
        return f

    # -- completion ---------------------------------------------------------------------------------------------------------

    def complete_masses(self) -> None:
        """Scale the masses to the required total, give massless links a tiny mass, and add forces for gravity compensation."""
        links, total = self.linkage.links, self.model.settings.total
        if total > 0:
            scale = total / sum(link.mass for link in links.values())
            for link in links.values():
                link.mass, link.inertia = link.mass * scale, link.inertia * scale
        self.linkage.complete_masses()
        self._tune_springs()
        lifts = not {"spring", "damper"} <= self.model.disabled  # with both disabled, MuJoCo omits all passive forces
        for name, share in self.lifted.items():
            if share and lifts and any(self.linkage.gravity):
                self.linkage.lift(self.names.new(f"{name}_lift", "force"), name, share)

    def _tune_springs(self) -> None:
        """Compute stiffness and damping of the springs for which the file gives time constant and damping ratio in the initial
        pose."""
        swinging = {f.name: f.swing for f in self.freedoms if f.swing and f.kind.nv == 1}
        if not swinging:
            return
        rows, M = mass_matrix(self.linkage, self.world)
        weight = 1.0 / np.diag(np.linalg.inv(M))
        for name, (time, ratio) in swinging.items():
            own, more = float(weight[rows.index((name, 0))]), self.linkage.joints[name].more
            if "spring" in more:
                more["spring"]["stiffness"] = own / (time * ratio) ** 2
            if "damper" not in self.model.disabled:
                more["damping"] = 2 * own / time
