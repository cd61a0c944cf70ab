"""Many pairs at rest carry a varying load. Several freedoms would move these pairs. The engine distributes the load among the pairs
again only when needed, which is seldom."""

from __future__ import annotations

import numpy as np
import pytest

from tests.default_case_selection import sampled, slow
from trunnion.scene import Scene, scene_from_text
from trunnion.simulation.run import simulate

BASE, TOP, HEIGHT = 0.5, 0.3, 0.65
"""Radii of the circles on which legs stand and end, and the height of the platform, m."""
STEPS = 1000
"""Most steps for 1 s. A stop and a slip take about twenty steps, and all pairs stop and slip four to six times."""


def platform(mu: float, push: float) -> Scene:
    """A platform on three sprung legs (revolute, prismatic joint and ball), shaken at its edge. All joints have friction: nine
    pairs of fifteen components on three freedoms."""
    bodies, joints, feet, heads = [], [], [], ["edge: [0.3, 0, 0]"]
    for k, at in enumerate(np.radians([0.0, 125.0, 235.0])):
        out, across = np.array([np.cos(at), np.sin(at), 0.0]), [-float(np.sin(at)), float(np.cos(at)), 0.0]
        leg = (TOP - BASE) * out + [0.0, 0.0, HEIGHT]
        way = leg / np.linalg.norm(leg)
        feet.append(f"f{k}: {(BASE * out).tolist()}")
        heads.append(f"h{k}: {(TOP * out).tolist()}")
        bodies.append(f"  cyl{k}: {{mass: 2, inertia: [0.03, 0.03, 0.001], center: {(0.2 * way).tolist()}}}")
        bodies.append(f"  rod{k}: {{mass: 1, inertia: [0.015, 0.015, 0.0005], center: {(-0.2 * way).tolist()}}}")
        joints += [
            f"  r{k}: {{type: revolute, axis: {across}, inboard: ground.f{k}, outboard: cyl{k},",
            f"    friction: {{mu: {mu}, radius: 0.012, half_length: 0.03}}}}",
            f"  p{k}: {{type: prismatic, axis: {way.tolist()}, reference: {across}, inboard: cyl{k},",
            f"    outboard: {{body: rod{k}, point: {(-leg).tolist()}}}, start: {{q: 0}}, damping: 150,",
            "    spring: {stiffness: 15000, rest: 0.01},",
            f"    friction: {{mu: {mu}, half_length: 0.05, half_width: 0.015, half_height: 0.015}}}}",
            f"  s{k}: {{type: spherical, inboard: rod{k}, outboard: platform.h{k}, friction: {{mu: {mu}, radius: 0.012}}}}",
        ]
    plate = f"  platform: {{cylinder: {{radius: 0.3, length: 0.03, axis: z}}, mass: 20, points: {{{', '.join(heads)}}}}}"
    waves = [f"{{harmonic: {{amplitude: {push}, frequency: {f}}}}}" for f in (1.3, 2.1)]
    shake = f"forces: {{shake: {{type: force, on: platform.edge, force: [{waves[0]}, 0, {waves[1]}]}}}}"
    begin = f"schema: 1\nname: shaken platform\ngravity: [0, 0, -9.81]\nground: {{points: {{{', '.join(feet)}}}}}"
    return scene_from_text("\n".join([begin, "bodies:", plate, *bodies, "joints:", *joints, shake]))


@pytest.mark.parametrize(("mu", "push"), [slow((0.1, 60.0)), (0.15, 100.0), slow((0.2, 100.0))])
@pytest.mark.parametrize(("method", "rtol"), sampled([("auto", 1e-6), ("rk5", 1e-5), ("rk8", 1e-8), ("rosenbrock", 1e-7)], 1))
def test_loads_that_come_and_go_while_many_pairs_rest_take_few_steps(mu: float, push: float, method: str, rtol: float) -> None:
    """A new distribution of the load must leave a reserve in every pair. Otherwise one pair after the other reaches its capacity.
    Round-off of other loads, a torque about the ball's own force, must not release a small ball."""
    r = simulate(platform(mu, push), until=1.0, every=0.1, method=method, rtol=rtol, max_steps=STEPS, outputs=["energy.residual"])
    assert r.outcome.ok, r.outcome
    assert any(e.kind == "stick" for e in r.events)
