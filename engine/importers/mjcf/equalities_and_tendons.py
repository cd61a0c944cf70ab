"""Equalities and tendons of MJCF. Equalities of bodies become joints that close loops. Equalities of two joints become couplings.
Tendons between two sites become springs. The importer refuses other equalities, and other tendons with forces."""

from __future__ import annotations

import numpy as np

from trunnion.importers.intermediate_linkage import GROUND, LinkageJoint, floats, plain_name
from trunnion.importers.mjcf.bodies import BodyConverter, LinkPose
from trunnion.importers.mjcf.joints import CLOSING
from trunnion.importers.pose_matrices import Pose, inverse, of_quaternion, pose
from trunnion.importers.xml_reader import Element, is_zero

REMEDY = 'active="false" disables it'
PULLING = {"stiffness": "spring", "damping": "damper", "frictionloss": "frictionloss", "armature": ""}
"""{attribute that makes a tendon exert a force: flag that disables this force}."""


class EqualitiesAndTendons:
    """Adds equalities and tendons to the linkage."""

    def __init__(self, bodies: BodyConverter):
        self.bodies, self.model, self.found = bodies, bodies.model, bodies.found
        for e in self.model.entries("equality"):
            if self.model.attributes(e, "", "equality").get("active", "true") == "false" or "equality" in self.model.disabled:
                self.found.notes.append(f"{e.title}: left out (it is not active)")
            else:
                {"connect": self._connect, "weld": self._weld, "joint": self._couple}.get(e.tag, self._refuse)(e)
        idle = [t for t in self.model.entries("tendon") if not self._tendon(t)]
        if idle:
            self.found.notes.append(f"tendons left out (they exert no force by themselves): {', '.join(e.title for e in idle)}")

    def _refuse(self, e: Element) -> None:
        """Refuse an equality that couples neither bodies nor two joints."""
        self.found.add(e, e.title, f"<{e.tag}> couples coordinates, which is not imported", REMEDY)

    def _couple(self, e: Element) -> None:
        """Import the equality of two joints. In the file, q − ref of the first joint is a polynomial in q − ref of the second
        joint. A scene supports only the first two coefficients."""
        known = {j.get("name"): f for j, f in zip(self.bodies.elements, self.bodies.freedoms, strict=True) if j.get("name")}
        numbers = self.found.numbers(e, "polycoef", e.get("polycoef", "0 1 0 0 0"), (1, 2, 3, 4, 5)) or [0.0, 1.0]
        numbers += [0.0, 1.0, 0.0, 0.0, 0.0][len(numbers) :]
        if "joint2" not in e.attributes:
            self.found.add(e, e.title, "fixes a joint at a constant position", "merge its body into the parent body")
        elif any(numbers[2:]):
            what = f"couples joints by a polynomial: {e.get('polycoef')}"
            self.found.add(e, e.title, what, "joints of a scene follow by a ratio and an offset only")
        else:
            follower, leader = (known[n].name if n in known else "" for n in (e.get("joint1"), e.get("joint2")))
            self.bodies.linkage.follow(e, follower, leader, numbers[1], numbers[0])

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _place(self, e: Element, key: str, known: dict[str, LinkPose], default: str = "") -> LinkPose | None:
        name = e.get(key, default)
        if name not in known:
            self.found.add(e, e.title, f"there is no {key.rstrip('12')} {name!r}")
            return None
        return known[name]

    def _ends(self, e: Element) -> tuple[LinkPose, LinkPose, bool] | None:
        """(the two places that an equality connects, whether these places are sites). None if there is a fault, or if both places
        are on one link."""
        by_site = "site1" in e.attributes
        known = self.bodies.sites if by_site else self.bodies.places
        kind = "site" if by_site else "body"
        one, two = self._place(e, f"{kind}1", known), self._place(e, f"{kind}2", known, "" if by_site else "world")
        if one is None or two is None:
            return None
        if one.link == two.link:
            self.found.notes.append(f"{e.title}: left out (both sides are on {one.link})")
            return None
        return one, two, by_site

    def _world(self, place: LinkPose) -> Pose:
        return self.bodies.world[place.link] @ place.at

    def _connect(self, e: Element) -> None:
        ends = self._ends(e)
        if ends is None:
            return
        one, two, by_site = ends
        if not by_site:
            anchor = pose(self.model.three(e, e.attributes, "anchor", "0 0 0"))
            two = LinkPose(two.link, inverse(self.bodies.world[two.link]) @ self._world(one) @ anchor)
            one = LinkPose(one.link, one.at @ anchor)
        self._add_joint(e, LinkPose(one.link, pose(one.at[:3, 3])), LinkPose(two.link, pose(two.at[:3, 3])))

    def _weld(self, e: Element) -> None:
        ends = self._ends(e)
        if ends is None:
            return
        one, two, by_site = ends
        given = self.found.numbers(e, "relpose", e.get("relpose", "0 1 0 0 0 0 0"), (7,)) or [0.0] * 7
        if not by_site:
            told = "relpose" in e.attributes and any(given[3:])
            relative = pose(given[:3], of_quaternion(given[3:])) if told else inverse(self._world(one)) @ self._world(two)
            one = LinkPose(one.link, one.at @ relative)
        self._add_joint(e, one, two)

    def _add_joint(self, e: Element, one: LinkPose, two: LinkPose) -> None:
        if one.link == GROUND:
            one, two = two, one
        if one.link == GROUND:
            return
        joint = LinkageJoint(CLOSING[e.tag], two.link, one.link, two.at, one.at)
        self.bodies.linkage.joints[self.bodies.names.new(e.get("name") or f"{one.link}_to_{two.link}", "joint")] = joint

    # -- tendons ------------------------------------------------------------------------------------------------------------

    def _tendon(self, e: Element) -> bool:
        """Import a tendon as a spring, or refuse the tendon. For a tendon without forces, the function does nothing and returns
        False."""
        said = self.model.attributes(e, "", "tendon")
        acting = [k for k, flag in PULLING.items() if k in said and flag not in self.model.disabled]
        own = {k: (self.found.numbers(e, k, said[k], (1, 2, 3)) or [0.0])[0] for k in acting}
        if not any(own.values()):
            return False
        stops = e.children
        rest = self.found.numbers(e, "springlength", said.get("springlength", "-1"), (1, 2)) or [-1.0]
        line = e.tag == "spatial" and [c.tag for c in stops] == ["site", "site"] and len(set(rest)) == 1
        yields = not is_zero(said.get("springyield", "0"))
        if not line or yields or own.get("frictionloss") or own.get("armature"):
            self.found.add(e, e.title, "a tendon that exerts forces", "only springs between two sites are imported")
            return True
        places = [self._place(c, "site", self.bodies.sites) for c in stops]
        if places[0] is None or places[1] is None:
            return True
        ends = [self._point(p, f"{e.title}_{k + 1}") for k, p in enumerate(places) if p is not None]
        length = rest[0]
        if length < 0:
            length = float(np.linalg.norm(self._world(places[0])[:3, 3] - self._world(places[1])[:3, 3]))
        self.bodies.linkage.forces[self.bodies.names.new(e.title, "tendon")] = {
            "type": "spring_damper", "between": ends, "stiffness": own.get("stiffness", 0.0), "damping": own.get("damping", 0.0),
            "length": length,
        }  # fmt: skip
        return True

    def _point(self, p: LinkPose, name: str) -> str:
        linkage = self.bodies.linkage
        points = linkage.ground if p.link == GROUND else linkage.links[p.link].points
        made = plain_name(name)
        made = made if made[0].isalpha() else f"p_{made}"
        points[made] = floats(p.at[:3, 3])
        return f"{p.link}.{made}"
