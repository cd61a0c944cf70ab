"""A mechanism as other programs write it, links and what ties them together by frames on both, and the scene that it is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from engine.doors.placing import Pose
from engine.doors.xml import Element, Findings
from engine.joints import REGISTRY
from engine.scene.check.names import RESERVED
from engine.scene.load import scene_from_dict
from engine.scene.model import Scene

GROUND = "ground"
LISTED = 8
"""Names that a note lists, at most."""
UNLIMITED = 1e15
"""Limits from here on are none (SDF writes 1e16)."""
LIGHT = 1e-15
"""Of the masses that it carries, what a link without any is given: far below the rounding of these."""


@dataclass
class Link:
    """A body: mass, kg; mass centre (3), m; inertia about it (3×3), kg m², in its axes; keys that draw it; named points."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray
    shape: dict[str, Any] = field(default_factory=dict)
    points: dict[str, list[float]] = field(default_factory=dict)


@dataclass
class Tie:
    """A joint of two links: its frame in each (first axis e1), which coincide at zero; further keys of a scene's joint."""

    kind: str
    inboard: str
    outboard: str
    at_in: Pose
    at_out: Pose
    more: dict[str, Any] = field(default_factory=dict)


class Names:
    """Names as scenes have them, each for one thing."""

    def __init__(self) -> None:
        self.taken = set(RESERVED)

    def new(self, wanted: str, kind: str) -> str:
        """The name nearest to the one that is wanted; kind: what it names, for those that have none or the same."""
        form = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in wanted) or kind
        form = form if form[0].isalpha() else f"{kind}_{form}"
        tries = [form, f"{form}_{kind}", *(f"{form}_{i}" for i in range(2, len(self.taken) + 3))]
        name = next(t for t in tries if t not in self.taken)
        self.taken.add(name)
        return name


@dataclass
class Linkage:
    """A whole mechanism. ground: named points of the world; forces: as a scene has them; limits: least and greatest coordinate of
    joints by name, m or rad."""

    name: str
    found: Findings
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    links: dict[str, Link] = field(default_factory=dict)
    ties: dict[str, Tie] = field(default_factory=dict)
    ground: dict[str, list[float]] = field(default_factory=dict)
    forces: dict[str, dict[str, Any]] = field(default_factory=dict)
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)

    def scene(self, stops: float | None = None) -> Scene:
        """The scene. stops: stiffness of the limits of single freedoms, N/m and N m/rad; None leaves them out. SceneError with all
        that was found wrong on the way."""
        self.found.end()
        self._stop(stops)
        data: dict[str, Any] = {
            "schema": 1, "name": self.name, "gravity": floats(self.gravity),
            "bodies": {n: _body(link) for n, link in self.links.items()},
            "joints": {n: _joint(t) for n, t in self.ties.items()},
        }  # fmt: skip
        if self.ground:
            data["ground"] = {"points": self.ground}
        if self.forces:
            data["forces"] = self.forces
        return scene_from_dict(data)

    def _stop(self, stiffness: float | None) -> None:
        single = [n for n in self.limits if stiffness and REGISTRY[self.ties[n].kind].nv == 1]
        for n in single:
            ends = {k: x for k, x in zip(("lower", "upper"), self.limits[n], strict=True) if abs(x) < UNLIMITED}
            if ends:
                self.ties[n].more["stops"] = {"stiffness": stiffness, **ends}
        left = [n for n in self.limits if n not in single]
        if left:
            why = "of several freedoms" if stiffness else "stops want a stiffness: --stops"
            self.found.notes.append(f"limits of {len(left)} joints left out ({why}): {listed(left)}")

    def friction(self, name: str, kind: str, constant: float) -> dict[str, Any]:
        """The keys that say constant friction along a joint's freedom; none, and a note, where a joint of this kind has none."""
        turns = REGISTRY[kind].freely_rubbed
        if not constant:
            return {}
        if len(turns) != 1:
            self.found.notes.append(f"{name}: constant friction {constant:g} left out (a {kind} joint has none)")
            return {}
        return {"friction": {"torque" if turns[0] else "force": constant}}


    def follow(self, e: Element, follower: str, leader: str, ratio: float, offset: float) -> None:
        """Let the freedom of one joint follow that of another ("" where there is no such one); what hinders it is told."""
        name, ties = e.get("name") or f"{e.tag} at line {e.line}", self.ties
        if leader not in ties or follower not in ties:
            self.found.add(e, name, "follows a joint that there is not", "name a joint of the file that moves")
        elif any(REGISTRY[ties[n].kind].nv != 1 for n in (leader, follower)):
            self.found.add(e, name, "ties joints that have not one freedom each", "hinges and slides can follow each other")
        elif not ratio:
            self.found.add(e, name, "follows a joint by a ratio of 0", "make it a fixed joint")
        elif "mimic" in ties[follower].more:
            self.found.add(e, name, "lets a joint follow two others", "leave one of them out")
        else:
            ties[follower].more["mimic"] = {"joint": leader, "ratio": ratio, "offset": offset}


def _body(link: Link) -> dict[str, Any]:
    six = link.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    out: dict[str, Any] = {"mass": float(link.mass), "center": floats(link.center), "inertia": floats(six), **link.shape}
    return out | ({"points": link.points} if link.points else {})


def _joint(t: Tie) -> dict[str, Any]:
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


def listed(names: list[str]) -> str:
    """The first few names, and how many more there are."""
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")


def floats(values: Any) -> list[float]:
    """The values as plain numbers; those that rotations leave a rounding error away from zero become zero."""
    array = np.asarray(values, float).ravel()
    big = float(np.abs(array).max()) if array.size else 0.0
    return [float(f"{x:.16g}") + 0.0 if abs(x) > 2e-16 * big else 0.0 for x in array]
