"""Results of SciPy at rows 1 to 21 of the gallery: the regularised law and closed forms, SciPy's integrators on the engine's
equations, and plain linear algebra. Every function returns one statement for the table."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.benchmarks.numerical_error.pendulum_error import INERTIA, MU, OMEGA_EPS, G, L, M, R, alpha
from tests.engine.mechanisms.planar_friction_loops import FOUR_BAR
from tests.stability.entries.ball_pendulums import PAINLEVE
from tests.stability.entries.closed_loops import bricard
from tests.stability.entries.journal_bearings import GRIP, overhung
from tests.stability.entries.mass_springs_spin import governor
from tests.stability.entries.rest_and_dead_centres import MU as MU_TABLE
from tests.stability.entries.rest_and_dead_centres import SWING, TURNS
from tests.stability.gallery_entry import EDGE
from tests.stability.scene_verdicts import bundled
from trunnion.analysis.static_bounds.start_pose_statics import hold
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings


def zero_speed() -> str:
    """Row 1: sliding at zero speed."""
    edge = 1e-4 / R

    def rate(_t: float, y) -> list[float]:
        slow = abs(y[1]) < edge
        return [y[1], alpha(y[0], y[1] * OMEGA_EPS / edge) if slow else alpha(y[0], y[1], 1 if y[1] > 0 else -1)]

    s = solve_ivp(rate, (0.0, 10.0), [math.radians(2.0), 0.0], method="Radau", rtol=1e-8, atol=1e-12)
    return f"regularised at 1e-4 m/s: 2° creeps to {math.degrees(s.y[0, -1]):.3f}° in 10 s"


def small_v_eps() -> str:
    """Row 2: the pushed sleeve below its threshold; per unit of mass."""
    work = {}
    for v_eps in (1e-4, 1e-5, 1e-6):

        def rate(_t: float, v, v_eps=v_eps):
            return 0.4 * G * (1 - EDGE - np.clip(v / v_eps, -1, 1))

        s = solve_ivp(rate, (0.0, 0.01), [0.0], "DOP853", rtol=1e-6, atol=1e-12)
        work[v_eps] = int(s.nfev)
    return "regularised, DOP853, 0.01 s: " + ", ".join(f"{n} evaluations at v_eps {v * 1e6:.0f} µm/s" for v, n in work.items())


def short_journal() -> str:
    """Row 6: Adams' form of the friction, which the engine also offers."""
    scene = overhung(GRIP)
    joint = scene.joints["pin"]
    assert joint.friction is not None
    adams = replace(joint, friction=replace(joint.friction, normal_force="adams"))
    share = hold(replace(scene, joints={"pin": adams})).pairs[0].share
    return f"Adams' form μ r F (`normal_force: adams`) does not depend on c: it gives {100 / share:.1f} % of the required friction"


def painleve() -> str:
    """Row 7: α by fixed-point iteration. The friction torque of the last α gives the next α, at 1 rad and −2 rad/s."""

    def steps(share: float) -> int:
        reach, a = share * INERTIA / (M * L), 0.0
        for k in range(2000):
            force = M * math.hypot(L * 4 + G * math.cos(1.0), L * a + G * math.sin(1.0))
            new = (-M * G * L * math.sin(1.0) + reach * force) / INERTIA
            if abs(new - a) <= 1e-12 * abs(new):
                return k
            a = new
        return -1

    counts = [(s, steps(s)) for s in (0.5, 0.9, 1 + EDGE)]
    words = ", ".join(f"{k} steps" if k >= 0 else "no convergence in 2000 steps" for _, k in counts)
    return f"fixed point for the friction at 0.5, 0.9 and 1.000001 of the threshold: {words}; " + wrong_root()


def wrong_root() -> str:
    """The regularised pendulum beyond the threshold: the root of the squared equation, and its error in the law."""
    reach = PAINLEVE * (1 + EDGE) * MU / math.hypot(1, MU)
    q, s, c = reach * M, G * math.sin(1.0), 4 * L + G * math.cos(1.0)
    a, e = INERTIA**2 - (q * L) ** 2, INERTIA * s - L * M * L * s
    root = (q * q * L * s - INERTIA * M * L * s + q * math.sqrt(e * e + a * c * c)) / a
    torque = reach * M * math.hypot(c, L * root + s)
    ratio = (INERTIA * root + M * L * s) / torque
    ends = f"{root:.2g} rad/s², friction {ratio:.0f} times the law's"
    return f"the squared equation, as benchmarks integrate it, continues with {ends}"


def creep(acceleration: Callable[[float], float]) -> float:
    """Metres covered in 10 s from rest. acceleration(u): m/s² at the speed u v_eps, u at most 1, with v_eps = 1e-4 m/s."""

    def rate(_t: float, y) -> list[float]:
        return [y[1], acceleration(float(np.clip(y[1] / 1e-4, -1, 1)))]

    return float(solve_ivp(rate, (0.0, 10.0), [0.0, 0.0], "Radau", rtol=1e-8, atol=1e-12).y[0, -1])


def wedge() -> str:
    """Row 8: beyond the threshold the regularised sleeve creeps."""
    crept = creep(lambda v: 25.0 * (1 - 0.4 * v * 0.25 / 0.08))
    return f"regularised at 1e-4 m/s, offset 1.25 c/μ: the jammed sleeve creeps {1000 * crept:.2f} mm in 10 s"


def light_cart() -> str:
    """Row 9: energy error of the free cart of 1 mg. SciPy integrates the closed equation of motion with its defaults."""
    m = 1e-6

    def rate(_t: float, y) -> list[float]:
        s, c = math.sin(y[0]), math.cos(y[0])
        return [y[1], -((1 + m) * G * s + c * s * y[1] ** 2) / (m + s * s)]

    def energy(y) -> float:
        slide = -math.cos(y[0]) * y[1] / (1 + m)
        return 0.5 * m * slide**2 + 0.5 * ((slide + math.cos(y[0]) * y[1]) ** 2 + (math.sin(y[0]) * y[1]) ** 2) - G * math.cos(y[0])

    out = []
    for method in ("RK45", "LSODA", "Radau"):
        s = solve_ivp(rate, (0.0, 2.0), [math.pi / 2, 0.0], method)
        out.append(f"{method} {energy(s.y[:, -1]) / G:+.2g}")
    return "defaults, 2 s, energy gained in units of m g l: " + ", ".join(out)


def ours(scene: sm.Scene):
    """Right-hand side of Trunnion's equations without projection, and its start."""
    model, settings = Model(scene), Settings(rtol=1e-9)
    model.block.configure(settings)
    model.block.assemble()
    row = np.zeros(model.block.width)
    model.begin(settings, 0.0, 1.0, 1.0, row)
    block = model.block

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        block.y[: block.ny] = y
        block.start(t, t + 1.0, 1.0, row)
        return block.evaluate()[0].copy()

    return rate, block.y[: block.ny].copy()


def loop_drift() -> str:
    """Row 10: the drift of loops without projection."""
    rate, start = ours(bundled("crank_slider_free", 10.0)(0.0))
    gaps = []
    for until in (1.0, 10.0):
        s = solve_ivp(rate, (0.0, until), start, "RK45", rtol=1e-6, atol=1e-9)
        crank, slide, rod = s.y[:3, -1]
        gaps.append(math.hypot(0.5 * math.cos(crank) - slide + math.cos(rod), 0.5 * math.sin(crank) + math.sin(rod)))
    return f"RK45 at 1e-6 on accelerations: the loop is open by {gaps[0]:.1g} m after 1 s, {gaps[1]:.1g} m after 10 s"


def redundant() -> str:
    """Row 12: unit twists of the six hinges, five of which are unknown."""
    scene = bricard(0.0)
    corners = [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)]
    axes = [{"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[str(j.axis)] for j in scene.joints.values()]
    twists = np.array([[*a, *np.cross(p, a)] for p, a in zip(corners, axes, strict=True)], float).T
    rows = np.linalg.svd(np.array([axes[5]], float))[2][1:]
    J = np.vstack([twists[3:, :5] + np.cross(twists[:3, :5], corners[5], axis=0), rows @ twists[:3, :5]])
    size = np.linalg.svd(J, compute_uv=False)
    kkt = np.block([[np.eye(5), J.T], [J, np.zeros((5, 5))]])
    rank, condition = int((size > 1e-12).sum()), np.linalg.cond(kkt)
    return f"numpy: {len(J)} closing conditions of rank {rank}, condition of the usual matrix {condition:.0e}"


def stiff_springs() -> str:
    """Row 13: a governor with stiff springs."""
    rate, start = ours(governor(EDGE))
    work = {m: int(solve_ivp(rate, (0.0, 0.2), start, m, rtol=1e-6, atol=1e-9).nfev) for m in ("DOP853", "RK45", "Radau")}
    return "0.2 s at 1e-6: " + ", ".join(f"{m} {n} evaluations" for m, n in work.items())


def sticking_loop() -> str:
    """Row 14: torque at which least-norm friction releases the first joint."""
    loop, first, base, reach = FOUR_BAR, np.eye(3)[0], FOUR_BAR.balance(), FOUR_BAR.reach()

    def need(torque: float) -> float:
        def at(x):
            return loop.loads(x[:2], x[2], base + torque * first)

        zero = at(np.zeros(3))[1]
        A = np.array([at(e)[1] - zero for e in np.eye(3)]).T
        F, moments = at(np.linalg.lstsq(A, -zero, rcond=None)[0])
        return float(np.max(np.abs(moments) / (reach * np.hypot(*F.T)))) - 1.0

    most = loop.most(1.0)
    share = 100 * brentq(need, 1e-3 * most, 2 * most) / most
    return f"friction of least norm slips at {share:.0f} % of the torque that the joints can hold"


def fast_spin() -> str:
    """Row 15: Euler's equations and the quaternion, integrated over 4000 rad by RK45 with its defaults."""
    out = []
    for beyond in (-EDGE, EDGE):
        b = 0.3 * (1 + beyond)
        x, y, z = b * b + 0.01, 0.1, 0.09 + b * b

        def rate(_t, s, x=x, y=y, z=z):
            w, q = s[:3], s[3:]
            spin = np.array([(y - z) / x * w[1] * w[2], (z - x) / y * w[2] * w[0], (x - y) / z * w[0] * w[1]])
            return [*spin, -0.5 * w @ q[1:], *(0.5 * (q[0] * w + np.cross(q[1:], w)))]

        s = solve_ivp(rate, (0.0, 4000.0), [1e-3, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0], "RK45")
        out.append((abs(s.y[0, -1]) / 1e-3, np.linalg.norm(s.y[3:, -1])))
    words = f"the quaternion's length is {out[0][1]:.2f}, off the axis {out[0][0]:.1f} and {out[1][0]:.1f} times the start"
    return f"RK45's defaults, 4000 rad: {words} (right: 17.8 and at most 1)"


def contact_jumps() -> str:
    """Row 16: the time in which the contact normal of the regularised pendulum turns at the first stop."""
    ends = []
    for v_eps in (1e-3, 1e-4):
        edge = v_eps / R

        def rate(_t, y, edge=edge):
            return [y[1], alpha(y[0], float(np.clip(y[1] * OMEGA_EPS / edge, -OMEGA_EPS, OMEGA_EPS)))]

        def slow(_t, y, edge=edge):
            return abs(y[1]) - edge

        s = solve_ivp(rate, (0.0, 1.0), [math.pi / 2, 0.0], "Radau", rtol=1e-8, atol=1e-10, events=slow)
        ends.append(1000 * float(s.t_events[0][-1] - s.t_events[0][-2]))
    return f"regularised: no jump; the normal turns during {ends[0]:.2g} ms at v_eps 1e-3 m/s, {ends[1]:.2g} ms at 1e-4"


def axial_thrust() -> str:
    """Row 17: below the threshold."""
    most, inertia = 0.2 * 40.0 * 0.015, 0.5 * 3.0 * 0.01
    crept = creep(lambda v: 0.015 * most * (0.9 - v) / inertia) / 0.015
    return f"regularised at 1e-4 m/s, 0.9 of the torque: creeps {math.degrees(crept):.1f}° in 10 s"


def ratchet() -> str:
    """Row 21, one part in a million below the threshold."""

    def rate(t: float, y) -> list[float]:
        load = 1 - EDGE - SWING + SWING * math.sin(2 * math.pi * t)
        return [y[1], MU_TABLE * G * (load - float(np.clip(y[1] / 1e-4, -1, 1)))]

    s = solve_ivp(rate, (0.0, TURNS), [0.0, 0.0], "Radau", rtol=1e-8, atol=1e-12)
    away = f"{1e6 * s.y[0, -1]:.0f} µm"
    return f"regularised at 1e-4 m/s: below the threshold the block is {away} from its place after {TURNS} periods"


BY_ITSELF = (6, 12, 14)
"""Rows that use none of SciPy's own methods."""
STATEMENTS = {
    1: zero_speed, 2: small_v_eps, 6: short_journal, 7: painleve, 8: wedge, 9: light_cart, 10: loop_drift, 12: redundant,
    13: stiff_springs, 14: sticking_loop, 15: fast_spin, 16: contact_jumps, 17: axial_thrust,
    21: ratchet,
}  # fmt: skip
