"""Impacts of joints that only push: instants of a bouncing block, impulses with friction, limits of impacts, sweeps over impact
parameters."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import trunnion
from tests.default_case_selection import crossed, sampled
from tests.engine.unilateral.unilateral_scenes import G, body, box, corner, in_plane, rim, scene
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

CLOSE = 1e-9


def times(r: Result, kind: str, joint: str = "") -> list[float]:
    assert r.outcome.ok, r.outcome
    return [e.time for e in r.events if e.kind == kind and joint in ("", e.joint)]


def agrees_after_impact(r: Result, after: np.ndarray) -> None:
    """Compare the rates of the free joint after an impact with ``after``, to 1e-7 m/s and rad/s: gravity acts for 1e-9 s."""
    got = np.array([r[f"fly.qd[{k + 1}]"][-1] for k in range(len(after))])
    assert got == pytest.approx(after, abs=1e-7)
    assert r.audit.verdict == "within"


@pytest.mark.parametrize(
    ("restitution", "law", "kernel", "method"),
    crossed((0.0, 0.1, 0.5, 0.7, 0.9), ("newton", "poisson"), ("parts", "compiled"), ("rk5", "rk8", "rosenbrock", "auto")),
)
def test_a_block_bounces_at_the_instants_of_the_closed_form_and_rests_at_their_limit(
    restitution: float, law: str, kernel: str, method: str
) -> None:
    """Flights last e, e², e³ … times 2 v/g. The sum of this geometric series is the instant of rest."""
    table = {"type": "point_on_plane", "inboard": "ground", "outboard": "block", "axis": [0, 0, 1]}
    table["unilateral"] = {"restitution": restitution, "impact_law": law, "starts": "open"}
    start = {"q": [0.3, 0, 1, 1, 0, 0, 0], "qd": [0.5, 0, 0, 0, 0, 0]}
    fly = {"type": "free", "inboard": "ground", "outboard": "block", "start": start}
    made = scene({"block": body(2.0, 0.1)}, {"fly": fly, "table": table})
    fall = np.sqrt(2.0 / G)
    rest = fall * (1.0 + 2.0 * restitution / (1.0 - restitution))
    r = simulate(made, until=rest + 0.5, rtol=1e-9, kernel=kernel, method=method)
    expected = fall + 2.0 * fall * np.cumsum([0.0, *(restitution ** np.arange(1, 20))])
    hits = times(r, "contact_closed")
    count = min(len(hits), 20) if restitution else 1
    assert hits[:count] == pytest.approx(expected[:count], abs=CLOSE)
    assert len(hits) >= (20 if restitution >= 0.5 else 7 if restitution else 1)
    assert times(r, "contact_rests") == (pytest.approx([rest], abs=CLOSE) if restitution else [])
    assert r.audit.verdict == "within"
    assert r["fly.q[1]"][-1] == pytest.approx(0.3 + 0.5 * r.time[-1], abs=1e-9)
    assert -r["table.reaction.force[1]"][-1] == pytest.approx(2.0 * G, rel=1e-12)


def line(W: np.ndarray, mu: float, slide: float) -> np.ndarray:
    """Impulses per unit of the normal impulse: the point slides, or sticks if the cone holds it, or starts to slide."""
    hold = -W[1, 0] / W[1, 1]
    return np.array([1.0, -mu * np.sign(slide) if slide else np.clip(hold, -mu, mu)])


def impulses(W: np.ndarray, v: np.ndarray, mu: float, target: float, least: float) -> np.ndarray:
    """Normal and tangential impulse by Routh's path: friction opposes the sliding at each instant of the impact. The path ends at
    the rate ``target`` along the normal, but not before the normal impulse is ``least``."""
    p, slide = np.zeros(2), v[1]
    while True:
        way = line(W, mu, slide)
        rates, now = W @ way, v + W @ p
        end = (target - now[0]) / rates[0] if rates[0] > 0.0 else np.inf
        end = max(end, least - p[0])
        stop = -slide / rates[1] if slide * rates[1] < 0.0 else np.inf
        if end <= stop:
            return p + end * way
        p, slide = p + stop * way, 0.0


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("seed", range(120))
def test_the_end_of_a_rod_strikes_a_table_with_the_impulses_of_its_law(seed: int) -> None:
    """Impacts by Newton's and Poisson's laws, with Coulomb's cone for the impulses. Angle, speed, mass and friction are random."""
    rng = np.random.default_rng(seed)
    mass, inertia, length, angle = rng.uniform(0.5, 3), rng.uniform(0.01, 0.3), rng.uniform(0.2, 1), rng.uniform(-1.2, 1.2)
    mu, e, law = rng.uniform(0, 0.4), rng.uniform(0.1, 0.9), ("newton", "poisson")[seed % 2]
    point = (0.0, -length)
    lever = np.array([-length * np.sin(angle), -length * np.cos(angle)])  # x and z of the point, from the mass centre
    v = np.array([-rng.uniform(0.5, 3), rng.uniform(-3, 3), rng.uniform(-1, 1)])  # rates of z, x and the angle about y
    J = np.array([[1.0, 0.0, -lever[0]], [0.0, 1.0, lever[1]]])
    if (J @ v)[0] >= -0.1:
        v[0] -= (J @ v)[0] + 0.5
    fly = in_plane("rod", (-lever[1] + 1e-13, 0.0, angle), v)
    tip = corner("rod", point, mu, restitution=e, impact_law=law, starts="open")
    made = scene({"rod": body(mass, inertia)}, {"fly": fly, "tip": tip})
    r = simulate(made, until=1e-9, every=1e-9, kernel="parts")
    assert times(r, "contact_closed"), r.events
    Mi = np.diag([1 / mass, 1 / mass, 1 / inertia])
    W, u = J @ Mi @ J.T, J @ v
    p = impulses(W, u, mu, -e * u[0] if law == "newton" else 0.0, 0.0)
    if law == "poisson":
        p = p + impulses(W, u + W @ p, mu, 0.0, e * p[0])
    agrees_after_impact(r, v + Mi @ J.T @ p)


STOPPED = 1e-9
"""Speed at which the integrated path of an impact counts as stopped, m/s."""


def path(W: np.ndarray, v: np.ndarray, mu: float, target: float, least: float) -> np.ndarray:
    """Impulses of a point that slides in two directions, integrated over the normal impulse. Friction opposes the sliding at each
    instant. A point that stops sticks if the cone holds it, otherwise it slides on in a constant direction."""

    def rates(q: float, z: np.ndarray) -> np.ndarray:
        return v + W @ np.array([q, *z])

    def slide(q: float, z: np.ndarray) -> np.ndarray:
        return -mu * rates(q, z)[1:] / np.hypot(*rates(q, z)[1:])

    def stops(q: float, z: np.ndarray) -> float:
        return float(np.hypot(*rates(q, z)[1:]) - STOPPED)

    def ends(q: float, z: np.ndarray) -> float:
        return float(min(rates(q, z)[0] - target, q - least))

    stops.terminal = ends.terminal = True  # type: ignore[attr-defined]
    stops.direction, ends.direction = -1, 1  # type: ignore[attr-defined]
    p = np.zeros(3)
    if np.hypot(*v[1:]) > STOPPED:
        s = solve_ivp(slide, (0.0, 1e3), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13, events=[stops, ends])
        p = np.array([s.t[-1], *s.y[:, -1]])
        if len(s.t_events[1]):
            return p
    A, b = W[1:, 1:], W[1:, 0]
    hold = -np.linalg.solve(A, b)
    way = np.array([1.0, *hold]) if np.hypot(*hold) <= mu else np.array([1.0, *(-mu * constant_direction(A, b, mu))])
    return p + way * max((target - (v + W @ p)[0]) / (W[0] @ way), least - p[0])


def constant_direction(A: np.ndarray, b: np.ndarray, mu: float) -> np.ndarray:
    """The direction d in which a point at rest begins to slide: d is parallel to the change b − μ A d of its rates."""
    angles = np.linspace(0.0, 2 * np.pi, 721)

    def way(angle: float) -> np.ndarray:
        return np.array([np.cos(angle), np.sin(angle)])

    def turn(angle: float) -> float:
        change, d = b - mu * A @ way(angle), way(angle)
        return float(change[0] * d[1] - change[1] * d[0])

    found = []
    for k in range(720):
        if turn(angles[k]) * turn(angles[k + 1]) < 0.0:
            d = way(brentq(turn, angles[k], angles[k + 1], xtol=1e-15))
            found += [d] if (b - mu * A @ d) @ d > 0.0 else []
    assert len(found) == 1
    return found[0]


def check_strike(seed: int, strongest: float, slow: bool) -> None:
    """A point of a free body strikes a plane. Newton's and Poisson's laws; pose, rates, inertia, point and friction are random.
    strongest: largest coefficient of friction. slow: whether the point approaches much more slowly than it slides."""
    rng = np.random.default_rng(seed)
    mass, inertia = rng.uniform(0.5, 3), rng.uniform(0.01, 0.2, 3)
    inertia[2] = max(min(inertia[2], 0.9 * (inertia[0] + inertia[1])), 1.1 * abs(inertia[0] - inertia[1]))
    turn, point = Rotation.random(random_state=seed), rng.uniform(-0.4, 0.4, 3)
    mu, e, law = rng.uniform(0.05, strongest), rng.uniform(0.1, 0.9), ("newton", "poisson")[seed % 2]
    R = turn.as_matrix()
    arm = R @ point
    J = np.hstack([np.eye(3), np.cross(np.eye(3), arm).T])[[2, 0, 1]]
    v = np.array([*rng.uniform(-2, 2, 2), -rng.uniform(0.5, 3), *rng.uniform(-3, 3, 3)])
    if (J @ v)[0] > -0.3:
        v[2] -= (J @ v)[0] + 0.5
    if slow:
        v[2] -= (J @ v)[0] + rng.uniform(0.02, 0.3)
    x, y, z, w = turn.as_quat()
    start = {"q": [0.0, 0.0, float(1e-13 - arm[2]), *map(float, (w, x, y, z))], "qd": list(map(float, v))}
    fly = {"type": "free", "inboard": "ground", "outboard": "b", "start": start}
    tip = {"type": "point_on_plane", "inboard": "ground", "axis": [0, 0, 1], "friction": {"mu": float(mu)}}
    tip |= {"outboard": {"body": "b", "point": list(map(float, point))}}
    tip |= {"unilateral": {"restitution": float(e), "impact_law": law, "starts": "open"}}
    made = scene({"b": {"mass": float(mass), "inertia": list(map(float, inertia))}}, {"fly": fly, "tip": tip})
    r = simulate(made, until=1e-9, every=1e-9, kernel="parts")
    assert times(r, "contact_closed"), r.events
    Mi = np.zeros((6, 6))
    Mi[:3, :3], Mi[3:, 3:] = np.eye(3) / mass, R @ np.diag(1 / inertia) @ R.T
    W, u = J @ Mi @ J.T, J @ v
    p = path(W, u, mu, -e * u[0] if law == "newton" else 0.0, 0.0)
    if law == "poisson":
        p = p + path(W, u + W @ p, mu, 0.0, e * p[0])
    agrees_after_impact(r, v + Mi @ J.T @ p)


PUSHED = 1e-12
"""What the rates of dampers lack where their path ends, relative to the largest rate."""


def newton(W: np.ndarray, v: np.ndarray, mu: float, target: np.ndarray) -> np.ndarray:
    """Impulses of two points and of their common friction, whose rate is the last of ``v``. Each closed point has its target rate.
    The points stick, or slip against their friction."""
    found = []
    for closed, mode in product(([0, 1], [0], [1]), (0.0, 1.0, -1.0)):
        A, b = np.eye(3), np.zeros(3)
        for c in closed:
            A[c], b[c] = W[c], target[c] - v[c]
        if mode:
            A[2, :2] = mode * mu
        else:
            A[2], b[2] = W[2], -v[2]
        p = np.linalg.solve(A, b)
        after = v + W @ p
        pushes = p[:2].min() >= 0.0 and (after[:2] >= target - CLOSE).all()
        if pushes and (mode * after[2] > 0.0 if mode else abs(p[2]) <= mu * p[:2].sum()):
            found.append(p)
    assert len(found) == 1
    return found[0]


def flat_path(W: np.ndarray, v: np.ndarray, mu: float, target: np.ndarray) -> np.ndarray:
    """Impulses of two points that push as equal dampers, and of their common friction, until their sliding stops or both have their
    target rates. The last of ``v`` is the sliding rate."""
    slides = float(np.sign(v[2]))

    def growth(_: float, p: np.ndarray) -> np.ndarray:
        push = np.maximum(target - (v + W @ p)[:2], 0.0)
        return np.array([*push, -mu * slides * push.sum()])

    def stops(_: float, p: np.ndarray) -> float:
        return float(slides * (v + W @ p)[2])

    def rests(_: float, p: np.ndarray) -> float:
        return float(np.maximum(target - (v + W @ p)[:2], 0.0).max() - PUSHED * np.abs(v).max())

    stops.terminal = rests.terminal = True  # type: ignore[attr-defined]
    s = solve_ivp(growth, (0.0, 1e3), np.zeros(3), "DOP853", rtol=1e-12, atol=1e-13, events=[stops, rests])
    return s.y[:, -1]


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("seed", range(120))
def test_two_corners_of_a_box_strike_a_table_together_as_equal_dampers_until_they_stop_sliding(seed: int) -> None:
    """The box lands flat. If its corners slide on, Newton's law alone decides. Otherwise this law decides after the stop. Corners,
    speed, inertia, restitution and friction are random."""
    rng = np.random.default_rng(seed)
    mass, inertia, height, mu = rng.uniform(0.5, 3), rng.uniform(0.01, 0.3), rng.uniform(0.1, 0.5), rng.uniform(0, 0.6)
    sides, e = {"left": -rng.uniform(0.1, 0.4), "right": rng.uniform(0.1, 0.4)}, rng.uniform(0.0, 0.9, 2)
    v = np.array([-rng.uniform(0.5, 3), rng.uniform(-1.5, 1.5), 0.0])
    corners = {
        name: corner("box", (x, -height), mu, restitution=float(r), starts="open")
        for (name, x), r in zip(sides.items(), e, strict=True)
    }
    made = scene({"box": body(mass, inertia)}, {"fly": in_plane("box", (height + 1e-13, 0.0, 0.0), v), **corners})
    r = simulate(made, until=1e-9, every=1e-9, kernel="parts")
    assert len(times(r, "contact_closed")) == 2, r.events
    J = np.array([[1.0, 0.0, -sides["left"]], [1.0, 0.0, -sides["right"]], [0.0, 1.0, -height]])
    Mi = np.diag([1 / mass, 1 / mass, 1 / inertia])
    W, u = J @ Mi @ J.T, J @ v
    p = newton(W, u, mu, -e * u[:2])
    if (u + W @ p)[2] * u[2] <= CLOSE:
        p = flat_path(W, u, mu, -e * u[:2])
        p = p + newton(W, (u + W @ p) * [1.0, 1.0, 0.0], mu, -e * u[:2])
    agrees_after_impact(r, v + Mi @ J.T @ p)


@pytest.mark.default_cases(8)
@pytest.mark.parametrize("seed", range(120))
def test_a_point_of_a_free_body_strikes_a_plane_with_friction_that_turns_with_the_sliding(seed: int) -> None:
    check_strike(seed, 0.5, slow=False)


@pytest.mark.parametrize("seed", sampled(range(240), (0, 100, 144, 206)))
def test_a_point_that_slides_much_faster_than_it_approaches_is_pushed_and_never_pulled(seed: int) -> None:
    """With strong friction, a point that sticks would need an impulse that pulls."""
    check_strike(seed, 1.5, slow=True)


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_wheel_slides_until_it_rolls_and_leaves_no_energy_unexplained(kernel: str) -> None:
    """A solid wheel starts with the speed v and without rotation. It rolls after v/(3 μ g), with 2/3 of this speed."""
    mu, radius, v, mass = 0.3, 0.25, 2.0, 3.0
    fly = in_plane("wheel", (radius, 0.0, 0.0), (0.0, v, 0.0))
    made = scene({"wheel": body(mass, 0.5 * mass * radius**2)}, {"fly": fly, "rim": rim("wheel", radius, mu)})
    r = simulate(made, until=1.0, rtol=1e-10, kernel=kernel)
    assert times(r, "stick") == pytest.approx([v / (3 * mu * G)], abs=CLOSE)
    assert r["fly.qd[2]"][-1] == pytest.approx(2 * v / 3, abs=CLOSE)
    assert r["fly.qd[3]"][-1] == pytest.approx(2 * v / 3 / radius, abs=1e-8)
    assert r.audit.verdict == "within"


def test_a_falling_wheel_with_friction_gains_spin_at_each_impact() -> None:
    """The tangential impulse is μ times the normal impulse until the wheel leaves an impact rolling."""
    mu, radius, mass, e, v = 0.1, 0.2, 1.0, 0.5, 3.0
    fly = in_plane("wheel", (radius + 0.5, 0.0, 0.0), (0.0, v, 0.0))
    own = rim("wheel", radius, mu, restitution=e, starts="open")
    made = scene({"wheel": body(mass, 0.5 * mass * radius**2)}, {"fly": fly, "rim": own})
    r = simulate(made, until=1.6, rtol=1e-10)
    fall = np.sqrt(2 * G * 0.5)
    hits = times(r, "contact_closed")
    slip, vx, w = v, v, 0.0
    for k, t in enumerate(hits[:8]):
        p = min(mu * mass * (1 + e) * fall * e**k, slip * mass / 3)
        vx, w = vx - p / mass, w + p / (0.5 * mass * radius)
        slip = vx - w * radius
        row = np.searchsorted(r.time, t + 1e-12, side="right")
        assert r["fly.qd[2]"][row] == pytest.approx(vx, abs=CLOSE)
    assert r.audit.verdict == "within"


def test_a_block_on_a_rail_bounces_between_two_hard_walls() -> None:
    """Without gravity, the flight from the k-th wall to the next wall takes L/(e^k v). The speed is constant between impacts."""
    length, e, v = 0.4, 0.8, 2.0
    rail = {"type": "prismatic", "inboard": "ground", "outboard": "block", "axis": [1, 0, 0], "start": {"q": 0.1, "qd": v}}
    walls = {
        name: {"type": "point_on_plane", "inboard": {"body": "ground", "point": [at, 0, 0]}, "outboard": "block",
               "axis": [side, 0, 0], "unilateral": {"restitution": e, "starts": "open"}}
        for name, at, side in (("near", 0.0, 1), ("far", length, -1))
    }  # fmt: skip
    r = simulate(scene({"block": body(2.0, 0.1)}, {"rail": rail, **walls}, gravity=[0, 0, 0]), until=1.5, rtol=1e-9)
    hits = times(r, "contact_closed")
    expected = 0.3 / v + np.cumsum([0.0, *(length / (v * e ** np.arange(1, len(hits))))])
    assert hits == pytest.approx(expected, abs=CLOSE)
    assert len(hits) >= 4
    assert [x.joint for x in r.events[:3]] == ["far", "near", "far"]
    assert r["rail.qd[1]"][-1] == pytest.approx((-e) ** len(hits) * v, abs=CLOSE)


def test_a_sweep_over_restitution_counts_the_impacts_of_single_runs() -> None:
    made = box(0.3, 0.2, 0.5, 1.0, 0.1, (0.9, 0.0, 0.0), (0.0, 1.0, 0.0), restitution=0.5, starts="open")
    path, values = "joints.left.unilateral.restitution", (0.3, 0.6)
    reductions = ["final:fly.q[1]", "count:contact_closed"]
    table = trunnion.sweep(made, {path: list(values)}, until=0.7, reductions=reductions).table
    for k, value in enumerate(values):
        r = trunnion.simulate(made, until=0.7, overrides={path: value})
        assert table["final:fly.q[1]"][k].as_py() == pytest.approx(r["fly.q[1]"][-1], abs=1e-9)
        assert table["count:contact_closed"][k].as_py() == sum(e.kind == "contact_closed" for e in r.events)
