"""A latch with a pitch is a ratchet. It falls behind every tooth that passes and gives back at most one pitch. Under too large a
load it slips back by one tooth. In random mechanisms, latches keep the parts that they have caught."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.devices.test_latches import AT, KERNELS, MASS, PULL, STIFF, thrown
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.reference.scenes.random_device_scenes import crossed
from tests.reference.scenes.random_scenes import random_tree
from trunnion import equilibrium, modes
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

PITCH = 0.2
TEETH = sm.Latch(AT, STIFF, pitch=PITCH)
RATE = PULL / MASS
TOP = 3.0**2 / (2 * RATE)


def passes(height: np.ndarray) -> np.ndarray:
    """Time at which a body thrown up at 3 m/s reaches a height."""
    return (3.0 - np.sqrt(9.0 - 2 * RATE * height)) / RATE


def times(r: Result, kind: str) -> list[float]:
    assert r.outcome.ok
    return [e.time for e in r.events if e.kind == kind]


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_pawl_falls_behind_every_tooth_that_passes_and_catches_the_last(kernel: str) -> None:
    """The body moves up freely, past a tooth at each pitch. It then falls by less than a pitch onto the last tooth, and hits it
    with the speed of the fall."""
    r = simulate(thrown(TEETH), until=2.0, every=1e-3, rtol=1e-10, kernel=kernel)
    teeth = AT + PITCH * np.arange(int((TOP - AT) / PITCH) + 1)
    assert times(r, "latch") == pytest.approx(passes(teeth), abs=1e-9)
    assert not times(r, "unlatch")
    back = 3.0 / RATE + np.sqrt(2 * (TOP - teeth[-1]) / RATE)
    assert times(r, "end_stop_engaged")[0] == pytest.approx(back, abs=1e-8)
    assert r["j.latch.state[1]"] == pytest.approx([float(np.sum(passes(teeth) < t)) if t < 1 else len(teeth) for t in r.time])
    assert np.abs(r["j.latch.effort[1]"][r.time < back]).max() == 0.0
    energy = r["energy.kinetic"] + r["energy.potential"] + PULL * r["j.q[1]"]
    assert np.abs(energy - energy[0]).max() <= 1e-8 * energy[0]


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_body_under_too_strong_a_pull_slips_tooth_by_tooth_and_is_free_below_the_first(kernel: str) -> None:
    """The pull exceeds the capacity of a tooth. On each tooth, the body slips at the corresponding depth and loses the energy that
    the tooth stored."""
    holds = 0.9 * PULL
    r = simulate(thrown(replace(TEETH, holds=holds)), until=4.0, rtol=1e-9, kernel=kernel)
    caught = int((TOP - AT) / PITCH) + 1
    assert len(times(r, "unlatch")) == caught
    assert len(times(r, "latch")) == caught + caught - 1  # each tooth on the way up, and each but the last on the way down
    assert r["j.latch.state[1]"][-1] == 0.0
    assert r["j.q[1]"][-1] < AT
    depth = holds / STIFF
    rows = r.time > times(r, "unlatch")[-1]
    spent = 0.5 * MASS * 9.0 - (r["energy.kinetic"] + PULL * r["j.q[1]"])[rows]
    assert spent == pytest.approx(np.full(rows.sum(), 0.5 * STIFF * depth**2 * caught), rel=1e-5)
    assert r.audit.verdict == "within"


def test_a_ratchet_that_keeps_below_is_the_mirror_image_of_one_that_keeps_above() -> None:
    latch = replace(TEETH, damping=1.0)
    up = simulate(thrown(latch), until=3.0, rtol=1e-9)
    down = simulate(thrown(replace(latch, at=-AT, keeps="below"), speed=-3.0, pull=-PULL), until=3.0, rtol=1e-9)
    assert down["j.q[1]"] == pytest.approx(-up["j.q[1]"], abs=1e-9)
    assert down["j.latch.state[1]"] == pytest.approx(up["j.latch.state[1]"])


@pytest.mark.parametrize("method", ["rk5", "rosenbrock", "moreau"])
def test_the_body_ends_on_the_last_tooth_by_every_kind_of_method(method: str) -> None:
    r = simulate(thrown(replace(TEETH, damping=5.0)), until=10.0, every=10.0, method=method)
    assert r["j.q[1]"][-1] == pytest.approx(AT + 5 * PITCH - PULL / STIFF, abs=1e-6)
    assert r["j.latch.state[1]"][-1] == 6.0


def test_a_pawl_that_is_let_down_again_catches_at_the_tooth_behind() -> None:
    lifted = sm.Signal(table=sm.Table((0.0, 0.8, 0.9, 1.4, 1.5, 9.0), (0.0, 0.0, 1.0, 1.0, 0.0, 0.0)))
    r = simulate(thrown(replace(TEETH, damping=5.0, release=lifted)), until=9.0, rtol=1e-9)
    at = 3.0 * 1.45 - RATE * 1.45**2 / 2  # the position at which the pawl comes down
    tooth = int((at - AT) / PITCH) + 1
    assert tooth < 6
    assert r["j.latch.state[1]"][-1] == tooth
    assert r["j.q[1]"][-1] == pytest.approx(AT + (tooth - 1) * PITCH - PULL / STIFF, abs=1e-7)


def test_a_body_on_a_tooth_rests_and_oscillates_there() -> None:
    """An analysis of rest that starts from this state finds the same tooth. A start behind several teeth is held by the last of
    them."""
    scene = thrown(replace(TEETH, damping=1.0))
    joint = replace(scene.joints["j"], effort=None)
    hung = replace(scene, joints={"j": replace(joint, start=sm.Start(q=AT + 3.4 * PITCH))}, gravity=(-RATE, 0.0, 0.0))
    assert simulate(hung, until=0.1)["j.latch.state[1]"].tolist()[:2] == [4.0, 4.0]
    found = modes(hung)
    assert found.q["j"][0] == pytest.approx(AT + 3 * PITCH - PULL / STIFF, abs=1e-9)
    swing = np.sqrt(STIFF / MASS - (PULL / (2 * MASS)) ** 2)  # PULL is the load, and a damping of 1 s/m gives PULL N s/m
    assert [m.frequency for m in found.modes] == pytest.approx([swing / (2 * np.pi)], rel=1e-7)
    assert equilibrium(hung).kind == "stable"


def test_both_kernels_agree_about_teeth() -> None:
    agree(thrown(replace(TEETH, damping=5.0, holds=10.0, release=sm.FromInput("b")), inputs={"b": sm.Input()}))


def hooked(seed: int, pitch: float | None) -> tuple[sm.Scene, str, float]:
    """A random tree of sliding and turning parts. A latch is just ahead of a random part, in a random direction."""
    types = ("revolute", "prismatic", "spherical", "universal")
    case = random_tree(f"hook{seed}", types=types, friction=0.0, devices=0.0, drives=0.0)
    name = next((n for n, j in case.scene.joints.items() if j.type in ("revolute", "prismatic")), "")
    if not name:
        return hooked(seed + 100, pitch)
    joints = {}
    for n, j in case.scene.joints.items():
        starts = [tuple(map(float, x)) if len(x) != 1 else float(x[0]) for x in (case.q[n], case.qd[n])]
        joints[n] = replace(j, start=sm.Start(*starts))
    way = float(np.sign(case.qd[name][0]))
    latch = sm.Latch(float(case.q[name][0]) + 0.01 * way, 1e5, keeps="above" if way > 0 else "below", pitch=pitch)
    return replace(case.scene, joints=joints | {name: replace(joints[name], latch=latch)}), name, way


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("pitch", [None, 0.05])
@pytest.mark.parametrize("seed", range(6))
def test_a_latch_of_any_mechanism_keeps_what_has_passed_it_and_takes_no_energy(seed: int, pitch: float | None) -> None:
    """In every row the tooth is the last tooth passed so far. The part is never further back than the spring of this tooth allows,
    and the force of the tooth is proportional to the depth. The energy stays constant."""
    scene, name, way = hooked(seed, pitch)
    latch = scene.joints[name].latch
    r = simulate(scene, until=0.6, every=2e-4, rtol=1e-9, kernel="parts")
    assert r.outcome.ok, r.outcome
    past = way * (r[f"{name}.q[1]"] - latch.at)
    tooth = np.where(np.maximum.accumulate(past) < 0, 0, 1 + np.floor(np.maximum.accumulate(past) / pitch) if pitch else 1)
    state = r[f"{name}.latch.state[1]"]
    # between two rows, the body may pass one more tooth at its highest point
    assert np.mean(state == tooth) > 0.99 or np.all(state >= tooth)
    assert state.max() >= 1.0
    on = way * (r[f"{name}.q[1]"] - latch.at) - np.maximum(state - 1, 0) * (pitch or 0.0)
    force = np.where((state > 0) & (on < 0), -latch.stiffness * on, 0.0)
    assert way * r[f"{name}.latch.effort[1]"] == pytest.approx(force, abs=1e-6 * max(force.max(), 1.0) + 1e-6)
    assert np.abs(r["energy.residual"]).max() <= 1e-6 * max(r["energy.kinetic"].max(), 1.0)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", ["auto", "rk5", "rosenbrock"])
@pytest.mark.parametrize("seed", [0, 3])
def test_in_a_loop_a_pawl_passes_every_tooth_once(seed: int, method: str) -> None:
    """The closure of a loop shifts the state of an event by the step's error, possibly to before the tooth. The pawl must not be
    lifted again by this shift."""
    r = simulate(crossed("ratchets_in_loops", seed), method=method, outputs=["j3.q*", "j3.latch.state*"])
    assert r.outcome.ok
    clicks = [e.time for e in r.events if e.joint == "j3" and (e.kind in ("latch", "unlatch") or e.kind.startswith("end_stop"))]
    assert len(clicks) > 4
    assert np.diff(clicks).min() > 1e-4
