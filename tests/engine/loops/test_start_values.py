"""Start values of loops: exact values never change, guesses select a branch, and points start at their positions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.default_case_selection import sampled
from tests.stability.equivalent_scenes import told
from trunnion import scene_from_dict, sensitivity, simulate, sweep
from trunnion.basics.errors import SceneError

JOINTS = ("crank_pivot", "crank_pin", "rocker_pin", "rocker_pivot")


class FourBar:
    """A random four-bar and one of its poses, from trigonometry. elbow: +1 or −1, the branch."""

    def __init__(self, seed: int):
        rng = np.random.default_rng(seed)
        self.elbow = int(rng.choice([-1, 1]))
        self.crank, self.rocker = rng.uniform(0.2, 0.4), rng.uniform(0.7, 1.0)
        self.coupler, self.base = rng.uniform(0.8, 1.0), rng.uniform(0.8, 1.0)
        self.angle = rng.uniform(-math.pi, math.pi)
        self.point = rng.uniform(-0.5, 0.5, 2)
        pin = self.crank * np.array([math.cos(self.angle), math.sin(self.angle)])
        across = np.array([self.base, 0.0]) - pin
        reach = math.hypot(*across)
        bend = math.acos((self.coupler**2 + reach**2 - self.rocker**2) / (2 * self.coupler * reach))
        turn = math.atan2(across[1], across[0]) + self.elbow * bend
        c, s = math.cos(turn), math.sin(turn)
        end = pin + self.coupler * np.array([c, s])
        self.place = pin + np.array([[c, -s], [s, c]]) @ self.point
        rocker = math.atan2(end[1], end[0] - self.base)
        angles = (self.angle, turn - self.angle, rocker - turn, rocker)
        self.angles = dict(zip(JOINTS, (math.remainder(a, 2 * math.pi) for a in angles), strict=True))

    def scene(self, starts: dict[str, Any], cut: str | None = None, point: Any = None) -> dict[str, Any]:
        """The scene with these start values of joints and this start position of the coupler's point."""

        def bar(length: float) -> dict[str, Any]:
            return {"box": [length, 0.02, 0.02], "mass": length, "center": [length / 2, 0, 0], "points": {"end": [length, 0, 0]}}

        coupler = bar(self.coupler)
        coupler["points"]["pen"] = [*map(float, self.point), 0.0]
        if point is not None:
            coupler["start"] = {"pen": point}
        at = {"body": "ground", "point": [float(self.base), 0, 0]}
        ends = (("ground", "crank"), ("crank.end", "coupler"), ("coupler.end", "rocker.end"), (at, "rocker"))
        joints: dict[str, Any] = {
            name: {"type": "revolute", "axis": "z", "inboard": a, "outboard": b} for name, (a, b) in zip(JOINTS, ends, strict=True)
        }
        for name, start in starts.items():
            joints[name]["start"] = start
        if cut:
            joints[cut]["cut"] = True
        bodies = {"crank": bar(self.crank), "coupler": coupler, "rocker": bar(self.rocker)}
        return {"schema": 1, "gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints, "outputs": ["*.q[*]", "coupler.pen.*"]}


def started(scene: dict[str, Any]) -> Any:
    """The first row of a short run."""
    r = simulate(scene, until=1e-3, every=1e-3, kernel="parts")
    assert r.outcome.ok, r.outcome
    return r


@pytest.mark.parametrize("seed", sampled(range(100), 6))
def test_a_point_starts_at_its_position(seed: int) -> None:
    bar = FourBar(seed)
    r = started(bar.scene({"crank_pivot": {"q": bar.angle + 0.2, "use": "guess"}}, JOINTS[seed % 4], [*map(float, bar.place), 0.0]))
    found = [r[f"coupler.pen.position[{i}]"][0] for i in (1, 2)]
    np.testing.assert_allclose(found, bar.place, atol=1e-12)  # loops of a metre are closed to round-off


@pytest.mark.parametrize("seed", sampled(range(100), 6))
@pytest.mark.parametrize("component", [0, 1])
def test_one_component_of_a_point_suffices(seed: int, component: int) -> None:
    bar = FourBar(seed)
    near = {n: {"q": a + 0.01, "use": "guess"} for n, a in bar.angles.items()}
    given: list[float | None] = [None, None, None]
    given[component] = float(bar.place[component])
    r = started(bar.scene(near, JOINTS[seed % 4], given))
    assert r[f"coupler.pen.position[{component + 1}]"][0] == pytest.approx(bar.place[component], abs=1e-12)


@pytest.mark.parametrize("seed", sampled(range(100), 6))
def test_an_exact_start_keeps_its_last_digit_wherever_the_loop_is_cut(seed: int) -> None:
    bar = FourBar(seed)
    other = JOINTS[1 + seed % 3]
    starts = {"crank_pivot": {"q": bar.angle, "use": "exact"}, other: {"q": round(bar.angles[other], 2), "use": "guess"}}
    r = started(bar.scene(starts, JOINTS[seed % 4]))
    found = r["crank_pivot.q[1]"][0]
    cut_here = JOINTS[seed % 4] == "crank_pivot"  # the angle of a cut joint is computed by an arctangent
    assert found == bar.angle or (cut_here and abs(found - bar.angle) <= 4 * np.spacing(1.0))
    assert not [n for n in r.notes if "moved" in n]


@pytest.mark.parametrize("seed", sampled(range(100), 6))
def test_a_guess_selects_the_branch(seed: int) -> None:
    bar = FourBar(seed)
    near = {n: {"q": round(a, 1), "use": "guess"} for n, a in bar.angles.items() if n != "crank_pivot"}
    r = started(bar.scene({"crank_pivot": {"q": bar.angle, "use": "exact"}, **near}))
    for name, angle in bar.angles.items():
        assert math.remainder(r[f"{name}.q[1]"][0] - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("cut", JOINTS)
def test_exact_starts_that_contradict_each_other_are_refused_by_name(cut: str) -> None:
    bar = FourBar(3)
    starts = {n: {"q": bar.angles[n] + d, "use": "exact"} for n, d in (("crank_pivot", 0.0), ("rocker_pivot", 0.1))}
    if cut in starts:
        with pytest.raises(SceneError, match=rf"joints\.{cut}\.start: the exact start"):
            simulate(bar.scene(starts, cut), until=1e-3, kernel="parts")
        return
    outcome = simulate(bar.scene(starts, cut), until=1e-3, kernel="parts").outcome
    assert outcome.name == "open_loop"
    assert "exact: crank_pivot, rocker_pivot" in outcome.advice


def test_a_point_out_of_reach_is_refused_with_its_distance() -> None:
    bar = FourBar(3)
    with pytest.raises(SceneError, match=r"bodies\.coupler\.start\.pen\[1\]: no pose .* stays [34]\.[0-9]+ m away"):
        simulate(bar.scene({}, point=[5.0, 0.0, 0.0]), until=1e-3)


def test_a_point_that_the_body_lacks_is_reported() -> None:
    bar = FourBar(3)
    scene = bar.scene({})
    scene["bodies"]["coupler"]["start"] = {"penn": [0, 0, 0]}
    with pytest.raises(SceneError, match=r'coupler has no point "penn" \(did you mean "pen"\?\)'):
        simulate(scene, until=1e-3)


def test_swept_start_positions_are_those_of_single_runs_and_have_derivatives() -> None:
    bar, path, last = FourBar(7), "bodies.coupler.start.pen[1]", "crank_pivot.q[1]"
    near = {n: {"q": a + 0.01, "use": "guess"} for n, a in bar.angles.items()}
    places = [float(bar.place[0]) + d for d in (-0.01, -1e-4, 0.0, 1e-4)]
    scenes = [bar.scene(near, None, [x, None, None]) for x in places]
    alone = [simulate(s, until=0.1, rtol=1e-10, kernel="parts")[last][-1] for s in scenes]
    swept = sweep(scenes[0], {path: places}, until=0.1, rtol=1e-10, kernel="parts", reductions=f"final:{last}").table
    np.testing.assert_allclose(swept[f"final:{last}"], alone, rtol=1e-12)
    found = sensitivity(scenes[2], [path], [last], until=0.1, rtol=1e-10)
    by_difference = (alone[3] - alone[1]) / 2e-4  # the error is about 1e-8, the square of the difference
    assert found.derivatives[-1, 0, 0] == pytest.approx(by_difference, rel=1e-5)


@pytest.mark.parametrize("seed", sampled(range(100), {0, 1, 72, 79, 92}))
def test_a_guess_next_to_the_straight_position_selects_the_side_in_every_world(seed: int) -> None:
    """Two links together are longer than the distance of their ends, so the elbow has two positions. The sign of the guess selects
    the position, also for guesses below 1e-5 rad, and whatever the axes of the world."""
    rng = np.random.default_rng(seed)
    length, sign = rng.uniform(0.5, 1.5), rng.choice([-1.0, 1.0])
    other, guess = length * rng.uniform(0.9, 1.1), float(sign * 10 ** rng.uniform(-6.0, -3.0))
    apart = (length + other) * rng.uniform(0.3, 0.9)
    link = {"mass": 1, "inertia": [0.1] * 3}
    bodies = {n: link | {"points": {"end": [far, 0, 0]}} for n, far in (("crank", length), ("rod", other))}
    hinge = {"type": "revolute", "axis": "z"}
    joints = {
        "pivot": hinge | {"inboard": "ground", "outboard": "crank", "start": {"q": 0.0, "use": "guess"}},
        "elbow": hinge | {"inboard": "crank.end", "outboard": "rod", "start": {"q": guess, "use": "guess"}},
        "end": hinge | {"inboard": {"body": "ground", "point": [apart, 0, 0]}, "outboard": "rod.end"},
    }
    scene = scene_from_dict({"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints, "outputs": ["elbow.q*"]})
    bend = math.acos((apart**2 - length**2 - other**2) / (2.0 * length * other))
    found = simulate(told(scene, "turned", seed), until=1e-9, every=1e-9)["elbow.q[1]"][0]
    assert found == pytest.approx(sign * bend, abs=1e-9)
