"""A Stewart platform on sprung legs with friction in all joints. Each leg has a universal joint on the ground, a prismatic joint
with a spring, and a ball on the platform."""

from __future__ import annotations

import numpy as np

from trunnion.scene import Scene, scene_from_text

BASE, TOP, HEIGHT = 0.5, 0.3, 0.85
"""Radii of the circles on which legs stand and end, and the height of the platform, m."""
GROUND = np.radians([-10.0, 110.0, 130.0, -130.0, -110.0, 10.0])
PLATE = np.radians([-50.0, 70.0, 170.0, -170.0, -70.0, 50.0])


def stewart(legs: int, mu: float = 0.1) -> Scene:
    """The platform at rest with relaxed springs, on the first ``legs`` of six legs."""
    bodies, joints, feet, heads = [], [], [], []
    for k in range(legs):
        foot = BASE * np.array([np.cos(GROUND[k]), np.sin(GROUND[k]), 0.0])
        head = TOP * np.array([np.cos(PLATE[k]), np.sin(PLATE[k]), 0.0])
        leg = head + np.array([0.0, 0.0, HEIGHT]) - foot
        length = float(np.linalg.norm(leg))
        first, second = float(np.arctan2(-leg[1], leg[2])), float(np.arcsin(leg[0] / length))
        feet.append(f"f{k}: {[float(v) for v in foot]}")
        heads.append(f"h{k}: {[float(v) for v in head]}")
        bodies.append(f"  cyl{k}: {{cylinder: {{radius: 0.02, length: 0.4, axis: z}}, mass: 2, center: [0, 0, 0.2]}}")
        bodies.append(f"  rod{k}: {{cylinder: {{radius: 0.012, length: 0.5, axis: z}}, mass: 1, center: [0, 0, -0.25]}}")
        joints += [
            f"  u{k}: {{type: universal, axis: x, reference: y, inboard: ground.f{k}, outboard: cyl{k},",
            f"    start: {{q: [{first}, {second}]}}, friction: {{mu: {mu}, radius: 0.01, half_length: 0.015}}}}",
            f"  leg{k}: {{type: prismatic, axis: z, inboard: cyl{k}, outboard: rod{k}, pin: inboard, damping: 300,",
            f"    start: {{q: {length}}}, spring: {{stiffness: 20000, rest: {length}}},",
            f"    friction: {{mu: {mu}, half_length: 0.06, half_width: 0.012, half_height: 0.012}}}}",
            f"  s{k}: {{type: spherical, inboard: rod{k}, outboard: platform.h{k}, friction: {{mu: {mu}, radius: 0.015}}}}",
        ]
    plate = f"  platform: {{cylinder: {{radius: 0.3, length: 0.03, axis: z}}, mass: 20, points: {{{', '.join(heads)}}}}}"
    ground = f"ground: {{points: {{{', '.join(feet)}}}}}"
    begin = f"schema: 1\nname: stewart on {legs} legs\ngravity: [0, 0, -9.81]\n{ground}"
    return scene_from_text("\n".join([begin, "bodies:", plate, *bodies, "joints:", *joints]))
