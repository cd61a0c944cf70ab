"""A mass, a damped mass and a block with friction under every kind of signal move as an independent integration, for every method
and kernel. Steps end at corners and jumps of signals, so that none is missed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.default_case_selection import sampled
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from tests.reference.scenes.random_streams import stream
from trunnion import equilibrium, hold
from trunnion.basics.errors import SceneError
from trunnion.batch.sweep import sweep
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.scene.overrides import apply
from trunnion.scene.scene_loader import scene_from_dict, scene_from_text
from trunnion.simulation.run import simulate

METHODS = ("rk5", "rk8", "rosenbrock", "auto")
UNTIL, G = 2.0, 9.81
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
KINDS = ("ramp", "step", "pulse", "pulses", "trapezoid", "trapezoids", "limited harmonic", "limited table", "expression")


CASES = list(product(KINDS, range(12)))


@dataclass(frozen=True)
class Load:
    """A load as keys of a scene, and as an independent function of time. The function is smooth between the times ``ends``."""

    keys: dict
    of: Callable[[float], float]
    ends: list[float]


def load(kind: str, seed: int, most: float = 1.0) -> Load:
    """A random load of magnitude ``most``."""
    rng = stream("signal", kind, seed)
    a, b = most * float(rng.uniform(0.3, 1.0)), most * float(rng.uniform(-1.0, -0.2))
    t0, rise, hold, fall = (float(x) for x in rng.uniform(0.05, 0.25, 4))
    period = rise + hold + fall + float(rng.uniform(0.05, 0.2))
    frequency, phase = float(rng.uniform(0.7, 2.5)), float(rng.uniform(0.0, 6.0))

    def often(*ends: float) -> list[float]:
        return [t0 + k * period + e for k in range(int(UNTIL / period) + 1) for e in ends]

    def trapezoid(t: float) -> float:
        return float(np.interp(t, np.cumsum([t0, rise, hold, fall]), (b, a, a, b)))

    corners = [0.0, rise, rise + hold, rise + hold + fall]
    wave = math.asin(0.5)
    loads = {
        "ramp": lambda: Load({"ramp": {"start": b, "end": a, "begin": t0, "duration": rise}},
                             lambda t: float(np.interp(t, (t0, t0 + rise), (b, a))), [t0, t0 + rise]),
        "step": lambda: Load({"step": {"start": b, "end": a, "begin": t0}}, lambda t: b if t < t0 else a, [t0]),
        "pulse": lambda: Load({"pulse": {"base": b, "peak": a, "begin": t0, "duration": hold}},
                              lambda t: a if t0 <= t < t0 + hold else b, [t0, t0 + hold]),
        "pulses": lambda: Load({"pulse": {"base": b, "peak": a, "begin": t0, "duration": hold, "period": period}},
                               lambda t: a if t >= t0 and (t - t0) % period < hold else b, often(0.0, hold)),
        "trapezoid": lambda: Load({"trapezoid": {"base": b, "peak": a, "begin": t0, "rise": rise, "hold": hold, "fall": fall}},
                                  trapezoid, [t0 + x for x in corners]),
        "trapezoids": lambda: Load(
            {"trapezoid": {"base": b, "peak": a, "begin": t0, "rise": rise, "hold": hold, "fall": fall, "period": period}},
            lambda t: b if t < t0 else trapezoid(t0 + (t - t0) % period), often(*corners)),
        "limited harmonic": lambda: Load(
            {"harmonic": {"amplitude": a, "frequency": frequency, "phase": phase}, "limit": {"upper": 0.5 * a, "lower": -0.4 * a}},
            lambda t: max(min(a * math.sin(2 * math.pi * frequency * t + phase), 0.5 * a), -0.4 * a),
            [(angle + 2 * math.pi * k - phase) / (2 * math.pi * frequency) for k in range(9)
             for half in (wave, math.asin(-0.4)) for angle in (half, math.pi - half)]),
        "limited table": lambda: Load(
            {"table": {"time": [t0, t0 + rise, t0 + rise + hold], "value": [b, a, b]}, "limit": {"upper": 0.0}},
            lambda t: min(float(np.interp(t, np.cumsum([t0, rise, hold]), (b, a, b))), 0.0),
            [*np.cumsum([t0, rise, hold]), t0 + rise * -b / (a - b), t0 + rise + hold * a / (a - b)]),
        "expression": lambda: Load(
            {"expression": f"{a!r} N*sin(2*pi*{frequency!r} Hz*t + {phase!r} rad)*exp(-t/{hold!r} s)"
                           f" - {-b!r} N*(t/1 s)^2/(1+t/1 s)"},
            lambda t: a * math.sin(2 * math.pi * frequency * t + phase) * math.exp(-t / hold) + b * t * t / (1 + t), []),
    }  # fmt: skip
    return loads[kind]()


def pieces(ends: list[float], until: float = UNTIL) -> list[float]:
    return sorted({0.0, until, *(float(e) for e in ends if 0.0 < e < until), *np.linspace(0.0, until, 17)})


def quadrature(f: Callable[[float], float], a: float, b: float) -> float:
    return 0.5 * (b - a) * float(WEIGHTS @ [f(0.5 * (a + b) + 0.5 * (b - a) * x) for x in NODES])


def scene(keys: dict, mass: float, damping: float = 0.0, mu: float = 0.0) -> dict:
    slide: dict = {"type": "prismatic", "inboard": "ground", "outboard": "block", "axis": "x", "pin": "outboard", "effort": keys}
    slide |= {"damping": damping} if damping else {}
    slide |= {"friction": {"mu": mu, "half_width": 0.01, "half_height": 0.01, "half_length": 0.5}} if mu else {}
    return {"name": "block", "gravity": [0, 0, -G], "bodies": {"block": {"mass": mass, "inertia": [0.1, 0.1, 0.1]}},
            "joints": {"slide": slide}}  # fmt: skip


def numbers(seed: int) -> tuple[float, float, float]:
    rng = stream("block", seed)
    return float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.5, 4.0)), float(rng.uniform(0.1, 0.4))


def damped(f: Load, mass: float, damping: float) -> tuple[float, float]:
    """Coordinate and rate at the end, from the convolution with the responses to an impulse."""
    at = pieces(f.ends)

    def slowed(t: float) -> float:
        return math.exp(-damping * (UNTIL - t) / mass)

    spans = list(pairwise(at))
    rate = sum(quadrature(lambda t: f.of(t) * slowed(t) / mass, a, b) for a, b in spans)
    return sum(quadrature(lambda t: f.of(t) * (1 - slowed(t)) / damping, a, b) for a, b in spans), rate


def rubbing(f: Load, mass: float, hold: float) -> tuple[float, float, list[float]]:
    """The motion of a block that friction up to ``hold`` stops: coordinate and rate at the end, and times at which sliding begins
    in a direction. The times are roots of integrals between the ends of the load's pieces."""
    t, q, v, slips, left = 0.0, 0.0, 0.0, [], pieces(f.ends)[1:]
    sign = 0.0
    while left:
        end, sense = left[0], sign

        def force(t: float, sense: float = sense) -> float:
            return f.of(t) - sense * hold

        if sign == 0.0:
            grid = np.linspace(t, end, 65)
            inside = [0.5 * (a + b) for a, b in pairwise(grid)]
            over = next((k for k, x in enumerate([math.nextafter(t, 9.0), *inside]) if abs(f.of(x)) > hold), None)
            if over is None:
                t = left.pop(0)
                continue
            if over:
                low, high = (t if over == 1 else inside[over - 2]), inside[over - 1]
                t = brentq(lambda x: abs(f.of(x)) - hold, low, high, xtol=1e-15)
            sign = math.copysign(1.0, f.of(math.nextafter(t, 9.0) if not over else high))
            slips += [t] if t else []  # a block that already slides at t = 0 has no event
            continue

        def rate(x: float, t: float = t, v: float = v, force: Callable[[float], float] = force) -> float:
            return v + quadrature(force, t, x) / mass

        to = end
        grid = np.linspace(t, end, 33)[1:]
        if (first := next((k for k, x in enumerate(grid) if sense * rate(x) < 0.0), None)) is not None:
            low = grid[first - 1] if first else t + 1e-3 * (grid[0] - t)
            to = brentq(rate, low, grid[first], xtol=1e-15) if sense * rate(low) > 0.0 else low
        q += v * (to - t) + quadrature(lambda x, to=to, force=force: (to - x) * force(x) / mass, t, to)
        v = rate(to)
        t, sign, v = (to, 0.0, 0.0) if to < end else (left.pop(0), sign, v)
    return q, v, slips


@pytest.mark.parametrize(("kind", "seed"), sampled(CASES, [("pulses", 0), ("limited harmonic", 0), ("expression", 0)]))
def test_a_damped_mass_answers_every_signal_as_its_response_to_impulses_says(kind: str, seed: int) -> None:
    mass, damping, _ = numbers(seed)
    f = load(kind, seed)
    expected = damped(f, mass, damping)
    for kernel in ("parts", "compiled") if seed == 1 else ("parts",):
        for method in METHODS if seed in (1, 2) or kind == "pulses" else ("auto",):
            r = simulate(scene(f.keys, mass, damping), until=UNTIL, every=UNTIL, rtol=1e-11, method=method, kernel=kernel)
            found = r["slide.q[1]"][-1], r["slide.qd[1]"][-1]
            assert found == pytest.approx(expected, abs=1e-9 if method != "rosenbrock" else 1e-8), (method, kernel)


@pytest.mark.parametrize(("kind", "seed"), sampled(CASES, [("step", 0), ("trapezoids", 0), ("limited table", 0)]))
def test_a_rubbing_block_answers_every_signal_as_integrals_between_events_say(kind: str, seed: int) -> None:
    mass, _, mu = numbers(seed)
    f = load(kind, seed, 2.5 * mu * mass * G)
    q, v, slips = rubbing(f, mass, mu * mass * G)
    for method in METHODS if seed == 1 else ("auto",):
        r = simulate(scene(f.keys, mass, mu=mu), until=UNTIL, every=UNTIL, rtol=1e-11, method=method)
        assert [e.time for e in r.events if e.kind in ("slip", "reversal")] == pytest.approx(slips, abs=1e-9), method
        assert (r["slide.q[1]"][-1], r["slide.qd[1]"][-1]) == pytest.approx((q, v), abs=3e-9), method


def test_a_pulse_of_a_microsecond_in_a_run_of_hours_acts_with_its_whole_impulse() -> None:
    mass, force, begin, duration = 2.0, 5e6, 4321.0, 1e-6
    keys = {"pulse": {"peak": force, "begin": begin, "duration": duration}}
    lasted = (begin + duration) - begin  # the duration, as precise as the two times
    for method in METHODS:
        r = simulate(scene(keys, mass), until=1e4, every=1e4, method=method)
        assert r["slide.qd[1]"][-1] == pytest.approx(force * lasted / mass, rel=1e-9)
        assert r.stats.steps < 120
    stuck = simulate(scene(keys, mass, mu=0.5), until=1e4, every=1e4)
    assert [e.kind for e in stuck.events] == ["slip", "stick"]
    speed = (force - 0.5 * mass * G) * lasted / mass
    assert stuck["slide.q[1]"][-1] == pytest.approx(0.5 * speed * lasted + 0.5 * speed**2 / (0.5 * G), rel=1e-9)


def test_a_jump_that_friction_still_holds_moves_nothing_and_is_no_event() -> None:
    r = simulate(scene({"step": {"end": 0.999 * 0.4 * G, "begin": 1.0}}, 1.0, mu=0.4), until=3.0, every=3.0)
    assert not r.events
    assert r["slide.q[1]"][-1] == 0.0
    r = simulate(scene({"step": {"end": 1.001 * 0.4 * G, "begin": 1.0}}, 1.0, mu=0.4), until=3.0, every=3.0)
    assert [(e.kind, e.time) for e in r.events] == [("slip", 1.0)]


def test_rows_report_a_load_before_its_jump_until_the_jump_and_after_it_from_then_on() -> None:
    r = simulate(scene({"step": {"end": 2.0, "begin": 1.0}}, 1.0), until=2.0, every=0.5)
    assert r["slide.qdd[1]"][[0, 1, 3, 4]] == pytest.approx([0.0, 0.0, 2.0, 2.0])


@pytest.mark.parametrize("drive", [
    {"trapezoid": {"base": 0.2, "peak": 1.5, "rise": 0.3, "hold": 0.2, "fall": 0.4, "begin": -0.35, "period": 1.1, "origin": 0.1}},
    {"trapezoid": {"peak": -1.5, "rise": 0.3, "hold": 0.0, "fall": 0.4, "begin": 0.25}},
    {"expression": "0.3 rad*sin(2*pi*0.7 Hz*t) + 0.2 rad*(1 - exp(-(t/0.5 s)^2))"},
])  # fmt: skip
def test_drives_move_by_trapezoids_of_their_rate_and_by_formulas(drive: dict) -> None:
    keys = {"name": "driven", "gravity": [0, 0, 0], "bodies": {"arm": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
            "joints": {"hinge": {"type": "revolute", "inboard": "ground", "outboard": "arm", "axis": "z",
                                 "drive": drive}}}  # fmt: skip
    model = scene_from_dict(keys)
    if "period" in drive.get("trapezoid", {"period": None}):
        agree(model)
    r = simulate(model, until=2.0, every=1e-3)
    t, q, rate, acc = (r[c] for c in ("time", "hinge.q[1]", "hinge.qd[1]", "hinge.qdd[1]"))
    if "expression" in drive:
        expected = 0.3 * np.sin(2 * np.pi * 0.7 * t) + 0.2 * (1 - np.exp(-((t / 0.5) ** 2)))
    else:
        d = {"base": 0.0, "period": 100.0, "origin": 0.0} | drive["trapezoid"]
        edges = np.cumsum([0.0, d["rise"], d["hold"], d["fall"], 1e-300])
        fine = np.linspace(0.0, 2.0, 2001)
        since = np.where(fine >= d["begin"], (fine - d["begin"]) % d["period"], 0.0)
        rates = d["base"] + (d["peak"] - d["base"]) * np.interp(since, edges, (0.0, 1.0, 1.0, 0.0, 0.0))
        assert rate == pytest.approx(rates, abs=1e-12)
        expected = d["origin"] + np.concatenate([[0.0], np.cumsum(0.5e-3 * (rates[1:] + rates[:-1]))])
    assert q == pytest.approx(expected, abs=2e-6 if "trapezoid" in drive else 1e-12)
    assert np.gradient(q, t)[1:-1] == pytest.approx(rate[1:-1], abs=5e-3)
    assert np.median(np.abs(np.gradient(rate, t) - acc)) < 1e-4


def test_both_kernels_and_their_derivatives_agree_about_every_signal() -> None:
    data = scene(load("pulses", 1).keys, 1.0, 0.5)
    for kind in ("trapezoids", "limited harmonic", "expression"):
        data["bodies"][kind.split()[0]] = data["bodies"]["block"]
        data["joints"][kind[:4]] = data["joints"]["slide"] | {"outboard": kind.split()[0], "effort": load(kind, 1).keys}
    model = scene_from_dict(data)
    agree(model)
    derivatives_agree(model)


@pytest.mark.parametrize(("place", "keys", "said", "remedy"), [
    ("drive", {"step": {"end": 1.0}}, "a drive cannot jump", "move"),
    ("drive", {"pulse": {"peak": 1.0, "duration": 1.0}}, "a drive cannot jump", "apply an effort"),
    ("drive", {"harmonic": {"amplitude": 1.0, "frequency": 1.0}, "limit": {"upper": 0.5}}, "a drive has no limits", "table"),
    ("effort", {"move": {"start": 0.0, "end": 1.0, "duration": 1.0}}, "a load has no move", "trapezoid"),
    ("effort", {"constant": {"rate": 1.0}}, "a load has no constant", "plain number"),
    ("effort", {"pulse": {"peak": 1.0, "duration": 1.0, "period": 1.0}}, "above the duration", "omit"),
    ("effort", {"trapezoid": {"peak": 1.0, "rise": 0.0, "hold": 1.0, "fall": 1.0}}, "must be positive", "use pulse"),
    ("effort", {"trapezoid": {"peak": 1.0, "rise": 1.0, "hold": 1.0, "fall": 1.0, "period": 2.0}}, "below rise + hold + fall", ""),
    ("effort", {"step": {"end": 1.0}, "limit": {"upper": 0.0, "lower": 1.0}}, "upper must be above lower", ""),
    ("effort", {"step": {"end": 1.0}, "limit": {}}, "limits need lower, upper or both", ""),
    ("effort", {"limit": {"upper": 1.0}}, "an empty signal", "step"),
    ("effort", {"expression": "1 N*sin(2 rad/s*t)", "limit": {"upper": 0.5}}, "an expression cannot be limited", "linear"),
    ("effort", {"expression": "1 N*abs(t/1 s)"}, "abs of the time has a kink", "trapezoid"),
    ("effort", {"expression": "1 N*max(t/1 s, 2)"}, "max of the time has a kink", "limit"),
    ("effort", {"expression": "1 N*tan(1 rad/s*t)"}, "tan of the time is not allowed", "tanh"),
    ("effort", {"expression": "1 N*sin((t/1 s)^2)"}, "must be linear in t", "table"),
    ("effort", {"expression": "1 N*(t/1 s)^0.5"}, "whole number as exponent", "sqrt"),
    ("effort", {"expression": "1 N*2^(t/1 s)"}, "whole number as exponent", "exp"),
    ("effort", {"expression": "3 N"}, "does not depend on the time", "plain number"),
    ("effort", {"expression": "2 m*sin(1 rad/s*t)"}, "a length", "N"),
    ("effort", {"expression": "2 N*sin(3*t)"}, "sin needs an angle", ""),
    ("effort", {"expression": "2 N*sin(3 Hz*t)"}, "Hz counts cycles", "2*pi"),
    ("effort", {"expression": "1 N*log(t/1 s)"}, "no value at t = 0", "shift"),
    ("effort", {"expression": "F*sin(1 rad/s*t)"}, 'no parameter "F"', "parameters"),
    ("effort", {"expression": "1 N*(t/1 s"}, "cannot read", ""),
])  # fmt: skip
def test_a_signal_that_steps_or_drives_cannot_follow_is_refused_by_name(place: str, keys: dict, said: str, remedy: str) -> None:
    data = scene(0.0, 1.0)
    slide = data["joints"]["slide"]
    del slide["effort"]
    slide[place] = keys
    with pytest.raises(SceneError) as e:
        scene_from_dict(data)
    assert said in str(e.value)
    assert remedy in str(e.value)


def test_friction_by_a_signal_that_could_become_negative_is_refused() -> None:
    for keys in ({"step": {"end": -0.1}}, {"pulse": {"peak": 0.1, "base": -0.1, "duration": 1.0}}, {"expression": "0.5 - t/1 s"}):
        data = scene(1.0, 1.0, mu=0.4)
        data["joints"]["slide"]["friction"]["mu"] = keys
        with pytest.raises(SceneError, match="friction must not be negative"):
            scene_from_dict(data)
    data["joints"]["slide"]["friction"]["mu"] = {"trapezoid": {"base": -0.1, "peak": 0.3, "rise": 1, "hold": 1, "fall": 1},
                                                 "limit": {"lower": 0.0}}  # fmt: skip
    scene_from_dict(data)


def test_a_coefficient_of_friction_that_jumps_releases_what_it_held() -> None:
    data = scene(2.0, 1.0, mu=0.4)
    data["joints"]["slide"]["friction"]["mu"] = {"step": {"start": 0.4, "end": 0.1, "begin": 0.7}}
    r = simulate(data, until=2.0, every=2.0)
    assert [(e.kind, e.time) for e in r.events] == [("slip", 0.7)]
    assert r["slide.q[1]"][-1] == pytest.approx(0.5 * (2.0 - 0.1 * G) * 1.3**2, rel=1e-9)


def test_a_formula_follows_its_parameters() -> None:
    data = scene({"expression": "F*sin(w*t)*exp(-t/T)"}, 1.0)
    data["parameters"] = {"F": "2 N", "w": "{2*pi*f}", "f": "3 1/s", "T": "0.5 s"}
    one, two = scene_from_dict(data), scene_from_dict(data | {"parameters": data["parameters"] | {"F": "4 N", "f": "1 1/s"}})
    changed = apply(one, {"parameters.F": 4.0, "parameters.f": 1.0})
    for a, b in ((two, changed), (one, apply(changed, {"parameters.F": "2 N", "parameters.f": 3.0}))):
        x, y = (simulate(s, until=1.0, every=1.0)["slide.q[1]"][-1] for s in (a, b))
        assert x == y


def test_a_pulse_of_a_microsecond_lifts_a_hook_as_a_long_one_does() -> None:
    ends = []
    for duration in (1e-6, 0.5):
        data = scene(-6.0, 2.0)
        slide = data["joints"]["slide"]
        slide |= {"start": {"qd": 3.0}, "latch": {"at": 0.3, "stiffness": 4e4, "damping": 5.0}}
        slide["latch"]["release"] = {"pulse": {"peak": 1.0, "begin": 2.5, "duration": duration}}
        r = simulate(data, until=4.0, every=4.0, rtol=1e-9)
        assert [e.time for e in r.events if e.kind == "unlatch"] == pytest.approx([2.5], abs=1e-12)
        ends.append(r["slide.q[1]"][-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert ends[0] < -3.0


def test_a_sweep_over_numbers_of_a_signal_has_the_results_of_single_runs() -> None:
    """Cases with different values share vector steps of the kernel. Times of jumps belong to each case."""
    keys = load("pulses", 1, 8.0).keys
    block = scene_from_dict(scene(keys, 2.0, mu=0.2))
    effort = "joints.slide.effort.pulse"
    vary = {f"{effort}.peak": [4.0, 6.0, 8.0], f"{effort}.period": [0.7, 0.8]}
    swept = sweep(block, vary=vary, reductions=["final:slide.q[1]"], until=UNTIL)
    assert len(swept.table) == 6
    for case in swept.table.to_pylist():
        changed = apply(block, {n: case[n] for n in vary})
        assert case["final:slide.q[1]"] == pytest.approx(simulate(changed, until=UNTIL)["slide.q[1]"][-1], rel=1e-6)


def test_a_scene_with_formulas_is_written_and_read_again_and_copies_have_parameters_of_their_own() -> None:
    leg = scene({"expression": "{F*exp(-t/T)}"}, 1.0) | {"parameters": {"F": "2 N", "T": "0.5 s"}}
    del leg["name"], leg["gravity"]
    data = {"name": "two", "assemblies": {"leg": {"use": leg, "copies": {"line": {"times": 2, "step": [1.0, 0.0, 0.0]}}}}}
    model = scene_from_dict(data)
    assert [j.effort.expression.formula for j in model.joints.values()] == ["leg1_F*exp(-t/leg1_T)", "leg2_F*exp(-t/leg2_T)"]
    again = scene_from_text(scene_to_yaml(model))
    assert again.joints == model.joints
    ends = [simulate(s, until=1.0, every=1.0).data[-1] for s in (model, again)]
    assert (ends[0] == ends[1]).all()
    changed = apply(model, {"joints.leg1_slide.effort.expression.formula": "leg1_F*exp(-t/1 s)"})
    assert changed.joints["leg1_slide"].effort.expression.numbers == (2.0, 1.0)


def test_statics_take_each_signal_s_value_at_the_start() -> None:
    for keys in ({"expression": "3 N*cos(1 rad/s*t)"}, {"pulse": {"peak": 3.0, "duration": 1.0}},
                 {"harmonic": {"amplitude": 9.0, "frequency": 1.0, "phase": 1.2}, "limit": {"upper": 3.0}}):  # fmt: skip
        assert hold(scene_from_dict(scene(keys, 2.0, mu=0.4))).margin == pytest.approx(1.0 - 3.0 / (0.4 * 2.0 * G), rel=1e-12)
        sprung = scene(keys, 2.0, 1.0)
        sprung["joints"]["slide"]["spring"] = {"stiffness": 100.0}
        assert equilibrium(sprung).q["slide"] == pytest.approx((0.03,), rel=1e-12)
