"""A scissor lift of stages whose pivots all rub: it settles on a spring of its shoe, swings and comes to rest."""

from __future__ import annotations

import numpy as np

from engine.scene import Scene, scene_from_text

LENGTH, ANGLE = 0.8, np.radians(35.0)
"""Of a bar, m; its angle to the ground at the start."""


def scissor(stages: int, mu: float = 0.15) -> Scene:
    """The lift in the plane of x and z; its left foot is pinned, its right one on a shoe that slides."""
    half = 0.5 * LENGTH
    rub = f"friction: {{mu: {mu}, radius: 0.01, half_length: 0.02}}"
    bodies = ["  shoe: {box: [0.1, 0.05, 0.04], mass: 1}"]
    joints = [
        f"  guide: {{type: prismatic, axis: x, inboard: ground, outboard: shoe, start: {{q: {LENGTH * np.cos(ANGLE)}}},",
        "    spring: {stiffness: 8000, rest: 0.6}, damping: 20,",
        f"    friction: {{mu: {mu}, half_length: 0.05, half_width: 0.02, half_height: 0.02}}}}",
    ]
    for k in range(stages):
        ends = f"points: {{low: [{-half}, 0, 0], high: [{half}, 0, 0]}}"
        bodies += [f"  {side}{k}: {{box: [{LENGTH}, 0.03, 0.05], mass: 2, {ends}}}" for side in "ab"]
        below = ("ground", "shoe") if k == 0 else (f"b{k - 1}.high", f"a{k - 1}.high")
        turned = (-ANGLE, np.pi + ANGLE) if k == 0 else (-np.pi - 2.0 * ANGLE, np.pi + 2.0 * ANGLE)
        joints += [
            f"  low_{side}{k}: {{type: revolute, axis: y, inboard: {at}, outboard: {side}{k}.low, start: {{q: {q}}}, {rub}}}"
            for side, at, q in zip("ab", below, turned, strict=True)
        ]
        joints += [f"  mid{k}: {{type: revolute, axis: y, inboard: a{k}, outboard: b{k}, {rub}}}"]
    head = f"schema: 1\nname: scissor of {stages} stages\ngravity: [0, 0, -9.81]"
    return scene_from_text("\n".join([head, "bodies:", *bodies, "joints:", *joints]))
