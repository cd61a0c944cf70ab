"""Friction that depends on time, an input, a temperature or the sliding speed: brakes, fading linings, measured curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.optimize import brentq

import trunnion
from tests.engine.friction.test_preload_friction import GRAVITY, LENGTH, MASS, SLOPE, WEIGHT, bar, block
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from trunnion.scene.checks import problems
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

KERNELS = ("parts", "compiled")
EDGE = 1e-6
PULL = WEIGHT * np.sin(SLOPE)
CURVE = sm.InputCurve(at=(20.0, 60.0, 100.0, 180.0), value=(0.35, 0.30, 0.18, 0.15))
SPEEDS = sm.BySpeed(speed=(0.0, 0.01, 0.1, 0.5, 2.0), value=(0.30, 0.22, 0.15, 0.14, 0.18))


def braked(signal: object, brake: float = 0.0) -> sm.Scene:
    """A block on a slope; a brake holds its guide."""
    return replace(block("prismatic", sm.Friction(force=signal)), inputs={"pedal": sm.Input(start=brake, unit="N")})


def guided(mu: object, start: float = 0.0, **more) -> sm.Scene:
    """A block on a long thin level pin. Both ends of the pin carry the block, so that the normal forces sum to its weight."""
    friction = sm.Friction(mu=mu, radius=1e-3, half_length=50.0, **more)
    guide = sm.Joint("cylindrical", "ground", "block", axis="x", friction=friction, start=sm.Start(q=(0.0, 0.0), qd=(start, 0.0)))
    return sm.Scene({"block": sm.Body(box=(0.1, 0.1, 0.1), mass=MASS)}, {"joint": guide}, "track", gravity=(0.0, 0.0, -GRAVITY))


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_brake_holds_up_to_its_pull_and_no_further(kernel: str) -> None:
    for share, holds in ((1 + EDGE, True), (1 - EDGE, False)):
        scene = braked(sm.FromInput("pedal"), share * PULL)
        r = simulate(scene, until=1.0, every=0.1, kernel=kernel)
        assert (np.abs(r["joint.q[1]"]).max() == 0.0) == holds
        assert trunnion.hold(scene).holds == holds


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_brake_that_is_let_go_and_put_on_again_slips_and_stops_when_it_must(kernel: str) -> None:
    """The brake's force falls and rises linearly. The block slips when the force equals the pull. After that, m v = ∫ (pull −
    force)."""
    most = 4 * PULL
    r = simulate(braked(sm.Signal(table=sm.Table((0.0, 1.0, 2.0), (most, 0.0, most)))), until=2.0, kernel=kernel, rtol=1e-10)
    force = lambda t: most * abs(1.0 - t)  # noqa: E731
    slip = brentq(lambda t: force(t) - PULL, 0.0, 1.0)
    speed = lambda t: quad(lambda s: (PULL - force(s)) / MASS, slip, t, points=[1.0] if t > 1.0 else None)[0]  # noqa: E731
    stop = brentq(speed, 1.0, 2.0)
    assert [(e.kind, pytest.approx(e.time, abs=1e-9)) for e in r.events] == [("slip", slip), ("stick", stop)]
    row = int(np.searchsorted(r.time, 1.2))
    assert r["joint.qd[1]"][row] == pytest.approx(speed(r.time[row]), abs=1e-9)
    assert np.abs(r["energy.residual"]).max() <= 1e-9 * r["energy.kinetic"].max()


def test_a_brake_on_a_turning_joint_adds_to_the_friction_of_its_load() -> None:
    """The brake is a ramp of torque. An input sets a preload, which adds μ P r to the friction from the journal's load."""
    edge = WEIGHT * LENGTH / 2
    ramp = sm.Signal(ramp=sm.Ramp(2 * edge, 0.0, duration=1.0))
    r = simulate(bar(ramp), until=1.0)
    assert [(e.kind, pytest.approx(e.time, abs=1e-9)) for e in r.events[:1]] == [("slip", 0.5)]
    rub = sm.Friction(mu=0.2, radius=0.05, half_length=0.1, preload=sm.FromInput("calliper"))
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=MASS)
    wheel = sm.Joint("revolute", "ground", "wheel", axis="y", friction=rub, start=sm.Start(qd=30.0))
    inputs = {"calliper": sm.Input(start=100.0, unit="N")}
    r = simulate(sm.Scene({"wheel": body}, {"joint": wheel}, "disc", inputs=inputs), until=0.01)
    # friction over load is μ/√(1 + μ²) for the weight on a pin, and μ for the preload, which presses all around
    share = 0.2 / np.hypot(1.0, 0.2)
    assert r["joint.friction.torque[1]"][1:] == pytest.approx(0.05 * (share * WEIGHT + 0.2 * 100.0), rel=1e-9)


def test_a_coefficient_over_time_slows_by_its_integral() -> None:
    """v = v0 − g ∫ μ, because friction along a pin is μ times the weight."""
    wave = sm.Harmonic(amplitude=0.1, frequency=2.0, offset=0.2)
    r = simulate(guided(sm.Signal(harmonic=wave), start=1.0), until=1.0, rtol=1e-11)
    mu = lambda t: 0.2 + 0.1 * np.sin(4 * np.pi * t)  # noqa: E731
    lost = lambda t: GRAVITY * quad(mu, 0.0, t, epsabs=1e-13)[0]  # noqa: E731
    stop = brentq(lambda t: lost(t) - 1.0, 0.1, 1.0)
    assert [(e.kind, pytest.approx(e.time, abs=1e-9)) for e in r.events] == [("stick", stop)]
    rows = np.flatnonzero(r.time < stop)[::50]
    assert r["joint.qd[1]"][rows] == pytest.approx([1.0 - lost(t) for t in r.time[rows]], abs=1e-9)


def test_a_lining_fades_with_the_temperature_that_comes_from_outside() -> None:
    slopes = PchipInterpolator(CURVE.at, CURVE.value).derivative()(CURVE.at)
    slopes[[0, -1]] = 0.0
    curve = CubicHermiteSpline(CURVE.at, CURVE.value, slopes)
    for heat in (-10.0, 20.0, 33.0, 60.0, 75.0, 140.0, 180.0, 500.0):
        scene = guided(sm.FromInput("heat", CURVE), start=1.0)
        r = simulate(replace(scene, inputs={"heat": sm.Input(start=heat)}), until=1e-3, every=1e-3)
        mu = float(curve(np.clip(heat, CURVE.at[0], CURVE.at[-1])))
        assert r["joint.friction.force"][0] == pytest.approx(WEIGHT * mu, rel=1e-12)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", KERNELS)
def test_friction_falls_with_speed_as_it_was_measured(kernel: str) -> None:
    """At measured speeds the coefficient equals the measured coefficient. Between two measured speeds, it is between their
    coefficients."""
    for v, mu in zip(SPEEDS.speed[1:], SPEEDS.value[1:], strict=True):
        r = simulate(guided(SPEEDS, start=v), until=1e-4, every=1e-4, kernel=kernel)
        assert r["joint.friction.force"][0] == pytest.approx(WEIGHT * mu, rel=1e-9)
    r = simulate(guided(SPEEDS, start=3.0), until=3.0, kernel=kernel, rtol=1e-9)
    ratio, speed = r["joint.friction.force"] / WEIGHT, r["joint.qd[1]"]
    inside = (speed > SPEEDS.speed[1]) & (speed < SPEEDS.speed[3])
    assert inside.sum() > 100
    assert np.all(np.diff(ratio[inside]) > 0.0)  # as the block slows down, its friction grows
    assert ratio[speed > 2.0] == pytest.approx(np.full((speed > 2.0).sum(), 0.18), rel=1e-9)
    assert [e.kind for e in r.events] == ["stick"]


@pytest.mark.parametrize("kernel", KERNELS)
def test_friction_by_measured_speed_holds_at_rest_by_its_first_coefficient(kernel: str) -> None:
    push = WEIGHT * SPEEDS.value[0]
    for share, holds in ((1 - EDGE, True), (1 + EDGE, False)):
        scene = guided(SPEEDS)
        found = replace(scene, forces={"push": sm.Force("force", "block", (share * push, 0.0, 0.0))})
        r = simulate(found, until=0.1, every=0.1, kernel=kernel)
        assert (np.abs(r["joint.q[1]"]).max() == 0.0) == holds


def test_both_kernels_and_their_derivatives_agree() -> None:
    wave = sm.Signal(harmonic=sm.Harmonic(amplitude=0.1, frequency=2.0, offset=0.2))
    both = guided(sm.FromInput("heat", CURVE), mu_static=wave, preload=sm.Signal(table=sm.Table((0.0, 2.0), (1.0, 3.0))))
    both = replace(both, inputs={"heat": sm.Input(start=40.0)})
    for scene in (both, guided(SPEEDS), braked(sm.FromInput("pedal"), 5.0)):
        agree(scene)
        derivatives_agree(scene)


def test_stiff_steps_follow_a_variable_coefficient() -> None:
    wave = sm.Signal(harmonic=sm.Harmonic(amplitude=0.1, frequency=2.0, offset=0.2))
    how = {"until": 0.3, "every": 0.1, "rtol": 1e-9}
    runs = [simulate(guided(wave, start=1.0), method=m, **how)["joint.q[1]"] for m in ("rk8", "rosenbrock")]
    assert runs[1] == pytest.approx(runs[0], abs=1e-8)


def test_linearizations_and_sensitivities_include_brakes_and_variable_friction() -> None:
    """Derivative of a sliding block's acceleration with respect to its brake: dv̇/du = −1/m. Derivative of a run with respect to
    the amplitude of its wave: dv/da = −g ∫ sin."""
    scene = braked(sm.FromInput("pedal"), 0.5 * PULL)
    scene = replace(scene, joints={"joint": replace(scene.joints["joint"], start=sm.Start(qd=1.0))})
    found = trunnion.linearize(scene, outputs=("joint.friction.force",))
    assert found.B[:, 0] == pytest.approx([0.0, -1.0 / MASS], rel=1e-12)
    assert found.D[0, 0] == pytest.approx(1.0, rel=1e-12)
    wave = sm.Signal(harmonic=sm.Harmonic(amplitude=0.1, frequency=2.0, offset=0.2))
    name = "joints.joint.friction.mu.harmonic.amplitude"
    s = trunnion.sensitivity(guided(wave, start=3.0), [name], ["joint.qd[1]"], 0.5, 0.1)
    exact = -GRAVITY * (1 - np.cos(4 * np.pi * s.time)) / (4 * np.pi)
    assert s.derivatives[:, 0, 0] == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())


def test_statics_take_the_brake_as_it_is_at_the_start() -> None:
    bounds = trunnion.hold(braked(sm.FromInput("pedal"), 2 * PULL), bounds=True)
    assert bounds.holds
    fading = sm.Signal(ramp=sm.Ramp(0.5 * PULL, 9 * PULL, duration=1.0))
    assert not trunnion.hold(braked(fading)).holds


@pytest.mark.parametrize(("friction", "words"), [
    ({"mu": sm.BySpeed((0.0, 1.0), (0.3,)), "force": 2.0}, "2 entries of speed but 1 values"),
    ({"mu": sm.BySpeed((0.1, 1.0), (0.3, 0.2)), "force": 2.0}, "the first speed must be 0"),
    ({"mu": sm.BySpeed((0.0, 1.0, 1.0), (0.3, 0.2, 0.2)), "force": 2.0}, "must increase"),
    ({"mu": sm.BySpeed((0.0, 1.0), (0.3, 0.2)), "mu_static": 0.4, "force": 2.0}, "remove mu_static"),
    ({"mu": sm.BySpeed((0.0, 1.0), (0.3, 0.2)), "law": "viscous", "viscosity": 1.0, "force": 2.0}, "needs the law coulomb"),
    ({"force": sm.Signal(ramp=sm.Ramp(1.0, -1.0, duration=1.0))}, "it is -1"),
    ({"force": sm.FromInput("wheel")}, 'there is no input "wheel"'),
    ({"force": sm.FromInput("pedal", sm.InputCurve((1.0,), (2.0,)))}, "a curve has 2 to 12 points, not 1"),
    ({"force": sm.Signal()}, "an empty signal"),
])  # fmt: skip
def test_mistakes_are_reported(friction: dict, words: str) -> None:
    scene = replace(braked(0.0), joints={"joint": replace(braked(0.0).joints["joint"], friction=sm.Friction(**friction))})
    assert any(words in p.what or words in p.hint for p in problems(scene)), problems(scene)


def test_an_input_in_another_unit_is_reported() -> None:
    scene = replace(braked(sm.FromInput("pedal")), inputs={"pedal": sm.Input(unit="m")})
    assert any("N is expected here" in p.what for p in problems(scene))
