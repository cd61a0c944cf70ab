"""A force field acts by formulas of the position. The tests cover both kernels, work, derivatives and rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import trunnion
from tests.default_case_selection import sampled
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.engine.parts.test_jacobian import agree as derivatives_agree
from tests.engine.recursion.test_dense_reference import TIME, compared
from tests.reference.mechanics.loads_and_devices import formula_value
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from trunnion.scene import scene_from_dict
from trunnion.simulation.run import simulate

CLOSE = 1e-9
START, SPEED, MASS = [0.3, -0.2, 0.4], [0.5, 0.7, -0.6], 2.0


def flying(field: dict[str, Any], **more: Any) -> trunnion.Scene:
    """A body that moves freely through a field, without gravity."""
    free = {"type": "free", "inboard": "ground", "outboard": "b"}
    free["start"] = {"q": [*START, 1, 0, 0, 0], "qd": [*SPEED, 0, 0, 0]}
    body = {"mass": MASS, "inertia": [0.2, 0.3, 0.4], "points": {"eye": [0.1, 0.2, -0.1]}}
    forces = {"magnet": {"type": "field", "on": "b", **field}}
    return scene_from_dict({"name": "flight", "bodies": {"b": body}, "joints": {"j": free}, "forces": forces,
                            "gravity": [0, 0, 0], **more})  # fmt: skip


def random_field(rng: np.random.Generator) -> dict[str, str]:
    """A bounded field with all functions."""
    a, b, c, d = (repr(float(v)) for v in rng.uniform(0.5, 3.0, 4))
    made = [
        f"-{a} N/m*x - {b} N*sin({c} rad/m*y)", f"{a} N*exp(-(x^2 + z^2)*{b}) - {c} N/m*y".replace(f"*{b})", f"/({b} m)^2)"),
        f"-{c} N*tanh(z/{d} m) + {a} N*cos({b} rad/m*x)", f"-{d} N*x/sqrt(x^2 + y^2 + z^2 + 1 m^2)".replace("1 m^2", "1 m*1 m"),
        f"-{b} N*atan(y/{d} m)*log(2 + (z/{c} m)^2)", f"{a} N*(x/{d} m)^3*exp(-(x/{d} m)^2)",
    ]  # fmt: skip
    return dict(zip(("fx", "fy", "fz"), rng.permutation(made).tolist(), strict=False))


def with_fields(make, seed: int) -> Case:
    """A random mechanism in fields, at a point and at a mass centre."""
    case = make(seed, t=TIME, bodies=4) if make is random_tree else make(seed, t=TIME)
    rng, names = np.random.default_rng(seed), list(case.scene.bodies)
    more = {on.replace(".", "_"): replace(flying(random_field(rng)).forces["magnet"], on=on) for on in (f"{names[0]}.s", names[-1])}
    return replace(case, scene=replace(case.scene, forces=case.scene.forces | more))


@pytest.mark.parametrize(("make", "seed"), sampled([(random_tree, 1), (random_loop, 3), (random_tree, 5), (random_loop, 4)], 2))
def test_force_fields_act_as_in_absolute_coordinates(make, seed: int) -> None:
    compared(with_fields(make, seed))


def test_both_kernels_and_their_derivatives_agree() -> None:
    scene = flying({**random_field(np.random.default_rng(1)), "on": "b.eye"})
    agree(scene)
    derivatives_agree(scene)


@pytest.mark.parametrize("seed", sampled(range(100), 1))
def test_a_flight_through_a_field_is_what_scipy_integrates_and_its_work_is_accounted(seed: int) -> None:
    field = random_field(np.random.default_rng(seed))
    r = simulate(flying(field), until=2.0, every=0.5, rtol=1e-12)

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        at = dict(zip("xyz", y, strict=False))
        return np.concatenate([y[3:], np.array([formula_value(field[k], at) for k in ("fx", "fy", "fz")]) / MASS])

    expected = solve_ivp(slope, (0.0, 2.0), [*START, *SPEED], "DOP853", r.time, rtol=1e-13, atol=1e-13).y
    for i in range(3):
        assert r[f"j.q[{i + 1}]"] == pytest.approx(expected[i], abs=CLOSE)
    assert np.abs(r["energy.residual"]).max() <= 1e-8
    assert np.ptp(r["energy.kinetic"]) > 1e-3


def test_a_linear_field_is_a_spring_in_space_by_parameters_too() -> None:
    """x = x0 cos ωt + v0/ω sin ωt with ω = √(k/m), and its derivative with respect to the formula's parameter k."""
    scene = flying({k: f"-k*{x}" for k, x in zip(("fx", "fy", "fz"), "xyz", strict=True)}, parameters={"k": "30 N/m"})
    r = simulate(scene, until=3.0, every=0.1, rtol=1e-12)
    w = np.sqrt(30.0 / MASS)
    for i in range(3):
        expected = START[i] * np.cos(w * r.time) + SPEED[i] / w * np.sin(w * r.time)
        assert r[f"j.q[{i + 1}]"] == pytest.approx(expected, abs=CLOSE)
    found = trunnion.sensitivity(scene, ["parameters.k"], ["j.q[1]"], 1.0, 1.0, rtol=1e-11)
    t, by_w = found.time, 1 / (2 * np.sqrt(30.0 * MASS))
    slope = -START[0] * t * np.sin(w * t) + SPEED[0] / w * (t * np.cos(w * t) - np.sin(w * t) / w)
    assert found.derivatives[:, 0, 0] == pytest.approx(slope * by_w, abs=1e-7)


def test_the_rest_and_vibrations_of_a_bead_follow_from_the_slope_of_its_field() -> None:
    """A bead on a rail between two magnets with F = −A sin(x/a). The bead comes to rest at 0. Its frequency is √(A/(a m))."""
    rail = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "b", "start": {"q": 0.02}}
    field = {"type": "field", "on": "b", "fx": "-4 N*sin(1 rad*x/(50 mm))"}
    scene = scene_from_dict({"name": "bead", "bodies": {"b": {"mass": MASS, "inertia": [1, 1, 1]}}, "joints": {"rail": rail},
                             "forces": {"magnet": field}})  # fmt: skip
    found = trunnion.equilibrium(scene)
    assert found.q["rail"] == pytest.approx([0.0], abs=CLOSE)
    still = trunnion.modes(replace(scene, joints={"rail": replace(scene.joints["rail"], start=None)}))
    assert still.modes[0].frequency == pytest.approx(np.sqrt(4.0 / 0.05 / MASS) / (2 * np.pi), rel=CLOSE)
