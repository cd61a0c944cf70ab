"""The linkage, an intermediate form of imported mechanisms. A linkage has links, and joints with a frame on each link. A scene is
made from the linkage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.importers.pose_matrices import Pose, to_quaternion
from trunnion.importers.xml_reader import Element, Findings
from trunnion.scene.checks.names import RESERVED
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.scene_loader import scene_from_dict

GROUND = "ground"
LISTED = 8
"""Largest number of names in a note."""
UNLIMITED = 1e15
"""A joint limit of this magnitude or more means "no limit" (SDF writes 1e16)."""
LIGHT = 1e-15
"""Mass given to a massless link, relative to the lightest mass. This mass is below the rounding error of the masses."""


MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
"""Moments and products of inertia by their names in URDF and SDF, in the order of a scene."""


@dataclass
class Link:
    """A body, with all data in the body's frame: mass, kg; mass centre (3), m; inertia about the mass centre (3×3), kg m²; scene
    keys of the shape; named points, m."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray
    shape: dict[str, Any] = field(default_factory=dict)
    points: dict[str, list[float]] = field(default_factory=dict)


@dataclass
class LinkageJoint:
    """A joint of two links. ``kind`` is the scene's joint type; ``at_in`` and ``at_out`` are the poses of the joint frames in the
    two links. The first axis is e1. The two frames coincide at q = 0. ``more`` holds further keys of the scene's joint."""

    kind: str
    inboard: str
    outboard: str
    at_in: Pose
    at_out: Pose
    more: dict[str, Any] = field(default_factory=dict)


class Names:
    """Unique names for a scene."""

    def __init__(self) -> None:
        self.taken = set(RESERVED)

    def new(self, wanted: str, kind: str) -> str:
        """A valid unused name similar to ``wanted``. ``kind`` replaces an empty ``wanted``. If necessary, ``kind`` also is the
        prefix or suffix that makes the name valid or unique."""
        form = plain_name(wanted) or kind
        form = form if form[0].isalpha() else f"{kind}_{form}"
        tries = [form, f"{form}_{kind}", *(f"{form}_{i}" for i in range(2, len(self.taken) + 3))]
        name = next(t for t in tries if t not in self.taken)
        self.taken.add(name)
        return name


@dataclass
class Linkage:
    """A mechanism. ``ground`` holds named points of the world, m. ``forces`` has the form of a scene's forces. ``limits`` holds the
    smallest and largest coordinate of joints by name, m or rad."""

    name: str
    found: Findings
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    links: dict[str, Link] = field(default_factory=dict)
    joints: dict[str, LinkageJoint] = field(default_factory=dict)
    ground: dict[str, list[float]] = field(default_factory=dict)
    forces: dict[str, dict[str, Any]] = field(default_factory=dict)
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)

    def scene(self, stops: float | None = None) -> Scene:
        """The scene. ``stops`` is the stiffness of end stops at the limits of joints with one freedom, N/m and N m/rad; None
        omits the limits. SceneError with all collected faults."""
        self.found.end()
        self._stop(stops)
        for name in [n for n, t in self.joints.items() if "mimic" in t.more]:
            self._start_followers(name)
        data: dict[str, Any] = {
            "schema": 1, "name": self.name, "gravity": floats(self.gravity),
            "bodies": {n: _body(link) for n, link in self.links.items()},
            "joints": {n: _joint(t) for n, t in self.joints.items()},
        }  # fmt: skip
        if self.ground:
            data["ground"] = {"points": self.ground}
        if self.forces:
            data["forces"] = self.forces
        return scene_from_dict(data)

    def complete_masses(self) -> None:
        """Give massless links a tiny mass."""
        least = min((link.mass for link in self.links.values() if link.mass > 0), default=1.0)
        for link in self.links.values():
            link.mass = link.mass or LIGHT * least

    def _start_followers(self, name: str) -> None:
        """Set the start coordinate of each joint that follows another joint (its leader). The coordinate follows from the start
        coordinate of the leader. A start coordinate in the file stays."""
        following: list[str] = []
        while "mimic" in (more := self.joints[name].more) and "start" not in more and name not in following:
            following.append(name)
            name = more["mimic"]["joint"]
        q = float(more.get("start", {}).get("q", 0.0))
        for name in reversed(following):
            own = self.joints[name].more
            q = own["mimic"]["ratio"] * q + own["mimic"]["offset"]
            own["start"] = {"q": q}

    def _stop(self, stiffness: float | None) -> None:
        single = [n for n in self.limits if stiffness and REGISTRY[self.joints[n].kind].nv == 1]
        for n in single:
            ends = {k: x for k, x in zip(("lower", "upper"), self.limits[n], strict=True) if abs(x) < UNLIMITED}
            if ends:
                self.joints[n].more["end_stops"] = {"stiffness": stiffness, **ends}
        left = [n for n in self.limits if n not in single]
        if left:
            why = "of several freedoms" if stiffness else "end stops need a stiffness: --end-stops"
            self.found.notes.append(f"limits of {len(left)} joints left out ({why}): {listed(left)}")

    def release(self, name: str, link: str, at: Pose) -> None:
        """Add a free joint between the ground and a link; ``at`` is the link's start pose."""
        start = {"start": {"q": [*floats(at[:3, 3]), *to_quaternion(at[:3, :3])]}}
        self.joints[name] = LinkageJoint("free", GROUND, link, np.eye(4), np.eye(4), start)

    def lift(self, name: str, link: str, share: float) -> None:
        """Add a force on a link that is opposite to its weight, times ``share``."""
        force = [-share * self.links[link].mass * g for g in self.gravity]
        if any(force):
            self.forces[name] = {"type": "force", "on": link, "force": floats(force)}

    def friction(self, name: str, kind: str, constant: float) -> dict[str, Any]:
        """Scene keys of constant friction along a joint's freedom. If the joint does not support constant friction, there are no
        keys, and a note says so."""
        turns = REGISTRY[kind].freely_rubbed
        if not constant:
            return {}
        if len(turns) != 1:
            self.found.notes.append(f"{name}: constant friction {constant:g} left out (a {kind} joint has none)")
            return {}
        return {"friction": {"torque" if turns[0] else "force": constant}}

    def follow(self, e: Element, follower: str, leader: str, ratio: float, offset: float) -> None:
        """Make the coordinate of joint ``follower`` equal to ratio · (coordinate of ``leader``) + offset. "" means an unknown
        joint. The linkage collects faults."""
        name, joints = e.title, self.joints
        if leader not in joints or follower not in joints:
            self.found.add(e, name, "follows an unknown joint", "name a joint of the file that moves")
        elif any(REGISTRY[joints[n].kind].nv != 1 for n in (leader, follower)):
            self.found.add(e, name, "couples a joint that does not have exactly one freedom", "only hinges and slides can follow")
        elif not ratio:
            self.found.add(e, name, "follows a joint by a ratio of 0", "make it a fixed joint")
        elif "mimic" in joints[follower].more:
            self.found.add(e, name, "makes a joint follow two others", "remove one of the couplings")
        else:
            joints[follower].more["mimic"] = {"joint": leader, "ratio": ratio, "offset": offset}


def tensor(six: Sequence[float], frame: Pose) -> np.ndarray:
    """Inertia (3×3) in the axes of the body, from (xx, yy, zz, xy, xz, yz) in the axes of ``frame``."""
    xx, yy, zz, xy, xz, yz = six
    R = frame[:3, :3]
    turned: np.ndarray = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    return turned


def plain_name(text: str, ascii_only: bool = True) -> str:
    """The text with _ in place of each character that is not a letter or digit."""
    return "".join(c if c.isalnum() and (c.isascii() or not ascii_only) else "_" for c in text)


def _body(link: Link) -> dict[str, Any]:
    six = link.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    out: dict[str, Any] = {"mass": float(link.mass), "center": floats(link.center), "inertia": floats(six), **link.shape}
    return out | ({"points": link.points} if link.points else {})


def _joint(t: LinkageJoint) -> dict[str, Any]:
    turned = REGISTRY[t.kind].needs_axis or any(np.abs(p[:3, :3] - np.eye(3)).max() > 1e-15 for p in (t.at_in, t.at_out))
    sides = []
    for link, at in ((t.inboard, t.at_in), (t.outboard, t.at_out)):
        side: dict[str, Any] = {"body": link}
        if np.any(at[:3, 3]):
            side["point"] = floats(at[:3, 3])
        if turned:
            side |= {"axis": floats(at[:3, 0]), "reference": floats(at[:3, 1])}
        sides.append(side)
    return {"type": t.kind, "inboard": sides[0], "outboard": sides[1], **t.more}


def listed(names: list[str], most: int = LISTED) -> str:
    """The first ``most`` names as text, and the number of further names."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def floats(values: Any) -> list[float]:
    """The values as plain floats with 16 digits. Values that are only rounding errors of the largest value become zero."""
    array = np.asarray(values, float).ravel()
    big = float(np.abs(array).max()) if array.size else 0.0
    return [float(f"{x:.16g}") + 0.0 if abs(x) > 2e-16 * big else 0.0 for x in array]
