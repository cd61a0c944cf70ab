"""Integration methods: published coefficients, measured orders, and errors that decrease with the tolerance."""

from __future__ import annotations

import ctypes
import re
from dataclasses import replace
from functools import cache
from math import factorial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.integrate._ivp import dop853_coefficients as dop
from scipy.integrate._ivp.rk import RK45
from scipy.special import ellipj, ellipk

from tests.engine.checks.right_hand_side import rate
from tests.paper_friction_law import PAPER
from trunnion.basics.errors import SceneError
from trunnion.kernel.shared_libraries import RUNTIME
from trunnion.runtime.abi import Status
from trunnion.runtime.integrators import REGISTRY, RK5, RK8, Impulses, Rosenbrock, Tableau, method_c_code
from trunnion.runtime.integrators.order_conditions import density, trees
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.outcome import from_status
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface import simulation_block as bl

UNTIL = 1.5
METHODS = {m.name: m for m in REGISTRY if not isinstance(m, Impulses)}
"""Every registered method that has coefficients."""
STEPS = {name: (40, 56, 80, 112) if m.order > 6 else (40, 80, 160, 320) for name, m in METHODS.items()}
"""Numbers of steps. They are large enough for the leading error term to dominate, and small enough for round-off (1e-13) not to
matter."""
ORDERS = {name: (m.order, m.dense_order) for name, m in METHODS.items()}
"""Published orders of the solution and of the dense output."""
SLACK = 0.3
"""Change of a measured order by the next error term; a wrong coefficient changes it by an order or more."""
COLUMNS = ("elbow.q[1]", *(f"ball.q[{i}]" for i in range(1, 5)), "elbow.qd[1]", *(f"ball.qd[{i}]" for i in range(1, 4)))


def square(rows, n: int) -> np.ndarray:
    """Rows of growing length as a matrix with n columns."""
    return np.array([[*row, *[0.0] * (n - len(row))] for row in rows])


def test_rk5_is_scipys_pair() -> None:
    assert np.array_equal(square(RK5.A, 5), RK45.A)
    assert np.array_equal(RK5.B, RK45.B)
    assert np.array_equal(RK5.C, RK45.C)
    assert np.allclose(np.negative(RK5.E[0]), RK45.E, rtol=1e-15, atol=0)


def test_rk5_dense_output_is_scipys() -> None:
    K = np.random.default_rng(0).normal(size=7)
    step = RK5.B @ K[:6]
    rows = step, K[0] - step, 2 * step - K[0] - K[6], np.dot(RK5.D[0], K)
    for theta in np.linspace(0, 1, 7):
        mine = theta * (rows[0] + (1 - theta) * (rows[1] + theta * (rows[2] + (1 - theta) * rows[3])))
        assert mine == pytest.approx(K @ RK45.P @ np.cumprod(np.full(4, theta)), abs=1e-14)


def test_rk8_is_scipys_triple() -> None:
    A = np.vstack([square(RK8.A, 16), square([RK8.B], 16), square(RK8.A_dense, 16)])
    assert np.array_equal(A, dop.A)
    assert np.array_equal(RK8.B, dop.B)
    assert np.array_equal([*RK8.C, 1.0, *RK8.C_dense], dop.C)
    assert np.array_equal([*RK8.E[0], 0.0], dop.E5)
    assert np.array_equal([*RK8.E[1], 0.0], dop.E3)
    assert np.array_equal(RK8.D, dop.D)


def spoiled(method, name: str, row: int, column: int | None):
    """The method with one coefficient changed by a millionth."""
    value = getattr(method, name)
    if column is None:
        new = tuple(v * (1 + 1e-6) if i == row else v for i, v in enumerate(value))
    else:
        new = tuple(tuple(v * (1 + 1e-6) if (i, k) == (row, column) else v for k, v in enumerate(r)) for i, r in enumerate(value))
    return replace(method, **{name: new})


def test_no_table_becomes_c_code_unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    for method in METHODS.values():
        monkeypatch.setattr(method_c_code, "REGISTRY", (replace(method, order=method.order + 1),))
        with pytest.raises(ValueError, match=f"{method.name}: its coefficients give order = "):
            method_c_code.header()


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_a_wrong_coefficient_is_refused(method) -> None:
    tried = 0
    names = ("A", "C", "c", "d", "H") if isinstance(method, Rosenbrock) else ("A", "B", "C", "E", "A_dense", "C_dense", "D")
    for name in names:
        for row, value in enumerate(getattr(method, name)):
            for column, x in enumerate(value) if isinstance(value, tuple) else [(None, value)]:
                # The last coefficient of H multiplies the error and does not affect the order.
                if x and (name, column) != ("H", method.stages - 1):
                    tried += 1
                    with pytest.raises(ValueError, match=method.name):
                        spoiled(method, name, row, column).check()
    assert tried > 30


DECLARED = {
    Tableau: ("order", "error_orders", "dense_order", "first_same_as_last"),
    Rosenbrock: ("order", "error_order", "dense_order"),
}


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_a_method_that_declares_what_its_coefficients_do_not_say_is_refused(method) -> None:
    for what in DECLARED[type(method)]:
        said = getattr(method, what)
        wrongs = {bool: lambda x: [not x], tuple: lambda x: [(*x[:-1], x[-1] + 1), x[1:]], int: lambda x: [x + 1, x - 1]}
        for wrong in wrongs[type(said)](said):
            with pytest.raises(ValueError, match=f"{method.name}: its coefficients give {what} = "):
                replace(method, **{what: wrong}).check()


def test_the_numbers_of_trees_are_those_of_the_textbooks() -> None:
    assert [len(trees(n)) for n in range(1, 10)] == [1, 1, 2, 4, 9, 20, 48, 115, 286]
    # A term times 7! is the number of increasing labellings of its tree. All trees together have 6! labellings.
    assert sum(1 / (density(t) * symmetry(t)) for t in trees(7)) == pytest.approx(1 / 7, rel=1e-14)


def symmetry(tree) -> int:
    """Number of ways in which a tree can be mapped onto itself."""
    out = 1
    for t in set(tree):
        out *= symmetry(t) ** tree.count(t) * factorial(tree.count(t))
    return out


def test_no_c_file_names_a_method() -> None:
    names = "|".join(m.name for m in REGISTRY)
    for file in sorted(RUNTIME.rglob("*.[ch]")):
        text = re.sub(r"/\*.*?\*/", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)
        found = re.findall(rf"(?i)\b(?:tr_)?(?:{names})\b(?!\.c)", text)
        # these words are also names of kinds
        assert set(found) <= {"rosenbrock", "tr_rosenbrock", "moreau", "tr_moreau"}, file.name


def test_an_unknown_method_is_reported_and_does_not_fall_through_to_another() -> None:
    model = Model(load_scene("simple_pendulum"))
    settings = bl.Settings().record(length=1.0, rate=1.0, energy=0.0)
    for number in (-1, len(bl.METHODS)):
        settings.method = number
        model.block.lib.tr_configure(model.block.at, ctypes.addressof(settings))
        assert model.block.assemble() == 1
        status = model.block.start(0.0, 1.0, 1.0, np.zeros(model.block.width))
        assert status == Status.FAIL_METHOD
        assert "use one of auto, rk5, rk8, rosenbrock, moreau" in str(from_status(status, 0.0, ""))
    with pytest.raises(SceneError, match="'euler' is unknown"):
        bl.Settings(method="euler").record(length=1.0, rate=1.0, energy=0.0)


def smooth() -> sm.Scene:
    """A driven base, an arm with spring and damper, and a ball under a changing torque. The three together use every part of a
    method."""
    link = sm.Body(box=(0.5, 0.1, 0.08), mass=1.2, center=(0.25, 0.02, 0.01), points={"end": (0.5, 0.0, 0.0)})
    torque = sm.Signal(harmonic=sm.Harmonic(0.03, 0.8, 0.0, 0.01))
    joints = {
        "rail": sm.Joint("prismatic", "ground", "cart", axis="x", drive=sm.Drive(harmonic=sm.Harmonic(0.3, 0.6, 0.4, 0.1))),
        "elbow": sm.Joint("revolute", "cart", "arm", axis="y", spring=sm.Spring(4.0, 0.2), damping=0.1, start=sm.Start(0.4, 1.0)),
        "ball": sm.Joint("spherical", "arm.end", "hand", start=sm.Start((1.0, 0.2, 0.1, -0.3), (1.0, -2.0, 1.5)),
                         effort=(torque, None, None)),
    }  # fmt: skip
    return sm.Scene({"cart": sm.Body(box=(0.1, 0.1, 0.1), mass=2.0), "arm": link, "hand": link}, joints, "smooth")


@cache
def exact():
    """The smooth scene's motion by SciPy at 1e-13."""
    block = Model(smooth(), ("*",)).block
    block.configure(bl.Settings())
    assert block.assemble() == 1
    return solve_ivp(
        lambda t, y: rate(block, y, t)[: block.ny],
        (0, UNTIL),
        block.y[: block.ny].copy(),
        "DOP853",
        rtol=1e-13,
        atol=1e-13,
        dense_output=True,
    )


def error(method: str, steps: int, every: float) -> float:
    """Largest error at the output times with fixed steps."""
    r = simulate(smooth(), until=UNTIL, every=every, step=UNTIL / steps, method=method)
    assert r.outcome.ok
    assert r.stats.rejected == 0
    assert r.stats.steps == steps
    truth = exact().sol(r.time)
    truth[:, -1] = exact().y[:, -1]
    quaternion = np.linalg.norm(truth[1:5], axis=0)
    truth[1:5] /= quaternion
    return max(float(np.abs(r[c] - truth[i]).max()) for i, c in enumerate(COLUMNS))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("which", ["solution", "dense output"])
@pytest.mark.parametrize("method", STEPS)
def test_the_error_falls_with_the_order_claimed(method: str, which: str) -> None:
    every = UNTIL if which == "solution" else UNTIL / 53  # 53 divides no number of steps: most rows lie inside a step
    errors = [error(method, n, every) for n in STEPS[method]]
    slope = -np.polyfit(np.log(STEPS[method]), np.log(errors), 1)[0]
    assert slope >= ORDERS[method][which != "solution"] - SLACK, errors
    assert errors[-1] < 2e-8


def pendulum(t: np.ndarray) -> np.ndarray:
    """Exact angle from the downward vertical of a point pendulum of 1 m that is released from the horizontal."""
    m, w = 0.5, np.sqrt(9.81)
    return 2 * np.arcsin(np.sqrt(m) * ellipj(ellipk(m) - w * t, m)[0])


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", [*METHODS, "auto"])
def test_the_error_follows_the_tolerance(method: str) -> None:
    """The errors of four swings are at most 250 times the tolerance of a step, over nine decades of tolerance. The test includes
    output times inside the steps."""
    tolerances, errors = 10.0 ** -np.arange(3, 13), []
    for rtol in tolerances:
        r = simulate("simple_pendulum", until=10.0, every=0.1, rtol=rtol, method=method, outputs=["bob.position*"])
        angle = pendulum(r.time)
        errors.append(np.hypot(r["bob.position[1]"] + np.sin(angle), r["bob.position[2]"] + np.cos(angle)).max())
    assert np.all(errors <= 500 * tolerances)
    assert np.all(errors >= 0.5 * tolerances)  # a smaller error would be more work than the tolerance requires
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 <= slope <= 1.2


def test_tighter_tolerances_take_steps_by_the_order() -> None:
    """h ∝ rtol^(1/p): a method of order 8 needs 10^(1/8) times the steps for each further decade of tolerance."""
    steps = {
        m: [simulate("simple_pendulum", until=10.0, every=10.0, rtol=r, method=m).stats.steps for r in (1e-6, 1e-10)]
        for m in METHODS
    }
    for method, (few, many) in steps.items():
        p = ORDERS[method][0]
        assert 4 / p * 0.7 <= np.log10(many / few) <= 4 / p * 1.5, method


def test_an_unstable_fixed_step_does_not_end_as_done() -> None:
    r = simulate("governor", until=0.05, every=0.01, step=0.01, method="rk5")
    assert not r.outcome.ok
    assert np.isfinite(r.data).all()
    assert r.time[-1] == pytest.approx(r.outcome.time, abs=1e-12)


@pytest.mark.parametrize("method", ["rk5", "rk8"])
def test_an_unstable_fixed_step_ends_as_not_finite_where_it_does(method: str) -> None:
    r = simulate("governor", until=1.0, every=0.01, step=0.01, method=method)
    assert (r.outcome.name, r.outcome.ok) == ("not_finite", False)
    assert r.outcome.joint in r.scene.joints
    assert "step" in r.outcome.advice
    assert np.isfinite(r.data).all()
    assert r.time[-1] == pytest.approx(r.outcome.time, abs=1e-12)  # the last row is at the end of the run


def test_works_asked_for_are_as_accurate_as_was_asked() -> None:
    """A driven joint with friction. The normal force nearly vanishes twice a turn. The friction does not affect the motion."""

    def work(rtol: float) -> np.ndarray:
        r = simulate("crank_slider", until=2.0, every=0.02, rtol=rtol, overrides=PAPER, outputs=["*.work", "energy.dissipated"])
        return r["slider_pin.friction.work"]

    fine = work(1e-12)
    for rtol in (1e-6, 1e-8):
        assert np.abs(work(rtol) - fine).max() <= 1000 * rtol * np.abs(fine).max()  # the errors of some 60 steps add up irregularly


@pytest.mark.parametrize("method", ["auto", "rosenbrock"])
def test_the_work_of_a_stiff_damper_is_precise_at_a_loose_tolerance(method: str) -> None:
    """The damper takes 0.003 J out of 169 J. The run integrates this work directly, not as a difference of the total energy."""
    taken = [simulate("governor", until=10.0, rtol=r, method=method)["energy.dissipated"][-1] for r in (1e-5, 1e-9)]
    assert taken[0] == pytest.approx(taken[1], rel=0.05)


def test_asking_for_works_leaves_the_motion_as_accurate() -> None:
    steps = [simulate("spatial_slider_crank", until=2.0, outputs=o).stats.steps for o in (["*.q[1]"], ["*.q[1]", "energy.*"])]
    assert steps[1] >= steps[0]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("share", "v_eps"), [(0.9999, 1e-4), (0.9999, 1e-3), (0.99, 1e-5)])
def test_a_velocity_that_creeps_just_below_the_kink_is_handed_to_the_stiff_method(share: float, v_eps: float) -> None:
    """A sleeve is pushed with slightly less than μN. An explicit method would pass v_eps some 10,000 times a second."""
    rub = sm.Friction(mu=0.4, half_length=0.08, half_width=0.03, half_height=0.02, law="regularized", v_eps=v_eps)
    joint = sm.Joint("prismatic", "ground", "block", axis="x", friction=rub)
    push = sm.Force("force", "block", (share * 0.4 * 2.0 * 9.81, 0.0, 0.0))
    scene = sm.Scene({"block": sm.Body(box=(0.1, 0.1, 0.1), mass=2.0)}, {"guide": joint}, "creep", forces={"push": push})
    r = simulate(scene, until=1.0, every=0.1, rtol=1e-6, max_steps=200)
    assert r.outcome.ok
    assert r["guide.qd[1]"][-1] == pytest.approx(share * v_eps, rel=1e-6)
