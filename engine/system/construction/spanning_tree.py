"""Choice of the joints that form the tree and of those that are cut (paper §4: "each closed loop is opened by cutting a joint")."""

from __future__ import annotations

import heapq
from collections.abc import Collection
from dataclasses import replace
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Constant, Drive, Joint, Scene
from trunnion.scene.force_laws.registry import given
from trunnion.scene.queries.body_references import body_of
from trunnion.scene.queries.cuttable_joints import may_be_cut, tied
from trunnion.scene.queries.mass_properties import mass_properties

LIGHT = 1e-6
"""A body is light if its mass is below this fraction of the heaviest body's mass. If only the reaction of a cut joint moves a light
body, the body's motion loses more than six of sixteen digits."""
BY_COORDINATE = ("spring", "end_stops", "latch")
"""Devices whose force depends on a coordinate."""
DEVICES = ("spring", "damping", "nonlinear", "rotor_inertia", "end_stops", "drive", "effort", "motor", "latch")


@dataclass(frozen=True)
class Spanning:
    """A spanning tree. tree: joints in depth-first order, which is also the order of the bodies. cut: names of the cut joints."""

    tree: tuple[tuple[str, str, bool], ...]
    """A joint of the tree: joint, child body, forward. forward: whether the child is the outboard part."""
    cut: tuple[str, ...]


def cutting_cost(j: Joint, light: bool, tied: bool = False) -> tuple[int, int]:
    """The cost of cutting a joint, a tuple that compares lexicographically.

    The first entry adds up the reasons against a cut. Each of the following terms exceeds the sum of all later terms: the joint's
    type; a drive or rotor, or ``tied`` (the joint follows or leads another joint); forces that depend on an angle. (The angle of a
    cut joint is measured within ±π; outside this range, these forces would be wrong.) The last terms are the scene's key ``cut``, a
    light body, and devices. The second entry counts friction, given start values and new multipliers. A spherical joint is the best
    cut: it adds only three multipliers and saves a quaternion."""
    kind = REGISTRY[j.type]
    never = 0 if may_be_cut(j) and not tied else 48 if kind.cuttable else 96
    devices = sum(getattr(j, d) is not None for d in DEVICES)
    wish = {None: 0, True: -8, False: 8}[j.cut]
    soft = (2 if j.friction else 0) + (3 if j.start is not None else 0)
    first = never + (24 if has_force_by_angle(j) else 0) + wish + (3 if light else 0) + min(devices, 2)
    return (first, 2 * kind.rows + soft - (4 if kind.quaternion >= 0 else 0))


def has_force_by_angle(j: Joint) -> bool:
    """Whether a device on a turning freedom of a joint has a force that depends on the angle."""
    kind = REGISTRY[j.type]

    def acts(name: str, k: int) -> Any:
        value = getattr(j, name)
        return value[k] if isinstance(value, tuple) else value

    turning = [k for k in range(kind.nv) if kind.turns(k)]
    return any(acts(d, k) is not None for d in BY_COORDINATE for k in turning) or any(
        law.elastic for k in turning for law, _ in given(acts("nonlinear", k))
    )


def closing_joints(scene: Scene, prescribed: Collection[str]) -> list[str]:
    """Prescribed joints whose motion follows from the motion of a loop's other joints, because all these other joints are
    prescribed."""
    moves = Drive(constant=Constant(0.0))
    driven = replace(scene, joints={n: replace(j, drive=moves) if n in prescribed else j for n, j in scene.joints.items()})
    return [n for n in span(driven).cut if n in prescribed]


def light_bodies(scene: Scene) -> set[str]:
    """Bodies with so little mass or inertia that they must not be at the end of a chain. At the end of a chain, a light body has
    large accelerations, and their round-off would hide the motion of other bodies."""
    made = {n: mass_properties(b) for n, b in scene.bodies.items()}
    heaviest = max((m for m, _, _ in made.values()), default=0.0)
    return {n for n, (m, _, inertia) in made.items() if m < LIGHT * heaviest or not any(map(any, inertia))}


def span(scene: Scene) -> Spanning:
    """The spanning tree. If a branch ends with a light body at a cut joint, the function builds the tree again, with a higher cost
    of cutting the joints of light bodies."""
    made = span_without_masses(scene)
    carrying = {body_of(scene.joints[n].inboard if forward else scene.joints[n].outboard) for n, _, forward in made.tree}
    loose = {body_of(side) for n in made.cut for side in (scene.joints[n].inboard, scene.joints[n].outboard)} - carrying
    light = light_bodies(scene)
    return made if light.isdisjoint(loose) else _span(scene, light)


def span_without_masses(scene: Scene) -> Spanning:
    """The spanning tree if no body counted as light."""
    return _span(scene, set())


def _span(scene: Scene, light: set[str]) -> Spanning:
    """The spanning tree, grown from the ground. The next joint is the joint with the highest cutting cost. Among joints of equal
    cost, the joint nearest to the ground comes first, then the first by name. The order in the file therefore has no effect."""
    ends = {n: (body_of(j.inboard), body_of(j.outboard)) for n, j in scene.joints.items()}
    at: dict[str, list[str]] = {}
    for n, (a, b) in ends.items():
        if REGISTRY[scene.joints[n].type].bodiless or scene.joints[n].unilateral is not None:
            continue  # the joint carries no body
        at.setdefault(a, []).append(n)
        at.setdefault(b, []).append(n)
    depth, together = {"ground": 0}, tied(scene)
    used: set[str] = set()
    tree: list[tuple[str, str, bool]] = []
    heap: list[tuple[tuple[int, int], int, str, str]] = []

    def reach(body: str) -> None:
        for n in at.get(body, ()):
            if n not in used:
                cost = cutting_cost(scene.joints[n], not light.isdisjoint(ends[n]), n in together)
                heapq.heappush(heap, ((-cost[0], -cost[1]), depth[body], n, body))

    reach("ground")
    while heap:
        _, _, n, body = heapq.heappop(heap)
        a, b = ends[n]
        other = b if a == body else a
        if n in used or other in depth:
            continue
        used.add(n)
        depth[other] = depth[body] + 1
        tree.append((n, other, other == b))
        reach(other)
    return Spanning(_by_branch(tree, ends), tuple(sorted(n for n in ends if n not in used)))


def _by_branch(tree: list[tuple[str, str, bool]], ends: dict[str, tuple[str, str]]) -> tuple[tuple[str, str, bool], ...]:
    """The tree's joints in depth-first order, so that the bodies of a chain are adjacent in memory."""
    children: dict[str, list[tuple[str, str, bool]]] = {}
    for entry in sorted(tree):
        n, child, _ = entry
        a, b = ends[n]
        children.setdefault(a if child == b else b, []).append(entry)
    order: list[tuple[str, str, bool]] = []
    stack = list(reversed(children.get("ground", [])))
    while stack:
        entry = stack.pop()
        order.append(entry)
        stack.extend(reversed(children.get(entry[1], [])))
    return tuple(order)
