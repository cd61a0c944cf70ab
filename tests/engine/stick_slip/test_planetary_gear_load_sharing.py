"""Planets in parallel load the sun's bearing by a share that statics does not determine. The sun sticks, begins to slip and
continues to slip. At rest and in sliding, the loads of its bearing are those of stiff contacts. Therefore no load jumps, and every
start of sliding has a mode."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.default_case_selection import crossed
from tests.reference.scenes.epicyclic_trains import train
from tests.reference.scenes.random_device_scenes import crossed as crossed_scene
from trunnion import Scene, scene_from_dict, simulate
from trunnion.batch.plan_and_runner import Runner, plan
from trunnion.simulation.settings.run_settings import Run

NEAR = 1e-7
"""Time before and after an onset of slip, s. Within this time, loads change only slightly."""
FLOOR = 1e-6
"""Error of a run with rtol 1e-8, rad; the angles are of order 10."""
SMOOTH = (2e-5, 1e-5)
"""Speeds at which the smoothed law saturates, m/s. The error of its motion is proportional to this speed, so that two speeds give
the limit."""


def smoothed(scene: Scene, v_eps: float) -> Scene:
    """The train, with the smoothed friction law at the sun."""
    sun = scene.joints["rsun"]
    assert sun.friction is not None
    rubs = replace(sun.friction, law="regularized", v_eps=v_eps)
    return replace(scene, joints=scene.joints | {"rsun": replace(sun, friction=rubs)})


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("planets", [2, 3, 4])
def test_a_sun_held_by_its_bearing_slips_on(planets: int) -> None:
    slipped = 0
    for seed in range(5):
        r = simulate(scene_from_dict(train(seed, planets)))
        assert r.outcome.ok, (seed, r.outcome)
        slipped += any(e.kind == "slip" and e.joint == "rsun" for e in r.events)
    assert slipped >= 2


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("planets", [2, 4])
def test_loads_do_not_jump_where_the_sun_begins_to_slip(planets: int) -> None:
    found = 0
    for seed in range(4):
        scene = scene_from_dict(train(seed, planets))
        r = simulate(scene)
        for event in [e for e in r.events if e.kind == "slip" and e.joint == "rsun"][:1]:
            before, after = (
                simulate(scene, until=t, every=t, outputs=["rsun.contact*.normal_force"])
                for t in (event.time - NEAR, event.time + NEAR)
            )
            for name in (c.name for c in before.columns if c.name.startswith("rsun")):
                assert after[name][-1] == pytest.approx(before[name][-1], rel=1e-4), (seed, name)
                found += 1
    assert found >= 4


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_the_motion_is_the_limit_of_the_smoothed_law(seed: int) -> None:
    """Under the smoothed law the sun creeps instead of sticking. The angle of creep is about the largest speed at rest times the
    time at rest."""
    scene = scene_from_dict(train(seed, 3))
    exact = simulate(scene, rtol=1e-8)["rsun.q[1]"][-1]
    coarse, fine = (simulate(smoothed(scene, v), method="rosenbrock", rtol=1e-8)["rsun.q[1]"][-1] for v in SMOOTH)
    assert abs(fine - exact) < 0.6 * abs(coarse - exact) + FLOOR
    assert abs(2 * fine - coarse - exact) <= 0.05 * abs(coarse - exact) + FLOOR


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(
    ("seed", "planets", "preload", "method"), crossed(range(3), [2, 4], [0.0, 12.0], ["auto", "rk5", "rosenbrock"])
)
def test_a_brake_holds_an_unloaded_train_and_slips_at_its_torque(seed: int, planets: int, preload: float, method: str) -> None:
    """Without weight only the brake carries load while it holds. The other joints have the friction of an unloaded joint, so a
    share of this friction has no meaning. A preloaded pin holds more, by at most its own torque at the ring. With four planets, ten
    pairs share loads."""
    data = train(seed, planets)
    joints = data["joints"]
    for name, joint in joints.items():
        if name.startswith("rp"):
            joint["friction"] = {"mu": 0.2, "radius": 0.006, "half_length": 0.02}
        if joint["type"] == "gear" and name.startswith("gs"):
            joint["friction"] = {"mu": 0.07, "pressure_angle": 0.35}
    joints["rp0"]["friction"]["preload"] = preload
    joints["rring"] |= {"friction": {"torque": 0.3}, "effort": {"ramp": {"start": 0, "end": 1, "duration": 1}}}
    r = simulate(scene_from_dict(data | {"gravity": [0, 0, 0]}), method=method)
    assert r.outcome.ok
    slip = next(e.time for e in r.events if e.kind == "slip" and e.joint == "rring")
    assert slip >= 0.3 - 1e-9
    assert slip <= 0.3 + 1e-9 + (10 * preload * 0.2 * 0.006 if preload else 0.0)
    held = r.time < slip - 1e-6
    if not preload:
        assert abs(r["rsun.friction.torque[1]"][held]).max() <= 1e-9
        assert r["rring.friction.torque[1]"][held] == pytest.approx(r.time[held], abs=1e-9)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("seed", "until"), [(67, 0.25), (11, 0.7)])
def test_a_braked_train_starts_from_no_acceleration_at_one_instant_whatever_the_settings(seed: int, until: float) -> None:
    """The ring's brake reaches its torque, then the sun's bearing reaches its capacity. The search must not find loads that brace
    the train. Such loads would hold the train up to 1.5 ms longer."""
    scene = crossed_scene("planets", seed)
    starts, outputs = [], ["rring.qd[1]", "rring.qdd[1]"]
    for method in ("rk5", "rosenbrock"):
        r = simulate(scene, until=until, every=until, method=method, outputs=outputs)
        assert r.outcome.ok
        assert r.stats.events < 60  # this number includes decisions that only redistribute loads
        starts.append(next(e.time for e in r.events if (e.kind, e.joint) == ("slip", "rring")))
    assert starts[1] == pytest.approx(starts[0], abs=5e-6)
    if seed == 11:  # the weight acts along the axes: only the brake's torque opposes the effort
        ring = scene.joints["rring"]
        assert starts[0] == pytest.approx(ring.friction.torque.ramp.end / ring.effort.ramp.end, rel=1e-9)  # type: ignore[union-attr]
    ends = (starts[0] + 1e-5, starts[0] + 2e-3)
    just, later = (simulate(scene, until=t, every=t, outputs=outputs)["rring.qdd[1]"][-1] for t in ends)
    assert abs(just) < 0.05 * abs(later)


@pytest.mark.parametrize("kernel", ["parts", pytest.param("lanes", marks=pytest.mark.slow)])
def test_a_braked_train_yields_in_a_batch_as_alone(kernel: str) -> None:
    scene, gravities = crossed_scene("planets", 67), (-9.9, -9.7)
    settings = {"until": 0.25, "every": 0.05}
    cases = [{"gravity[2]": g} for g in gravities]
    batch = Runner(plan(scene, cases=cases, keep=("final:rring.qd[1]",), run=Run(**settings, kernel=kernel))).chunk(0, 2)
    for i, g in enumerate(gravities):
        alone = simulate(scene, overrides={"gravity[2]": g}, outputs=["rring.qd[1]"], **settings)
        assert sum(e.kind == "slip" for e in alone.events) == 2
        assert batch.column("final:rring.qd[1]")[i].as_py() == pytest.approx(alone["rring.qd[1]"][-1], rel=1e-9)
        assert batch.column("steps")[i].as_py() == alone.stats.steps
