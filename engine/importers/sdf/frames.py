"""Frames of SDF by full name. Models, links, joints and explicit frames are frames. Each frame is placed relative to another
frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.pose_matrices import Pose, inverse, of_quaternion, pose, rpy
from trunnion.importers.xml_reader import Element, Findings

WORLD = "world"
OWN = "__model__"


@dataclass(frozen=True)
class Frame:
    """A frame.

    at         pose relative to the frame ``within``
    held_by    full name of the link or frame that the frame moves with; "" for the frame of a link
    placement  for a model: full name of the frame to which ``at`` applies, if not to the model's own frame
    """

    element: Element
    at: Pose
    within: str
    held_by: str = ""
    placement: str = ""


class Frames:
    """All frames of a file by full name. A full name joins the names of enclosing models with ::; the world adds no prefix."""

    def __init__(self, found: Findings):
        self.found, self.known = found, dict[str, Frame]()

    def full(self, scope: str, name: str) -> str:
        """The full name of ``name`` inside the model whose full name is ``scope``."""
        if name == WORLD:
            return WORLD
        return (scope or WORLD) if name == OWN else f"{scope}::{name}" if scope else name

    def read(self, e: Element) -> Pose:
        """The pose of an element's <pose>."""
        given = e.first("pose")
        if given is None or not given.text:
            return np.eye(4)
        if given.get("rotation_format") == "quat_xyzw":
            x = self.found.numbers(given, "text", given.text, (7,)) or [0.0] * 6 + [1.0]
            if not any(x[3:]):
                self.found.add(given, e.get("name"), "its quaternion is 0 0 0 0", "the identity is 0 0 0 1")
                x[6] = 1.0
            return pose(x[:3], of_quaternion([x[6], *x[3:6]]))
        x = self.found.numbers(given, "text", given.text, (6,)) or [0.0] * 6
        angles = np.deg2rad(x[3:]) if given.get("degrees") in ("true", "1") else x[3:]
        return pose(x[:3], rpy(*angles))

    def base(self, e: Element, scope: str) -> str:
        """Full name of the frame to which the pose of an element is relative; "" if the pose names no frame. SDF 1.6 calls the
        attribute ``frame``."""
        given = e.first("pose")
        named = given.get("relative_to") or given.get("frame") if given is not None else ""
        return self.full(scope, named) if named else ""

    def add(self, e: Element, scope: str, within: str, held_by: str = "", placement: str = "") -> str:
        """Add the frame of an element and return its full name. The frame is placed relative to ``relative_to`` of the element's
        pose, or by default to ``within`` (a full name)."""
        name = self.full(scope, e.get("name"))
        within = self.base(e, scope) or within
        if name in self.known:
            self.found.add(e, e.get("name"), "another frame in its model has the same name", "rename one of them")
        self.known[name] = Frame(e, self.read(e), within, held_by, placement)
        return name

    def check(self) -> None:
        """Add a problem for every frame with an unknown or circular reference."""
        for name, f in list(self.known.items()):
            if f.placement and f.placement not in self.known:
                what = f"has the unknown placement_frame {f.placement!r}"
                self.found.add(f.element, f.element.get("name"), what, "name a link, frame or model of the same model")
                self.known[name] = replace(f, placement="")
            seen, at = [name], f.within
            while at != WORLD and at in self.known and at not in seen:
                seen.append(at)
                at = self.known[at].within
            if at != WORLD:
                wrong = "which is placed relative to it" if at in seen else "an unknown frame"
                what = f"is placed relative to {at!r}, {wrong}"
                self.found.add(f.element, f.element.get("name"), what, "name a link, frame or model of the same model, or world")
                del self.known[name]

    def place(self, name: str, root: str = WORLD) -> Pose:
        """The pose of frame ``name`` in the frame ``root``."""
        if name in (root, WORLD):
            return np.eye(4)
        f = self.known[name]
        at = self.place(f.within, root) @ f.at
        return at @ inverse(self.place(f.placement, name)) if f.placement and root != name else at

    def link(self, name: str) -> str | None:
        """The full name of the link that a frame moves with, or "world"; None for an unknown frame or a cycle."""
        for _ in range(len(self.known) + 1):
            if name == WORLD or name not in self.known:
                return WORLD if name == WORLD else None
            f = self.known[name]
            if not f.held_by:
                return name
            name = f.held_by
        return None
