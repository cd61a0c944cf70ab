"""Rest on joints that only push: each contact presses or is open. The references are complementarity and closed-form statics."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import trunnion
from tests.engine.unilateral.unilateral_scenes import G, body, box, corner, in_plane, scene


def complementary(K: np.ndarray, f: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """The x with K x = f + p, where x ≥ floor, p ≥ 0 and p (x − floor) = 0, by trying every set of contacts."""
    for closed in product((False, True), repeat=len(f)):
        x, on, p = floor.copy(), np.array(closed), np.zeros(len(f))
        x[~on] = np.linalg.solve(K[np.ix_(~on, ~on)], (f - K[:, on] @ floor[on])[~on])
        p[on] = (K @ x - f)[on]
        if (x >= floor).all() and (p >= 0.0).all():
            return x
    raise AssertionError("a positive definite K has a solution")


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(100))
def test_coupled_blocks_press_on_their_floors_or_hang_free(seed: int) -> None:
    """Blocks on vertical rails hang on springs to the ground and to each other. Each block has a floor, and about half of the
    blocks start on their floors. Hanging blocks vibrate."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    mass, own, tie = rng.uniform(0.5, 2, n), rng.uniform(20, 90, n), rng.uniform(20, 90, n - 1)
    floor, above, touching = rng.uniform(-0.4, 0.1, n), rng.uniform(0.05, 0.6, n), rng.random(n) < 0.5
    bodies = {f"b{i}": body(mass[i], 0.1) for i in range(n)}
    joints, forces = {}, {}
    for i in range(n):
        start = float(floor[i] + (0.0 if touching[i] else above[i]))
        joints[f"r{i}"] = {"type": "prismatic", "inboard": "ground", "outboard": f"b{i}", "axis": [0, 0, 1], "start": {"q": start},
                           "spring": {"stiffness": float(own[i])}}  # fmt: skip
        only = {"starts": "touching" if touching[i] else "open", "restitution": float(rng.uniform(0, 0.8))}
        joints[f"f{i}"] = {"type": "point_on_plane", "inboard": {"body": "ground", "point": [0, 0, float(floor[i])]},
                           "outboard": f"b{i}", "axis": [0, 0, 1], "unilateral": only}  # fmt: skip
    K = np.diag(own)
    for i in range(n - 1):
        K[i : i + 2, i : i + 2] += tie[i] * np.array([[1, -1], [-1, 1]])
        ends = {"between": [f"b{i}", f"b{i + 1}"], "axis": [0, 0, 1]}
        forces[f"t{i}"] = {"type": "bushing", **ends, "stiffness": [float(tie[i]), 0, 0]}
    made = scene(bodies, joints, **({"forces": forces} if forces else {}))
    found = trunnion.equilibrium(made, along=())
    x = complementary(K, -mass * G, floor)
    assert [found.q[f"r{i}"][0] for i in range(n)] == pytest.approx(x, abs=1e-9)
    assert found.kind == "stable"
    free = x > floor
    squares = np.linalg.eigvals((K / mass[:, None])[np.ix_(free, free)]).real
    frequencies = [m.frequency for m in trunnion.modes(made).modes]
    assert frequencies == pytest.approx(np.sort(np.sqrt(squares)) / (2 * np.pi), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_a_box_on_a_spring_rests_where_it_neither_slides_nor_tips(seed: int) -> None:
    """Two corners carry a box, and a spring pulls at its mass centre. The box rests if k x ≤ μ m g and k x h ≤ m g b."""
    rng = np.random.default_rng(seed)
    mu, half, height, mass, k = (rng.uniform(*r) for r in ((0.1, 0.9), (0.1, 0.4), (0.2, 0.5), (1, 5), (50, 200)))
    end = mass * G * min(mu, half / height) / k
    fly = in_plane("box", (height, end * rng.uniform(-2, 2), 0.0), (0, 0, 0), spring=[None, {"stiffness": k}, None])
    sides = {n: corner("box", (s * half, -height), mu) for n, s in (("left", -1), ("right", 1))}
    found = trunnion.equilibrium(scene({"box": body(mass, 0.1)}, {"fly": fly, **sides}))
    assert found.q["fly"] == pytest.approx((height, 0.0, 0.0), abs=1e-12)
    band = next(b for b in found.bands if b.coordinate == "fly.q[2]")
    assert (band.low, band.high) == pytest.approx((-end, end), rel=1e-9)


@pytest.mark.parametrize("share", [1 - 1e-6, 1 + 1e-6])
@pytest.mark.parametrize("mu", [0.3, 0.9])
def test_a_pushed_box_is_held_up_to_the_force_that_slides_or_tips_it(mu: float, share: float) -> None:
    half, height, mass = 0.2, 0.4, 2.0
    push = share * mass * G * min(mu, half / height)
    report = trunnion.hold(box(mu, half, height, mass, 0.1, (height, 0.0, 0.0), (0, 0, 0), effort=push))
    assert report.holds == (share < 1)
    assert report.moves == (("fly",) if mu == 0.9 and share > 1 else ())
