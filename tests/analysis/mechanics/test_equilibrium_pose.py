"""Rest poses of a mechanism, and the ranges in which friction holds it, compared with closed-form statics of these poses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.analysis.mechanics.point_mass_chain import GRAVITY, chain
from tests.default_case_selection import sampled
from tests.reference.scenes.random_device_scenes import crossed
from trunnion import SceneError, SimulationError, equilibrium, load_scene, simulate
from trunnion.analysis.mechanics.equilibrium_pose import start_at
from trunnion.analysis.mechanics.mechanism_at_rest import remove_friction
from trunnion.scene.data_classes import scene as sm

CLOSE = 1e-8


def test_the_block_of_8_1_rests_within_the_cone_of_its_ball() -> None:
    """m g L sin θ = μ/√(1 + μ²) r m g is the limit about every level axis. About the vertical axis the body rests at any angle."""
    scene = load_scene("spherical_pendulum")
    mu, radius = scene.joints["ball"].friction.mu, scene.joints["ball"].friction.radius
    edge = np.arcsin(mu / np.hypot(1.0, mu) * radius / scene.bodies["pendulum"].center[0])
    found = equilibrium(scene)
    assert found.kind == "neutral"
    bands = {b.coordinate: b for b in found.bands}
    free = [b for b in bands.values() if b.low is None]
    assert [b.high for b in free] == [None]
    for b in bands.values():
        if b.low is not None and b.high is not None:
            assert (-b.low, b.high) == (pytest.approx(edge, abs=CLOSE), pytest.approx(edge, abs=CLOSE))


@pytest.mark.parametrize("law", ["coulomb", "stribeck"])
def test_a_bar_on_a_pin_rests_where_its_weight_turns_it_less_than_friction(law: str) -> None:
    """The limit is m g L/2 sin q = μ_s/√(1 + μ_s²) r m g: the two contacts of a journal share the weight."""
    mu, radius, length = 0.4, 0.02, 0.6
    speed = 0.01 if law == "stribeck" else None
    rub = sm.Friction(mu=0.3, mu_static=mu, radius=radius, half_length=0.03, law=law, v_stribeck=speed)
    body = sm.Body(box=(length, 0.05, 0.05), mass=2.0, center=(length / 2, 0.0, 0.0))
    pin = sm.Joint("revolute", "ground", "bar", axis="y", friction=rub, start=sm.Start(q=0.2))
    found = equilibrium(sm.Scene({"bar": body}, {"pin": pin}, "bar"))
    edge = np.arcsin(mu / np.hypot(1.0, mu) * radius / (length / 2))
    assert found.q["pin"] == pytest.approx([np.pi / 2], abs=CLOSE)
    [band] = found.bands
    assert (band.low, band.high) == (pytest.approx(np.pi / 2 - edge, abs=CLOSE), pytest.approx(np.pi / 2 + edge, abs=CLOSE))


def pinned(torque: float, **joint: Any) -> sm.Scene:
    """A pendulum with m g l = 0.981 N m on a pin whose friction is a torque."""
    bob = sm.Body(mass=1.0, center=(0.0, -0.1, 0.0), inertia=(0.01, 0.01, 0.01))
    pin = sm.Joint("revolute", "ground", "bob", axis="z", friction=sm.Friction(torque=torque), **joint)
    return sm.Scene({"bob": bob}, {"pin": pin}, gravity=(0.0, -9.81, 0.0))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("below", [0.3, 1e-2, 1.5e-3, 1e-5, 1e-8])
def test_friction_just_too_weak_to_hold_a_pendulum_everywhere_has_a_band_with_ends(below: float) -> None:
    """The band about the lower pose ends where m g l sin q equals the torque. Near the top, friction holds the pendulum again."""
    (band,) = equilibrium(pinned(0.981 * (1.0 - below))).bands
    end = np.arcsin(1.0 - below)
    near = 1e-12 / np.cos(end)  # round-off of the share, divided by its slope over the angle
    assert (band.low, band.high) == (pytest.approx(-end, abs=near), pytest.approx(end, abs=near))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("end", [0.2, 3.0, 3.5, 5.0, 6.2])
def test_a_band_ends_at_any_angle_up_to_a_turn(end: float) -> None:
    scene = replace(pinned(2.0 * end, spring=sm.Spring(stiffness=2.0)), gravity=(0.0, 0.0, 0.0))
    (band,) = equilibrium(scene).bands
    assert (band.low, band.high) == (pytest.approx(-end, rel=1e-12), pytest.approx(end, rel=1e-12))


def test_a_loop_stays_at_its_computed_rest() -> None:
    scene = load_scene("crank_slider_free")
    found = equilibrium(scene)
    assert found.kind == "stable"
    bare = replace(scene, joints={n: replace(j, friction=None) for n, j in scene.joints.items()})
    r = simulate(start_at(bare, {n: np.array(v) for n, v in found.q.items()}), until=2.0, outputs=("*.q[*]",))
    for name, values in found.q.items():
        assert r[f"{name}.q[1]"] == pytest.approx(np.full(len(r), values[0]), abs=1e-9)


def test_a_chain_let_go_hangs_straight_down() -> None:
    found = equilibrium(chain(4, start=1.0))
    assert found.kind == "stable"
    assert np.array(list(found.q.values())) == pytest.approx(np.zeros((4, 1)), abs=1e-9)


def test_a_spring_carries_by_hooke() -> None:
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=3.0)
    guide = sm.Joint("prismatic", "ground", "block", axis="z", spring=sm.Spring(500.0, 0.1))
    found = equilibrium(sm.Scene({"block": body}, {"guide": guide}, "hung"))
    assert found.q["guide"] == pytest.approx([0.1 - 3.0 * GRAVITY / 500.0], rel=1e-10)


def test_energy_is_least_where_a_tree_of_springs_rests() -> None:
    """Three joints with springs under gravity. The reference minimises an independently written potential energy."""
    n, stiff = 3, (3.0, 2.0, 1.0)
    scene = chain(n, start=0.4)
    joints = {k: replace(j, spring=sm.Spring(s, 0.5)) for (k, j), s in zip(scene.joints.items(), stiff, strict=True)}
    found = equilibrium(replace(scene, joints=joints))

    def energy(q: np.ndarray) -> float:
        heights = -np.cumsum(np.cos(np.cumsum(q)))
        return float(2.0 * GRAVITY * heights.sum() + 0.5 * np.array(stiff) @ (q - 0.5) ** 2)

    best = minimize(energy, np.zeros(n), method="BFGS", options={"gtol": 1e-11})
    assert np.array([v[0] for v in found.q.values()]) == pytest.approx(best.x, abs=1e-7)  # the precision of the minimiser


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(8))
def test_blocks_on_rails_rest_against_stiff_stops_by_hooke(seed: int) -> None:
    """Each rail carries the next rail. The load, spring and stop of a rail act only along this rail. Loads have their values at t =
    0."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    load, spring, stop = rng.uniform(-20, 20, n), rng.uniform(50, 500, n), 10 ** rng.uniform(3, 6, n)
    limit = rng.uniform(0.005, 0.02, n)
    bodies = {f"b{i}": sm.Body(mass=float(rng.uniform(0.1, 5.0)), inertia=(1.0, 1.0, 1.0)) for i in range(n)}
    joints = {}
    for i in range(n):
        ends = sm.EndStops(stiffness=float(stop[i]), lower=-float(limit[i]), upper=float(limit[i]), damping=0.2)
        effort = sm.Signal(ramp=sm.Ramp(float(load[i]), -float(load[i]), duration=0.1))
        inboard = "ground" if i == 0 else f"b{i - 1}"
        spring_of = sm.Spring(stiffness=float(spring[i])) if i else None
        joints[f"r{i}"] = sm.Joint("prismatic", inboard, f"b{i}", axis="x", end_stops=ends, effort=effort, spring=spring_of)
    found = equilibrium(sm.Scene(bodies, joints, "blocks", gravity=(0.0, 0.0, 0.0)), along=())
    for i in range(n):
        k = spring[i] if i else 0.0
        depth = max(0.0, (abs(load[i]) - k * limit[i]) / (k + stop[i]))
        expected = np.sign(load[i]) * (limit[i] + depth) if depth else load[i] / k
        assert found.q[f"r{i}"] == pytest.approx([expected], abs=1e-9)


def test_friction_does_not_hold_a_pose_in_which_a_frictionless_joint_falls() -> None:
    """A pendulum on a slider: friction holds the slider only where the pendulum hangs."""
    bob = sm.Body(mass=1.0, center=(0.0, -0.1, 0.0), inertia=(0.01, 0.01, 0.01))
    guide = sm.Joint("prismatic", "ground", "slider", axis="x", friction=sm.Friction(force=20.0))
    pin = sm.Joint("revolute", "slider", "bob", axis="z", start=sm.Start(q=0.5))
    bodies = {"slider": sm.Body(mass=1.0, inertia=(0.1, 0.1, 0.1)), "bob": bob}
    found = equilibrium(sm.Scene(bodies, {"guide": guide, "pin": pin}, gravity=(0.0, -9.81, 0.0)))
    assert found.around == ()
    assert found.bands[0].low is None


def test_a_falling_body_has_no_pose_of_rest() -> None:
    free = sm.Scene({"b": sm.Body(sphere=0.1, mass=1.0)}, {"j": sm.Joint("free", "ground", "b")}, "falls")
    with pytest.raises(SimulationError, match="no pose of rest"):
        equilibrium(free)
    with pytest.raises(SceneError, match="no joint"):
        equilibrium(chain(2), along="elbow")


@pytest.mark.parametrize("share", [0.5, 0.97, 1.03, 2.0, -1.5])
def test_a_pendulum_that_a_torque_turns_over_its_top_has_no_pose_of_rest(share: float) -> None:
    """share: torque relative to the largest moment of the weight, m g l. Below it, the pendulum rests at its arc sine."""
    made = pinned(1.0, effort=0.981 * share)
    turned = replace(made, joints={"pin": replace(made.joints["pin"], friction=None)})
    if abs(share) < 1.0:
        assert equilibrium(turned).q["pin"] == pytest.approx([np.arcsin(share)], abs=CLOSE)
    else:
        with pytest.raises(SimulationError, match="turns on and on"):
            equilibrium(turned)


@pytest.mark.parametrize("held", ["spring", "end_stops"])
def test_a_wheel_rests_after_many_turns_where_a_spring_or_a_stop_holds_it(held: str) -> None:
    wheel = sm.Body(mass=1.0, inertia=(0.01, 0.01, 0.01))
    holder: dict[str, Any] = {"spring": sm.Spring(0.01)} if held == "spring" else {"end_stops": sm.EndStops(2000.0, upper=100.0)}
    pin = sm.Joint("revolute", "ground", "wheel", axis="z", effort=1.0, **holder)
    q = equilibrium(sm.Scene({"wheel": wheel}, {"pin": pin})).q["pin"]
    assert q == pytest.approx([100.0 if held == "spring" else 100.0005], abs=CLOSE)


def _ends(bands: Any) -> list[tuple[float | None, float | None]]:
    return [(b.low, b.high) for b in bands]


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("seed", range(60))
def test_bands_about_the_given_pose_and_the_unstable_rest_of_a_pendulum_end_where_its_weight_overcomes_friction(seed: int) -> None:
    """m g l |sin(q − q₀)| = torque, with q₀ along gravity. Given poses lie 1e-6 rad inside and outside of the bands."""
    rng = np.random.default_rng(seed)
    down, share, near = float(rng.uniform(-1, 1)), float(rng.uniform(0.02, 0.98)), float(rng.choice([-1e-6, 1e-6]))
    half, top, side = float(np.arcsin(share)), bool(rng.random() < 0.5), float(rng.choice([-1, 1]))
    middle = down + np.pi * top
    scene = pinned(0.981 * share, start=sm.Start(q=middle + side * (half + near)))
    scene = replace(scene, gravity=(9.81 * float(np.sin(down)), -9.81 * float(np.cos(down)), 0.0))
    found = equilibrium(scene)
    turn = 2 * np.pi * round((found.q["pin"][0] - down) / (2 * np.pi))
    assert _ends(found.bands) == [pytest.approx((down + turn - half, down + turn + half), abs=1e-9)]
    assert _ends(found.around) == ([pytest.approx((middle - half, middle + half), abs=1e-9)] if near < 0 else [])
    (other,) = found.others
    turn = 2 * np.pi * round((other.q["pin"][0] - down) / (2 * np.pi) - 0.4)
    assert (other.kind, other.q["pin"][0]) == ("unstable", pytest.approx(down + np.pi + turn, abs=1e-9))
    assert _ends(other.bands) == [pytest.approx((down + np.pi + turn - half, down + np.pi + turn + half), abs=1e-9)]


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("seed", range(40))
def test_a_block_on_a_slope_is_held_everywhere_or_falls(seed: int) -> None:
    """Without friction, the block has no rest pose. Just below the slope tan α = μ, friction holds the block in every position."""
    rng = np.random.default_rng(seed)
    mu, more, size = float(rng.uniform(0.05, 1.0)), float(rng.choice([-1e-6, 1e-6])), float(rng.uniform(0.02, 0.1))
    slope = np.arctan(mu) * (1 + more)
    rub = sm.Friction(mu=mu, half_width=size, half_height=size, half_length=2 * size)
    rail = sm.Joint("prismatic", "ground", "block", axis="x", friction=rub, start=sm.Start(q=float(rng.uniform(-1, 1)) * size))
    gravity = (9.81 * float(np.sin(slope)), 0.0, -9.81 * float(np.cos(slope)))
    scene = sm.Scene({"block": sm.Body(mass=2.0, inertia=(0.1, 0.1, 0.1))}, {"rail": rail}, gravity=gravity)
    if more > 0:
        with pytest.raises(SimulationError, match="no pose of rest"):
            equilibrium(scene)
        return
    found = equilibrium(scene)
    assert (found.kind, found.q["rail"], found.bands, found.others) == ("none", (rail.start.q,), (), ())
    assert _ends(found.around) == [(None, None)]


def test_a_double_pendulum_has_three_unstable_rests() -> None:
    found = equilibrium(chain(2, start=0.3))
    up = sorted(tuple(round(abs(v[0]) / np.pi) % 2 for v in o.q.values()) for o in found.others)
    assert up == [(0, 1), (1, 0), (1, 1)]
    assert {o.kind for o in found.others} == {"unstable"}


LOOPS = [("five_bars", 0, "j4"), ("grippers", 0, "fa"), ("screw_levers", 4, "turn"), ("freewheels_in_four_bars", 0, "j3"),
         ("five_bars", 1, "j4"), ("five_bars", 3, "j4"), ("grippers", 2, "fa"), ("worm_drives", 0, "j3")]  # fmt: skip
"""Random mechanisms whose loops are cut at other joints without friction, and a joint of each."""


@pytest.mark.parametrize(("family", "seed", "joint"), sampled(LOOPS, 2))
def test_the_range_of_rest_about_a_random_loops_pose_contains_this_pose(family: str, seed: int, joint: str) -> None:
    """Without friction, the mechanism is at rest in the reported pose. The reported pose stays the same while further poses are
    sought."""
    scene = crossed(family, seed)
    found = equilibrium(scene, along=joint)
    [band], [at] = found.bands, found.q[joint]
    assert band.low is None or band.low <= at + CLOSE
    assert band.high is None or band.high >= at - CLOSE
    run = simulate(start_at(remove_friction(scene), found.q), until=1e-6, every=1e-6)
    assert max(abs(run[c][0]) for c in run.matching("*.qdd[*]")) < 1e-4
