"""A latch falls behind a part that has passed it, and then holds the part like an end stop. A signal, an input or too large a force
releases the part."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

KERNELS = ("parts", "compiled")
MASS, PULL, AT, STIFF = 2.0, 6.0, 0.3, 4e4
CLOSE = 1e-9


def thrown(latch: sm.Latch, speed: float = 3.0, pull: float = PULL, **more) -> sm.Scene:
    """A block on a rail that is thrown past a latch against a constant pull."""
    rail = sm.Joint("prismatic", "ground", "b", axis="x", latch=latch, effort=-pull, start=sm.Start(q=0.0, qd=speed))
    return sm.Scene({"b": sm.Body(mass=MASS, inertia=(1.0, 1.0, 1.0))}, {"j": rail}, "latch", gravity=(0.0, 0.0, 0.0), **more)


def kinds(r: Result) -> list[tuple[str, float]]:
    assert r.outcome.ok
    return [(e.kind, e.time) for e in r.events if e.kind in ("latch", "unlatch")]


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_hook_falls_without_force_as_the_body_passes_and_catches_its_return(kernel: str) -> None:
    """The body moves up and down freely, reaches the latch with its first speed, swings half a period on the latch's spring, and
    rises again."""
    r = simulate(thrown(sm.Latch(at=AT, stiffness=STIFF)), until=6.0, rtol=1e-10, kernel=kernel)
    a = PULL / MASS
    speed = np.sqrt(9.0 - 2 * a * AT)
    passed, back = (3.0 - speed) / a, (3.0 + speed) / a
    assert kinds(r) == [("latch", pytest.approx(passed, abs=CLOSE))]
    on = [e.time for e in r.events if e.kind == "end_stop_engaged"]
    w = np.sqrt(STIFF / MASS)
    swing = (np.pi + 2 * np.arctan(a / (w * speed))) / w
    again = back + swing + 2 * speed / a
    assert on[:2] == pytest.approx([back, again], abs=1e-8)
    energy = r["energy.kinetic"] + r["energy.potential"] + PULL * r["j.q[1]"]
    assert np.abs(energy - energy[0]).max() <= 1e-8 * energy[0]  # no energy is lost, even as the hook falls
    down = r.time < back
    assert np.abs(r["j.latch.effort[1]"][down]).max() == 0.0
    assert r["j.latch.state[1]"] == pytest.approx((r.time > passed).astype(float))
    assert r["j.q[1]"][~down].min() >= AT - np.sqrt(MASS / STIFF) * speed * 1.01


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_damped_block_comes_to_rest_on_its_hook_and_is_released_on_time(kernel: str) -> None:
    """At rest the hook carries the pull. After the release, the block falls from its position as without a hook."""
    let_go = sm.Signal(table=sm.Table((0.0, 20.0, 21.0), (0.0, 0.0, 1.0)))
    r = simulate(thrown(sm.Latch(AT, STIFF, damping=5.0, release=let_go)), until=21.0, every=0.01, rtol=1e-10, kernel=kernel)
    latched, unlatched = kinds(r)
    assert (latched[0], *unlatched) == ("latch", "unlatch", pytest.approx(20.5, abs=CLOSE))
    row = int(np.searchsorted(r.time, 20.4))
    assert r["j.latch.effort[1]"][row] == pytest.approx(PULL, rel=1e-6)
    assert r["j.q[1]"][row] == pytest.approx(AT - PULL / STIFF, abs=1e-7)
    t = r.time[-1] - 20.5
    assert r["j.q[1]"][-1] == pytest.approx(AT - PULL / STIFF - PULL / MASS * t**2 / 2, abs=1e-6)
    assert np.abs(r["energy.residual"]).max() <= 1e-7 * r["energy.kinetic"].max()
    assert r.audit.verdict == "within"


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_hook_releases_under_too_large_a_load(kernel: str) -> None:
    """A pull that grows by 1 N/s releases the hook at 10 N. The oscillation on the hook changes this force by 1 N/s over √(k/m)."""
    grows = sm.Signal(ramp=sm.Ramp(0.0, -100.0, duration=100.0))
    scene = thrown(sm.Latch(AT, STIFF, damping=5.0, holds=10.0))
    scene = replace(scene, joints={"j": replace(scene.joints["j"], effort=grows, start=sm.Start(q=AT))})
    r = simulate(scene, until=14.0, every=0.01, rtol=1e-9, kernel=kernel)
    # 2e-3 s, because the hook's damping adds a force
    assert kinds(r) == [("unlatch", pytest.approx(10.0, abs=1.0 / np.sqrt(STIFF / MASS) + 2e-3))]
    assert r["j.q[1]"][-1] < 0.0
    again = simulate(replace(scene, joints={"j": replace(scene.joints["j"], latch=sm.Latch(AT, STIFF, damping=5.0))}), until=14.0)
    assert kinds(again) == []
    assert again["j.latch.state[1]"].min() == 1.0  # the part starts behind the hook, which is down


def test_a_latch_that_keeps_below_is_a_mirror_image_and_a_lifted_hook_lets_pass() -> None:
    up = simulate(thrown(sm.Latch(AT, STIFF, damping=1.0)), until=3.0, rtol=1e-9)
    scene = thrown(sm.Latch(-AT, STIFF, keeps="below", damping=1.0), speed=-3.0, pull=-PULL)
    down = simulate(scene, until=3.0, rtol=1e-9)
    assert down["j.q[1]"] == pytest.approx(-up["j.q[1]"], abs=1e-9)
    lifted = thrown(sm.Latch(AT, STIFF, release=sm.FromInput("button")), inputs={"button": sm.Input(start=1.0)})
    free = simulate(lifted, until=3.0)
    assert kinds(free) == []
    assert free["j.q[1]"][-1] == pytest.approx(3.0 * 3.0 - PULL / MASS * 9.0 / 2, abs=1e-6)


@pytest.mark.parametrize("method", ["rk5", "rosenbrock", "moreau"])
def test_the_body_ends_on_the_hook_by_every_kind_of_method(method: str) -> None:
    r = simulate(thrown(sm.Latch(AT, STIFF, damping=5.0)), until=10.0, every=10.0, method=method)
    assert r["j.q[1]"][-1] == pytest.approx(AT - PULL / STIFF, abs=1e-6)
    assert [k for k, _ in kinds(r)] == ["latch"]


def test_a_latch_in_a_loop_acts_alike_in_both_kernels() -> None:
    scene = trunnion.scene.load_scene("crank_slider_free")  # type: ignore[attr-defined]
    joints = {n: replace(j, latch=sm.Latch(0.1, 1e3, damping=0.1, holds=5.0)) if j.type == "prismatic" else j
              for n, j in scene.joints.items()}  # fmt: skip
    caught = replace(scene, joints=joints)
    assert any(j.latch for j in joints.values())
    for s in (thrown(sm.Latch(AT, STIFF, damping=5.0, holds=10.0, release=sm.FromInput("b")), inputs={"b": sm.Input()}), caught):
        agree(s)
        derivatives_agree(s)


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("method", ["auto", "rk5", "rk8", "rosenbrock", "moreau"])
@pytest.mark.parametrize("seed", range(4))
def test_a_hook_that_lifts_while_its_joint_sticks_lets_it_slide_off(seed: int, method: str) -> None:
    """After the release, either the equation is J q̈ = effort − friction, or friction holds the remaining load."""
    rng = np.random.default_rng(seed)
    effort, friction, inertia = rng.uniform(1.0, 3.0), rng.uniform(0.05, 0.9), rng.uniform(1e-4, 1e-2)
    lifts = {"ramp": {"start": 0, "end": 1, "duration": 0.2, "begin": 0.3}}
    latch = {"at": 0, "stiffness": 100, "keeps": "below", "down": True, "release": lifts}
    joint = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "w", "effort": effort, "latch": latch,
             "friction": {"torque": friction * effort}, "damping": 0.0, "start": {"q": effort / 100}}  # fmt: skip
    scene = {"schema": 1, "gravity": [0, 0, 0], "bodies": {"w": {"mass": 1, "inertia": [inertia] * 3}}, "joints": {"r": joint}}
    run = trunnion.simulate(trunnion.scene_from_dict(scene), until=0.5, method=method, outputs=["r.q[1]", "r.qd[1]"])
    assert run.outcome.name == "done"
    close = 1e-3 if method == "moreau" else 1e-6
    assert run["r.qd[1]"][-1] == pytest.approx(effort * (1 - friction) / inertia * 0.1, rel=close)


def narrow_pass(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    """A slider that passes a hook. A signal has lowered the hook shortly before, or lowers it only briefly, by a dip below the
    level of release."""
    speed, passes = rng.uniform(0.5, 2.0), rng.uniform(0.3, 0.7)
    falls = passes - rng.uniform(1e-3, 0.08)
    if kind == "ramp":
        duration = rng.uniform(0.05, 0.4)
        release = {"ramp": {"start": 1, "end": 0, "duration": duration, "begin": falls - duration / 2}}
    elif kind == "table":
        times = [0.0, falls - 0.05, falls, falls + 0.3, 3.0]
        release = {"table": {"time": times, "value": [1, 1, 0.5, 0, 0], "interpolation": "linear"}}
    else:  # the signal is below 0.5 where cos 2π f (t − middle) > 1 − dip
        frequency, dip, middle = rng.uniform(1.0, 3.0), 10 ** rng.uniform(-4.0, -1.0), passes
        passes = middle + rng.uniform(-0.5, 0.9) * np.arccos(1.0 - dip) / (2 * np.pi * frequency)
        phase = 1.5 * np.pi - 2 * np.pi * frequency * middle
        release = {"harmonic": {"amplitude": 1.0, "frequency": frequency, "phase": phase, "offset": 1.5 - dip}}
    latch = {"at": speed * passes, "stiffness": 1e4, "keeps": "below", "release": release}
    rail = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "b", "start": {"qd": speed}, "latch": latch}
    return {"schema": 1, "gravity": [0, 0, 0], "bodies": {"b": {"mass": 1, "inertia": [1, 1, 1]}}, "joints": {"p": rail}}


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", ["auto", "rk5", "rk8", "rosenbrock", "moreau"])
@pytest.mark.parametrize("kind", ["ramp", "harmonic", "table"])
def test_a_hook_that_falls_just_before_a_part_passes_is_found_by_every_method(kind: str, method: str) -> None:
    for seed in range(8):
        scene = trunnion.scene_from_dict(narrow_pass(np.random.default_rng(seed), kind))
        for rtol in (1e-4, 1e-7):
            run = simulate(scene, until=1.5, method=method, rtol=rtol, outputs=["p.q[1]"])
            assert "end_stop_engaged" in [e.kind for e in run.events], (seed, rtol)
