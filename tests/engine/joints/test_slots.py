"""Points on curves and pins in slots: a point stays on SciPy's spline, and the forces of contact and friction balance in the
curve's plane. Complex numbers give the derivatives of the reference."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from trunnion import sensitivity
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate

RATE, G, MU = 5.0, 9.81, 0.2
RUNS = [
    (False, 0, "parts", 0.0), (True, 0, "parts", MU), (False, 1, "parts", MU), (False, 1, "compiled", 0.0),
    (True, 1, "compiled", MU),
]  # fmt: skip


@dataclass
class Slot:
    """A curve in a part that turns at RATE, and a body in the plane whose point at ``arm`` stays on the curve. The curve is a
    spline over chord lengths."""

    points: np.ndarray
    closed: bool
    arm: complex
    mass: float
    inertia: float

    def __post_init__(self) -> None:
        p = np.vstack([self.points, self.points[:1]]) if self.closed else self.points
        self.u = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(p, axis=0).T))])
        self.spline = CubicSpline(self.u, p[:, 0] + 1j * p[:, 1], bc_type="periodic" if self.closed else "natural")

    def at(self, u: float, order: int = 0) -> complex:
        """The curve at a parameter, or a derivative; the curve continues straight beyond open ends."""
        end = min(max(u, 0.0), self.u[-1])
        if self.closed or u == end:
            return complex(self.spline(u, order))
        return (complex(self.spline(end)) + (u - end) * self.at(end, 1), complex(self.spline(end, 1)), 0j)[order]

    def foot(self, p: complex) -> float:
        """The parameter of the nearest place on the curve."""
        tries = np.linspace(-0.5, self.u[-1] + 0.5, 4001) if not self.closed else np.linspace(0, self.u[-1], 4001)
        end = np.clip(tries, 0.0, self.u[-1])
        near = tries[np.argmin(abs(p - self.spline(end) - (tries - end) * self.spline(end, 1)))]
        off = lambda u: ((p - self.at(u)) * np.conj(self.at(u, 1))).real  # noqa: E731
        step = tries[1] - tries[0]
        return brentq(off, near - step, near + step, xtol=1e-15, rtol=1e-15)

    def way(self, u: float) -> float:
        """The distance of the nearest place from the curve's first point, along the curve."""
        knots = [0.0, *[k for k in self.u[1:] if k < u], u]
        size = lambda x: abs(self.at(x, 1))  # noqa: E731
        return sum(quad(size, a, b, epsabs=1e-14, epsrel=1e-13)[0] for a, b in pairwise(knots))


def made(closed: bool, seed: int, mu: float = 0.0) -> tuple[Slot, sm.Scene]:
    rng = np.random.default_rng(seed)
    if closed:
        corners = np.exp(2j * np.pi * np.arange(7) / 7) * rng.uniform(0.06, 0.1, 7) + 0.02
        points = np.column_stack([corners.real, corners.imag])
    else:
        points = np.column_stack([np.linspace(-0.1, 0.15, 6), rng.uniform(-0.03, 0.03, 6)])
    s = Slot(points, closed, complex(*rng.uniform(-0.03, 0.03, 2)), *rng.uniform([0.3, 0.001], [1.0, 0.004]))
    start = s.at(0.4 * s.u[-1]) - s.arm
    rubs = f"friction: {{mu: {mu}}}," if mu else ""
    return s, scene_from_text(f"""
schema: 1
gravity: [0, {-G}, 0]
bodies:
  plate: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}
  bead: {{mass: {s.mass}, inertia: [0.1, 0.1, {s.inertia}], points: {{pin: [{s.arm.real}, {s.arm.imag}, 0]}}}}
joints:
  turn: {{type: revolute, axis: z, inboard: ground, outboard: plate, drive: {{constant: {{rate: {RATE}}}}}}}
  plane: {{type: planar, axis: z, reference: x, inboard: ground, outboard: bead, start: {{q: [{start.real}, {start.imag}, 0]}}}}
  slot: {{type: point_on_curve, axis: z, reference: x, inboard: plate, outboard: bead.pin, {rubs}
    curve: {{points: {points.tolist()}, closed: {str(closed).lower()}}}}}
simulation: {{until: 0.4 s, every: 20 ms}}
""")


Answer = tuple[np.ndarray, float, complex]


def asked(s: Slot, at: tuple[float, float, float, float], rates: tuple[complex, float], mu: float) -> Answer:
    """The forces and accelerations at t and θ, for a contact at the curve parameter u and a sliding rate. Returns acceleration (2)
    and angular acceleration of the body, normal force (positive to the right of the tangent), and the wrench of the curve on the
    body, world. Equations of balance and the constraint together determine these numbers."""
    t, theta, u, slides = at
    turned = np.exp(1j * RATE * t)
    way = s.at(u, 1) / abs(s.at(u, 1))
    n, along, reach = -1j * way * turned, way * turned, s.arm * np.exp(1j * theta)
    udot = slides / abs(s.at(u, 1))
    asks = turned * (s.at(u, 2) * udot**2 + 2j * RATE * s.at(u, 1) * udot - RATE**2 * s.at(u))
    for side in (1.0, -1.0):
        push = n - mu * side * np.sign(slides) * along
        A = np.zeros((4, 4))
        A[:3, :3] = np.diag([s.mass, s.mass, s.inertia])
        A[:3, 3] = -np.array([push.real, push.imag, (np.conj(reach) * push).imag])
        A[3, :3] = n.real, n.imag, (np.conj(reach) * n).imag
        right = [0.0, -G * s.mass, 0.0, (np.conj(n) * (asks + rates[1] ** 2 * reach)).real]
        x = np.linalg.solve(A, right)
        if x[3] * side >= 0:
            return x[:3], x[3], x[3] * push
    raise AssertionError("no side")


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("closed", "seed", "kernel", "mu"), RUNS)
def test_a_point_keeps_to_its_curve_and_presses_as_its_motion_asks(closed: bool, seed: int, kernel: str, mu: float) -> None:
    s, scene = made(closed, seed, mu)
    r = simulate(scene, rtol=1e-10, kernel=kernel)
    assert r.outcome.name == "done"
    for i, t in enumerate(r.time):
        x, y, theta = (float(r[f"plane.q[{k}]"][i]) for k in (1, 2, 3))
        place = x + 1j * y + s.arm * np.exp(1j * theta)
        u = s.foot(place * np.exp(-1j * RATE * t))
        assert abs(place * np.exp(-1j * RATE * t) - s.at(u)) < 1e-10
        gone = s.way(u) - float(r["slot.q[1]"][i])
        assert gone == pytest.approx(0.0, abs=1e-10)
        spin = float(r["plane.qd[3]"][i])
        moves = r["plane.qd[1]"][i] + 1j * r["plane.qd[2]"][i] + 1j * spin * (place - x - 1j * y) - 1j * RATE * place
        way = s.at(u, 1) / abs(s.at(u, 1)) * np.exp(1j * RATE * t)
        slides = float((np.conj(way) * moves).real)
        assert float(r["slot.qd[1]"][i]) == pytest.approx(slides, abs=1e-9)
        if mu and abs(slides) < 1e-6:
            continue  # this test has no value for friction at rest
        qdd, normal, force = asked(s, (t, theta, u, slides), (moves, spin), mu)
        assert [r[f"plane.qdd[{k}]"][i] for k in (1, 2, 3)] == pytest.approx(qdd, rel=1e-8, abs=1e-8)
        assert r["slot.reaction.force[2]"][i] == pytest.approx(-normal, rel=1e-8, abs=1e-8)
        assert r["turn.drive.effort[1]"][i] == pytest.approx((np.conj(place) * force).imag, rel=1e-8, abs=1e-8)
        if mu:
            assert r["slot.contact[1].normal_force"][i] == pytest.approx(abs(normal), rel=1e-8, abs=1e-8)
            # the angle tells which side of the slot presses
            assert abs(r["slot.contact[1].angle"][i]) == pytest.approx(0.0 if normal > 0 else np.pi)
    assert np.abs(r["energy.residual"]).max() < 1e-8


def straight(slope: float, more: str = "", start: float = 0.1, until: str = "1 s") -> sm.Scene:
    """A slide on a straight slot of 0.2 m that is inclined by an angle."""
    c, s = np.cos(slope), np.sin(slope)
    return scene_from_text(f"""
schema: 1
gravity: [0, {-G}, 0]
bodies:
  bead: {{mass: 0.4, inertia: [0.01, 0.01, 0.02]}}
joints:
  plane: {{type: planar, axis: z, reference: x, inboard: ground, outboard: bead, start: {{q: [{start * c}, {-start * s}, 0]}}}}
  slot: {{type: point_on_curve, axis: z, reference: x, inboard: ground, outboard: bead,
    curve: {{points: [[0, 0], [{0.2 * c}, {-0.2 * s}]]}}{more}}}
simulation: {{until: {until}, every: 10 ms}}
""")


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_friction_holds_a_pin_in_its_slot_up_to_its_angle(kernel: str) -> None:
    for more, holds in ((1e-6, False), (-1e-6, True)):
        r = simulate(straight(float(np.arctan(MU)) + more, f", friction: {{mu: {MU}}}"), kernel=kernel)
        assert (abs(r["slot.qd[1]"]).max() < 1e-12) == holds


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_pin_meets_the_end_of_its_slot_in_time_and_comes_back(kernel: str) -> None:
    stiff, slope = 1e6, 0.3
    r = simulate(straight(slope, f", end_stops: {{stiffness: {stiff}}}", until="0.5 s"), rtol=1e-10, kernel=kernel)
    pull = G * np.sin(slope)
    first = next(e for e in r.events if e.kind == "end_stop_engaged")
    assert first.joint == "slot"
    assert first.time == pytest.approx(np.sqrt(2 * 0.1 / pull), abs=1e-9)
    deepest = float(r["slot.q[1]"].max()) - 0.2
    most = 0.4 * pull / stiff + np.sqrt((0.4 * pull / stiff) ** 2 + 2 * 0.4 * pull * 0.1 / stiff)
    assert deepest <= most
    assert np.abs(r["energy.residual"]).max() < 1e-8
    assert r["slot.q[1]"].min() == pytest.approx(0.1, abs=1e-6)  # the end stop onto which the pin falls returns all energy


def yoke(mu: float, drive: str, extra: str = "") -> sm.Scene:
    """A Scotch yoke: the pin of a crank moves in a slot across the direction of a slide. The loop consists of a hinge, a guide and
    one constraint equation."""
    return scene_from_text(f"""
schema: 1
gravity: [0, 0, 0]
bodies:
  crank: {{mass: 1, inertia: [0.001, 0.001, 0.002], points: {{pin: [50 mm, 0, 0]}}}}
  slide: {{mass: 0.6, inertia: [0.001, 0.001, 0.001]}}
joints:
  turn: {{type: revolute, axis: z, inboard: ground, outboard: crank, {drive}}}
  guide: {{type: prismatic, axis: x, inboard: ground, outboard: slide, start: {{q: 0.05}}{extra}}}
  pin: {{type: point_on_curve, axis: z, reference: x, inboard: slide, outboard: crank.pin, friction: {{mu: {mu}}},
    curve: {{points: [[0, -60 mm], [0, 60 mm]]}}}}
simulation: {{until: 1 s, every: 10 ms}}
""")


def test_a_yoke_moves_as_a_sine_and_its_pin_changes_sides_in_time() -> None:
    r, rate = simulate(yoke(1e-9, "drive: {constant: {rate: 8}}"), rtol=1e-10), 8.0
    phase = rate * r.time
    assert r["guide.q[1]"] == pytest.approx(0.05 * np.cos(phase), abs=1e-12)
    assert r["pin.q[1]"] == pytest.approx(0.06 + 0.05 * np.sin(phase), abs=1e-12)
    assert r["turn.drive.effort[1]"] == pytest.approx(0.6 * rate**2 * 0.05**2 * np.cos(phase) * np.sin(phase), abs=1e-8)
    times = [e.time for e in r.events if e.joint == "pin" and e.kind == "separation"]
    wanted = [(k + 0.5) * np.pi / rate for k in range(3)]
    assert times[: len(wanted)] == pytest.approx(wanted[: len(times)], abs=1e-6)
    assert len(times) == sum((k + 0.5) * np.pi / rate < 1 for k in range(4))


@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_friction_holds_a_yoke_under_its_load_up_to_its_arms(kernel: str) -> None:
    # at 45 deg, a load F on the slide needs F r sin 45 from the crank; friction of the pin adds or subtracts mu F r cos 45
    mu, load, angle = 0.2, 5.0, np.pi / 4
    for side in (1, -1):
        most = load * 0.05 * (np.sin(angle) + side * mu * np.cos(angle))
        for more, holds in ((1e-6, False), (-1e-6, True)):
            torque = -(most + side * more * load * 0.05)
            scene = yoke(mu, f"start: {{q: {angle}}}, effort: {torque}", f", effort: {-load}")
            r = simulate(scene, kernel=kernel, overrides={"joints.guide.start.q": 0.05 * float(np.cos(angle))})
            assert (np.abs(r["turn.qd[1]"]).max() < 1e-12) == holds, (side, more)


def test_derivatives_of_a_run_on_a_curve_are_those_by_differences() -> None:
    s, scene = made(True, 1, MU)
    values = {"joints.slot.friction.mu": MU, "bodies.bead.mass": s.mass}
    columns = ("plane.qd[1]", "turn.drive.effort[1]", "slot.contact[1].normal_force", "slot.q[1]")
    # the run ends before the next point of the curve
    found = sensitivity(scene, tuple(values), columns, until=0.1, every=0.05, rtol=1e-10)
    h = 1e-5
    for path, at in values.items():
        up, down = (simulate(scene, until=0.1, every=0.05, rtol=1e-11, overrides={path: at + s * h}) for s in (1, -1))
        for column in columns:
            slope = (up[column] - down[column]) / (2 * h)
            assert found.d(column, path)[1:] == pytest.approx(slope[1:], rel=1e-6, abs=1e-6), (column, path)


def test_a_note_reports_where_the_force_on_a_bead_changes_sides() -> None:
    """The bead starts at the top with the speed v. The force is zero at cos φ = (2 + v²/(g R))/3. This holds whether or not the
    bead stays on the circle."""
    radius, speed = 0.5, 0.4
    angles = np.linspace(0, 2 * np.pi, 201)
    points = [[radius * float(np.sin(a)), radius * float(np.cos(a))] for a in angles[:-1]]
    scene = scene_from_text(f"""
schema: 1
gravity: [0, -9.81, 0]
bodies: {{bead: {{mass: 0.4, inertia: [0.01, 0.01, 0.02]}}}}
joints:
  plane: {{type: planar, axis: z, reference: x, inboard: ground, outboard: bead,
    start: {{q: [0, {radius}, 0], qd: [{speed}, 0, 0]}}}}
  hill: {{type: point_on_curve, axis: z, reference: x, inboard: ground, outboard: bead,
    curve: {{points: {points}, closed: true}}}}
simulation: {{until: 0.6 s, every: 10 ms}}
""")
    (note,) = (n for n in simulate(scene, rtol=1e-10).notes if n.startswith("hill: at t"))
    time = float(note.split(" s ")[0].rpartition(" ")[2])
    last = simulate(scene, rtol=1e-10, until=time, every=time)
    assert last["bead.position[2]"][-1] / radius == pytest.approx((2 + speed**2 / (9.81 * radius)) / 3, abs=1e-4)
