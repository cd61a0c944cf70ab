"""Steps resolve narrow parts of curves and fields: pieces of a curve, the declared width of a field, and the centre of an
attraction."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import trunnion
from tests.default_case_selection import sampled
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.reference.mechanics.characteristic_curves import Characteristic
from trunnion.scene import scene_from_dict
from trunnion.simulation.run import simulate

MASS, END = 2.0, 2.0
NEAR = 1e-3
"""Relative distance of the start energy from the energy at the top of a hill."""
FAR = 3.0
"""Distance of the start from the fixed end of a line, m. The body never returns to this distance."""
METHODS = ("auto", "rk5", "rosenbrock")


def scene(joint: dict[str, Any], forces: dict[str, Any] | None = None, **ground: Any) -> trunnion.Scene:
    """A body on one joint, without gravity."""
    body = {"mass": MASS, "inertia": [0.2, 0.3, 0.4]}
    return scene_from_dict({"name": "hill", "bodies": {"b": body}, "joints": {"j": {"inboard": "ground", "outboard": "b", **joint}},
                            "forces": forces or {}, "gravity": [0, 0, 0], **ground})  # fmt: skip


def hill(rng: np.random.Generator, begin: float, way: float) -> tuple[dict[str, list[float]], Characteristic]:
    """A random hill behind ``begin + way``. Its width is 1e-6 … 1e-2 of the way. Far from the hill no force acts; near it, first a
    push acts, then a pull."""
    width = way * 10.0 ** rng.uniform(-6.0, -2.0)
    at = (begin + way + width * np.cumsum(rng.uniform(0.3, 1.0, 8))).tolist()
    push, pull = rng.uniform(1.0, 3.0, 2) / width
    effort = [0.0, 0.0, push, 0.0, 0.0, -pull * rng.uniform(0.1, 0.9), 0.0, 0.0]
    return {"at": at, "effort": effort}, Characteristic(at, effort)


def on_a_hill(kind: str, seed: int, over: bool) -> tuple[trunnion.Scene, float, Any]:
    """The scene, the place of the hill's top along the way, and the stored energy as a function of the way."""
    rng = np.random.default_rng(seed)
    way = rng.uniform(0.2, 0.8)
    if kind == "field":
        width = way * 10.0 ** rng.uniform(-3.5, -2.0)
        force = rng.uniform(1.0, 3.0) / width
        law = f"{force!r} N*(x - {way!r} m)/({width!r} m)*exp(-((x - {way!r} m)/({width!r} m))^2)"
        top, stored = way, lambda x: 0.5 * force * width * np.exp(-(((x - way) / width) ** 2))
        devices: dict[str, Any] = {"forces": {"f": {"type": "field", "on": "b", "fx": law, "width": width}}}
        nonlinear = {}
    else:
        begin = FAR if kind == "line" else 0.0
        curve, found = hill(rng, begin, way)
        stored = lambda x: found.area(x + begin)  # noqa: E731
        bounds = np.array([curve["at"][1], curve["at"][4]]) - begin
        top = float(minimize_scalar(lambda x: -stored(x), bounds=bounds, method="bounded", options={"xatol": 1e-15}).x)
        group = {"spring_curve": curve}
        line = {"type": "spring_damper", "between": ["ground.far", "b"], "stiffness": 0, "nonlinear": group}
        devices = {"forces": {"f": line}, "ground": {"points": {"far": [-FAR, 0, 0]}}} if kind == "line" else {}
        nonlinear = {} if kind == "line" else {"nonlinear": group}
    speed = np.sqrt(2.0 / MASS * stored(top) * (1.0 + (NEAR if over else -NEAR)))
    joint = {"type": "prismatic", "axis": "x", "start": {"q": 0.0, "qd": speed}, **nonlinear}
    return scene(joint, **devices), top, stored


CASES = [(kind, seed, over) for kind in ("freedom", "line", "field") for seed in range(20) for over in (False, True)]


@pytest.mark.parametrize(("kind", "seed", "over"), sampled(CASES, 5))
def test_a_body_passes_a_narrow_hill_if_and_only_if_its_energy_suffices(kind: str, seed: int, over: bool) -> None:
    made, top, stored = on_a_hill(kind, seed, over)
    r = simulate(made, until=END / made.joints["j"].start.qd, rtol=1e-8, method=METHODS[seed % len(METHODS)])
    x, v = r["j.q[1]"][-1], r["j.qd[1]"][-1]
    assert r.outcome.ok
    assert ((x > top), (v > 0.0)) == (over, over)
    begin = 0.5 * MASS * r["j.qd[1]"][0] ** 2
    assert 0.5 * MASS * v**2 + stored(x) == pytest.approx(begin, rel=1e-4)


@pytest.mark.parametrize("seed", sampled(range(40), 2))
def test_a_close_passage_keeps_the_axis_and_the_eccentricity_of_the_orbit(seed: int) -> None:
    """The vector v × h − gm r̂ (Laplace, Runge, Lenz) is constant. The closest distance is 1e-7 … 1e-3 of the way."""
    rng = np.random.default_rng(seed)
    far, near, v = 1.0, 10.0 ** rng.uniform(-7.0, -3.0), rng.uniform(0.5, 2.0)
    gm = near * v**2 * 10.0 ** rng.uniform(-1.0, 1.0)
    b = near * np.sqrt(v**2 - 2.0 * gm / far + 2.0 * gm / near) / v  # moment of the velocity at the closest distance, over v
    joint = {"type": "planar", "axis": "z", "start": {"q": [-np.sqrt(far**2 - b**2), b, 0], "qd": [v, 0, 0]}}
    made = scene(joint, {"sun": {"type": "point_gravity", "on": "b", "towards": "ground", "gm": gm}})
    r = simulate(made, until=END / v, every=END / v / 200, rtol=1e-10, method=METHODS[seed % len(METHODS)])
    (x, y), (u, w) = ((r[f"j.{key}[1]"], r[f"j.{key}[2]"]) for key in ("q", "qd"))
    turn, unit = x * w - y * u, np.array([x, y]) / np.hypot(x, y)
    vector = turn * np.array([w, -u]) - gm * unit
    assert np.abs(vector - vector[:, :1]).max() <= 1e-7 * np.hypot(*vector[:, 0])
    assert r.outcome.ok


def test_both_kernels_have_the_same_positions_in_curves_and_fields() -> None:
    one, line, field = (on_a_hill(kind, 1, True)[0] for kind in ("freedom", "line", "field"))
    both = {"line": line.forces["f"], "field": field.forces["f"]}
    agree(replace(one, forces=both, ground=line.ground))


def test_a_field_without_width_is_named_in_a_note_unless_it_is_a_polynomial() -> None:
    joint = {"type": "prismatic", "axis": "x"}
    for law, noted in (("-1 N/m*x + 1 N/m^2*x^2", False), ("1 N*exp(-(x/10 mm)^2)", True)):
        r = simulate(scene(joint, {"f": {"type": "field", "on": "b", "fx": law}}), until=0.1)
        assert any("forces.f.width" in note for note in r.notes) == noted
