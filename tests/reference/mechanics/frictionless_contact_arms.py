"""Arms of the contacts of joints without friction. An arm is a tenth of the size of a block. A block is a set of joints that share
loops."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import Frames, parts

PART = 0.1
NO_SIZE = 1e-12
"""A smaller size of a block, m, is round-off: all points coincide."""


def arms(scene, frames: Mapping[str, Frames]) -> dict[str, float]:
    """The arm of each joint, m. It is a tenth of the root mean square distance of the joints' points from their mean on each body.
    The mean is taken over the joints that share loops with this joint. If all points of these joints coincide, the bodies' mass
    centres count as points, too. The arm is 0 for joints on no loop. frames: sides of the joints by name."""
    bodies = parts(scene)
    ends = {n: [f.inboard, f.outboard] for n, f in frames.items()}
    out = dict.fromkeys(frames, 0.0)
    for block in _blocks(scene, ends):
        points: dict[str, list[np.ndarray]] = {}
        for n in block:
            if scene.joints[n].type == "gearbox":
                continue
            for body, p in ((frames[n].inboard, frames[n].p_in), (frames[n].outboard, frames[n].p_out)):
                points.setdefault(body, []).append(np.asarray(p, float))
        size = _size(points)
        if size < NO_SIZE:
            size = _size({b: [*own, *([bodies[b].center] if b in bodies else [])] for b, own in points.items()})
        out |= dict.fromkeys(block, PART * size)
    return out


def _size(points: Mapping[str, list[np.ndarray]]) -> float:
    """Root mean square distance of the points from their mean on each body, m."""
    away = np.concatenate([np.array(own) - np.mean(own, axis=0) for own in points.values()])
    return float(np.sqrt((away**2).sum() / len(away)))


def _blocks(scene, ends: Mapping[str, list[str]]) -> list[set[str]]:
    """Sets of joints that share loops, directly or through other joints. A joint closes a loop with every other path between its
    two bodies."""
    sets: list[set[str]] = []
    for n, (a, b) in ends.items():
        other = _way({k: e for k, e in ends.items() if k != n}, a, b)
        mimic = scene.joints[n].mimic
        loop = {n, *(other or ()), *([mimic.joint] if mimic is not None else [])}
        if len(loop) > 1:
            sets = [s for s in sets if not s & loop] + [loop.union(*(s for s in sets if s & loop))]
    return sets


def _way(ends: Mapping[str, list[str]], a: str, b: str) -> tuple[str, ...] | None:
    """Joints of a shortest path between two bodies; None without a path."""
    ways: dict[str, tuple[str, ...]] = {a: ()}
    fresh = [a]
    while fresh and b not in ways:
        body = fresh.pop(0)
        for n, e in ends.items():
            if body in e:
                to = e[1] if e[0] == body else e[0]
                if to not in ways:
                    ways[to] = (*ways[body], n)
                    fresh.append(to)
    return ways.get(b)
