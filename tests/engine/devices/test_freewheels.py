"""Freewheels turn freely in one direction. In the other direction they hold up to their capacity, like set-valued friction of two
sizes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import trunnion
from tests.engine.friction.test_preload_friction import GRAVITY, LENGTH, MASS, WEIGHT, bar
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

KERNELS = ("parts", "compiled")
EDGE = 1e-6
DRAG, GRIP = 0.2, 50.0


def wheel(effort: object, start: float = 0.0, **rub: float) -> sm.Scene:
    """A flywheel of 0.5 kg m² on a freewheel."""
    friction = sm.Friction(**{"torque": DRAG, "back_torque": GRIP, **rub})
    joint = sm.Joint("revolute", "ground", "wheel", axis="z", friction=friction, effort=effort, start=sm.Start(qd=start))
    return sm.Scene({"wheel": sm.Body(mass=2.0, inertia=(0.3, 0.3, 0.5))}, {"hub": joint}, "hub")


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("law", ["coulomb", "stribeck"])
def test_a_freewheel_overruns_and_holds_up_to_its_limit(kernel: str, law: str) -> None:
    more = {"law": law, "mu": 1.0, "mu_static": 1.0, "v_stribeck": 1.0} if law == "stribeck" else {}
    for edge, sense in ((DRAG, 1), (GRIP, -1)):
        for share in (1 - EDGE, 1 + EDGE):
            scene = wheel(sense * share * edge, **more)
            r = simulate(scene, until=1.0, every=0.1, kernel=kernel)
            assert np.sign(r["hub.q[1]"][-1]) == (sense if share > 1 else 0)
            assert trunnion.hold(scene).holds == (share < 1)
    r = simulate(wheel(1.0, start=2.0, **more), until=1.0, kernel=kernel)
    assert r["hub.qd[1]"] == pytest.approx(2.0 + r.time * (1.0 - DRAG) / 0.5, rel=1e-9)
    assert r["hub.friction.torque[1]"] == pytest.approx(np.full(len(r), DRAG), rel=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_freewheel_that_is_driven_to_and_fro_turns_one_way(kernel: str) -> None:
    """An oscillating torque below the capacity. The wheel starts where the torque exceeds the drag, and stops when the impulse of
    the torque is used up."""
    swing = sm.Signal(harmonic=sm.Harmonic(amplitude=10.0, frequency=1.0))
    r = simulate(wheel(swing), until=3.0, kernel=kernel, rtol=1e-10)
    assert np.diff(r["hub.q[1]"]).min() >= 0.0
    begin = np.arcsin(DRAG / 10.0) / (2 * np.pi)
    slips = [e.time for e in r.events if e.kind == "slip"]
    assert slips == pytest.approx([begin + k for k in range(3)], abs=1e-9)
    assert np.abs(r["energy.residual"]).max() <= 1e-8 * r["energy.kinetic"].max()
    held = (r["hub.qd[1]"] == 0.0) & (r.time > 0.0)
    torque = 10.0 * np.sin(2 * np.pi * r.time)
    # the freewheel that holds carries the whole torque
    assert r["hub.friction.torque[1]"][held] == pytest.approx(torque[held], abs=1e-9)


def test_a_freewheel_slips_back_beyond_its_grip() -> None:
    r = simulate(wheel(-GRIP - 3.0), until=1.0)
    assert r["hub.qd[1]"] == pytest.approx(-3.0 / 0.5 * r.time, rel=1e-9, abs=1e-12)


def test_a_bar_on_a_ratchet_without_teeth_stays_where_it_was_lifted_to() -> None:
    """A push lifts the bar, and the bar stays up. An input releases it."""
    scene = bar(0.0, back_torque=sm.FromInput("pawl"))
    joint = replace(scene.joints["joint"], axis="-y", start=sm.Start(q=0.3))
    up = sm.Signal(table=sm.Table((0.0, 0.3, 0.35, 5.0), (0.7 * WEIGHT * LENGTH, 0.7 * WEIGHT * LENGTH, 0.0, 0.0)))
    scene = replace(scene, joints={"joint": replace(joint, effort=up)}, inputs={"pawl": sm.Input(start=1e3, unit="N*m")})
    r = simulate(scene, until=2.0)
    assert r["joint.q[1]"][-1] > 0.3
    assert r["joint.qd[1]"][-1] == 0.0
    free = simulate(scene, until=2.0, overrides={"inputs.pawl.start": 0.0})
    assert free["joint.qd[1]"].min() < 0.0
    assert MASS * GRAVITY == WEIGHT


def test_a_freewheel_on_a_guide_holds_and_both_kernels_agree() -> None:
    guide = sm.Joint("prismatic", "ground", "b", axis="x", friction=sm.Friction(force=1.0, back_force=30.0), effort=-20.0)
    scene = sm.Scene({"b": sm.Body(mass=2.0, inertia=(1.0, 1.0, 1.0))}, {"j": guide}, "g", gravity=(0.0, 0.0, 0.0))
    assert simulate(scene, until=1.0)["j.q[1]"][-1] == 0.0
    for s in (scene, wheel(1.0)):
        agree(s)
        derivatives_agree(s)


def test_bounds_know_both_senses() -> None:
    """A torque of 20 N m acts in one direction, 0.1 N m in the other. The shares are relative to the friction that holds in each
    direction."""
    for effort, share in ((-20.0, 20.0 / GRIP), (0.1, 0.1 / DRAG)):
        found = trunnion.hold(wheel(effort), bounds=True)
        assert found.holds
        assert trunnion.hold(wheel(effort)).pairs[0].share == pytest.approx(share, rel=1e-9)
