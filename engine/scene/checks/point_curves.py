"""Checks of the curves of slots, grooves and rails."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from trunnion.elements.joints import REGISTRY
from trunnion.scene.checks.joint_devices import FIELDS
from trunnion.scene.data_classes.joint_couplings import Curve
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.loads_and_signals import entries

MOST = 200
"""Most points of a curve; each point adds code to a compiled kernel."""
NEAR = 1e-9
"""Two points count as equal if their distance, relative to the curve's extent, is at most this value."""
USUAL = "{points: [[0, 0], [40 mm, 10 mm], [80 mm, 0]]}"
Point = Sequence[float]


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about curves."""
    able = ", ".join(k.name for k in REGISTRY.values() if k.follows == "curve")
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        has = REGISTRY[j.type].follows == "curve"
        if j.curve is not None and not has:
            yield Finding((*path, "curve"), f"a {j.type} joint has no curve", f"remove it; joints with a curve: {able}")
        elif has and j.curve is None:
            yield Finding(path, f"a {j.type} needs the curve on which its point stays", f"for example curve: {USUAL}")
        elif has and j.curve is not None:
            wrong = list(_points((*path, "curve"), j.curve))
            yield from wrong or _around(path, j, j.curve)
        yield from _slot(path, j)


def _slot(path: Path, j: Joint) -> Iterator[Finding]:
    """Findings about the walls of a slot."""
    plays = REGISTRY[j.type].plays
    if j.slot is not None and not plays:
        able = ", ".join(k.name for k in REGISTRY.values() if k.plays)
        yield Finding((*path, "slot"), f"a {j.type} joint has no slot with play", f"remove it; joints with such a slot: {able}")
    if plays and j.slot is None:
        hint = "for example slot: {play: 0.1 mm}; for a pin without play, use type: point_on_curve"
        yield Finding(path, f"a {j.type} needs the play of its slot", hint)
    if plays and j.unilateral is None:
        yield Finding(
            path, f"the walls of a {j.type} push, but do not pull", "give unilateral: {starts: open}, or {} to start at a wall"
        )
    if j.slot is None or j.curve is None:
        return
    if j.slot.repeated < 1:
        yield Finding((*path, "slot", "repeated"), f"{j.slot.repeated} slots", "give 1 or more")
    elif j.slot.repeated > 1 and max(abs(math.atan2(y, x)) for x, y in j.curve.points) >= math.pi / j.slot.repeated:
        what = f"the curve leaves its sector of 360°/{j.slot.repeated} around e2, so that the next slot is nearer"
        yield Finding((*path, "curve", "points"), what, "draw the slot around e2 (the key reference determines e2)")
    if j.slot.mouth is not None and j.curve.closed:
        yield Finding((*path, "slot", "mouth"), "a closed curve has no end for a mouth", "leave it out")


def _points(path: Path, c: Curve) -> Iterator[Finding]:
    fewest, count = 3 if c.closed else 2, len(c.points)
    if not fewest <= count <= MOST:
        what = f"{'a closed' if c.closed else 'an open'} curve of {count} points"
        yield Finding((*path, "points"), what, f"give {fewest} to {MOST} points")
        return
    points = [(float(x), float(y)) for x, y in c.points]
    size = max(math.dist(points[0], p) for p in points)
    ends = [*pairwise(points), *([(points[-1], points[0])] if c.closed else [])]
    for k, (a, b) in enumerate(ends):
        if math.dist(a, b) <= NEAR * size:
            hint = "a closed curve returns to its first point by itself" if k == count - 1 else "leave one point out"
            yield Finding((*path, "points", k), "two consecutive points are the same place", hint)
            return
    for i, (a, b) in enumerate(ends):
        for k, (p, q) in enumerate(ends[i + 2 :], i + 2):
            if not (c.closed and i == 0 and k == len(ends) - 1) and _cross(a, b, p, q):
                what = f"the curve crosses itself between points {k + 1} and {(k + 1) % count + 1}"
                yield Finding((*path, "points", k), what, "at a crossing the path would be ambiguous: use two curves")
                return


def _cross(a: Point, b: Point, p: Point, q: Point) -> bool:
    """Whether the segments ab and pq have a common point. Segments of one straight line have a common point only if their ranges
    meet."""
    meet = all(max(a[i], b[i]) >= min(p[i], q[i]) and max(p[i], q[i]) >= min(a[i], b[i]) for i in (0, 1))
    return meet and _side(a, b, p) * _side(a, b, q) <= 0 and _side(p, q, a) * _side(p, q, b) <= 0


def _side(a: Point, b: Point, p: Point) -> float:
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def _around(path: Path, j: Joint, c: Curve) -> Iterator[Finding]:
    """Findings for devices that a curve does not allow. A closed curve has no ends for end stops and springs. A joint with a roller
    has no devices."""
    if j.roller is not None and j.unilateral is None:
        what = "a roller touches one side of its curve"
        yield Finding((*path, "roller"), what, "give unilateral, or use pin_in_slot for a roller between two walls")
    for field in FIELDS if j.roller is not None else ():
        if getattr(j, field) is not None:
            what = "with a roller, the rate of this joint is the sliding speed of the roller's rim, and no device acts along it"
            yield Finding((*path, field), what, "give the device to the joint that carries the roller")
    for field in ("end_stops", "spring") if c.closed else ():
        for where, _ in entries(getattr(j, field), (*path, field)):
            what = f"a closed curve has no ends: {field.replace('_', ' ')} along it would jump where it closes"
            yield Finding(where, what, "leave it out")
