"""A scissor lift with friction in all its pivots. The lift settles on a spring of its shoe, oscillates and comes to rest. In a
second scene, a drive moves the lift so slowly that hand statics gives its loads."""

from __future__ import annotations

import numpy as np

from trunnion.scene import Scene, scene_from_text

LENGTH, ANGLE = 0.8, np.radians(35.0)
"""Length of a bar, m, and its angle to the ground at the start."""
MASS, RADIUS, GRAVITY = 2.0, 0.01, 9.81
"""Mass of a bar, kg; radius of a pin, m; gravity, m/s²."""
SPRUNG = "spring: {stiffness: 8000, rest: 0.6}, damping: 20"


def driven(stages: int, rate: float, mu: float = 0.15) -> Scene:
    """The lift whose shoe a drive moves at a steady rate, m/s."""
    return scissor(stages, mu, f"drive: {{constant: {{rate: {rate}, start: {LENGTH * np.cos(ANGLE)}}}}}")


def statics(stages: int, mu: float, shoe: float, sense: float) -> dict[str, float]:
    """Force in every pin, N, by hand statics, while the shoe at a distance from the foot (m) moves slowly outward (sense 1) or
    inward (−1). A pin at level k carries the weight V of the parts above on its side, and a thrust T. A middle pin carries the
    thrusts of the two levels beside it. Balance of a bar about its middle: (T − T') sinθ l/2 = (V + V') cosθ l/2 ∓ friction of its
    three pins, each r μ/√(1 + μ²) times its force."""
    angle = np.arccos(shoe / LENGTH)
    arm, out = -sense * RADIUS * mu / np.sqrt(1.0 + mu * mu), {}
    V, above = MASS * GRAVITY * (stages - np.arange(stages + 1)), 0.0
    for k in reversed(range(stages)):
        T = above
        for _ in range(100):
            friction = arm * (np.hypot(T, V[k]) + T + above + np.hypot(above, V[k + 1]))
            T = above + ((V[k] + V[k + 1]) * 0.5 * LENGTH * np.cos(angle) + friction) / (0.5 * LENGTH * np.sin(angle))
        out |= {f"low_a{k}": np.hypot(T, V[k]), f"low_b{k}": np.hypot(T, V[k]), f"mid{k}": T + above}
        above = T
    return out


def scissor(stages: int, mu: float = 0.15, shoe: str = "") -> Scene:
    """The lift in the plane of x and z. The left foot is pinned. The right foot is on a shoe that slides. shoe: the device that
    moves the shoe."""
    half = 0.5 * LENGTH
    rub = f"friction: {{mu: {mu}, radius: {RADIUS}, half_length: 0.02}}"
    starts = f"start: {{q: {LENGTH * np.cos(ANGLE)}}},"
    bodies = ["  shoe: {box: [0.1, 0.05, 0.04], mass: 1}"]
    joints = [
        f"  guide: {{type: prismatic, axis: x, inboard: ground, outboard: shoe, {'' if shoe else starts}",
        f"    {shoe or SPRUNG},",
        f"    friction: {{mu: {mu}, half_length: 0.05, half_width: 0.02, half_height: 0.02}}}}",
    ]
    for k in range(stages):
        ends = f"points: {{low: [{-half}, 0, 0], high: [{half}, 0, 0]}}"
        bodies += [f"  {side}{k}: {{box: [{LENGTH}, 0.03, 0.05], mass: {MASS}, {ends}}}" for side in "ab"]
        below = ("ground", "shoe") if k == 0 else (f"b{k - 1}.high", f"a{k - 1}.high")
        turned = (-ANGLE, np.pi + ANGLE) if k == 0 else (-np.pi - 2.0 * ANGLE, np.pi + 2.0 * ANGLE)
        joints += [
            f"  low_{side}{k}: {{type: revolute, axis: y, inboard: {at}, outboard: {side}{k}.low, start: {{q: {q}}}, {rub}}}"
            for side, at, q in zip("ab", below, turned, strict=True)
        ]
        joints += [f"  mid{k}: {{type: revolute, axis: y, inboard: a{k}, outboard: b{k}, {rub}}}"]
    head = f"schema: 1\nname: scissor of {stages} stages\ngravity: [0, 0, -{GRAVITY}]"
    return scene_from_text("\n".join([head, "bodies:", *bodies, "joints:", *joints]))
