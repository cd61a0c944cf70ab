"""Pins in slots: a pin between walls and ends, a pin that leaves by a mouth, and Geneva wheels."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from scipy.optimize import brentq

import trunnion
from tests.engine.unilateral.unilateral_scenes import body, in_plane, scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import simulate

Function = Callable[[float], float]
TURNS = 8.3
"""Turns of the driver of a Geneva wheel: the wheel is indexed eight or nine times."""


def first_root(functions: list[Function], start: float, end: float, points: int = 400) -> tuple[float, int] | None:
    """The first time after ``start`` at which a function falls through zero, and the index of the function. The search leaves out
    the first points, because there a function that begins at 0 is round-off."""
    grid = start + (end - start) * np.linspace(0.0, 1.0, points)[3:] ** 2
    values = np.array([[f(t) for t in grid[1:]] for f in functions])
    found = [(int(k[0]), i) for i, row in enumerate(values) if len(k := np.flatnonzero((row[:-1] > 0.0) & (row[1:] <= 0.0)))]
    if not found:
        return None
    first = min(k for k, _ in found)
    return min((brentq(functions[i], grid[k + 1], grid[k + 2], xtol=1e-15, rtol=1e-15), i) for k, i in found if k <= first + 1)


def flights(p: np.ndarray, v: np.ndarray, half: float, play: float, restitution: float, mouth: bool) -> Iterator[tuple[float, str]]:
    """Impacts of a point that flies straight inside a slot |x| ≤ half with round ends. The last entry is the time at which the
    point leaves by the mouth at +half. Each impact multiplies the normal rate by −``restitution``."""
    t = 0.0
    while True:
        hits = []
        for side in (1.0, -1.0):
            if v[1] * side > 0.0 and abs(p[0] + v[0] * (dt := (side * play - p[1]) / v[1])) <= half:
                hits.append((dt, np.array([0.0, -side])))
            if not (mouth and side > 0.0):
                d = p - [side * half, 0.0]
                b, a = d @ v, v @ v
                root = b * b - a * (d @ d - play**2)
                if root > 0.0 and (d + (dt := (np.sqrt(root) - b) / a) * v)[0] * side > 0.0:
                    q = d + dt * v
                    hits.append((dt, -q / np.hypot(*q)))
        leaves = (half - p[0]) / v[0] if mouth and v[0] > 0.0 else np.inf
        dt, n = min((h for h in hits if h[0] > 1e-12), key=lambda h: h[0], default=(np.inf, None))
        if leaves < dt:
            yield t + leaves, "leaves"
            return
        t, p, v = t + dt, p + dt * v, v - (1.0 + restitution) * (v @ n) * n
        yield t, "contact_closed"


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("seed", range(120))
def test_a_pin_flies_between_the_walls_and_round_ends_of_its_slot_as_by_hand(seed: int) -> None:
    rng = np.random.default_rng(seed)
    half, play, e, mouth = rng.uniform(0.05, 0.2), rng.uniform(0.01, 0.04), rng.uniform(0.3, 1.0), seed % 3 == 0
    v, turn, where = rng.uniform(-1, 1, 2) * [1.0, 0.7], rng.uniform(-3, 3), rng.uniform(-1, 1, 2)
    e = min(e, 0.99)
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    # the planar joint has e2 = z and e3 = x; the slot lies in the same axes
    ends = [list(map(float, where + s * half * along)) for s in (-1.0, 1.0)]
    slot = {"type": "pin_in_slot", "inboard": "ground", "outboard": "b", "axis": [0, 1, 0], "reference": [0, 0, 1]}
    slot |= {"curve": {"points": ends}, "slot": {"play": play} | ({"mouth": "end"} if mouth else {})}
    slot["unilateral"] = {"restitution": e, "starts": "open"}
    fly = in_plane("b", (*where, 0.0), (*(v[0] * along + v[1] * across), 0.0))
    made = scene({"b": body(1.0, 0.1)}, {"fly": fly, "slot": slot}, gravity=[0, 0, 0])
    expected = [x for x, _ in zip(flights(np.zeros(2), v, half, play, e, mouth), range(5), strict=False)]
    until = expected[-1][0] + 0.2 * (1.0 if expected[-1][1] == "leaves" else 1e-3)
    r = simulate(made, until=until, rtol=1e-10, kernel="parts", method=("auto", "rk5", "rosenbrock")[seed % 3])
    assert r.outcome.ok, r.outcome
    hits = [t for t, kind in expected if kind == "contact_closed"]
    assert [ev.kind for ev in r.events] == ["contact_closed"] * len(hits)
    assert [ev.time for ev in r.events] == pytest.approx(hits, abs=1e-9)
    assert r.audit.verdict == "within"


class Geneva:
    """A Geneva wheel. A driver turns at constant rate. Its pin enters the slots of a wheel with friction in its pivot. The methods
    give the motion of the wheel in closed form, while the pin pushes it and while it turns freely."""

    def __init__(self, rng: np.random.Generator):
        self.slots = int(rng.integers(3, 7))
        self.apart, self.rate = rng.uniform(0.08, 0.15), rng.uniform(2.0, 8.0)
        self.crank = self.apart * np.sin(np.pi / self.slots)
        self.mouth = self.apart * np.cos(np.pi / self.slots)
        self.play, self.inertia = rng.uniform(5e-5, 4e-4), rng.uniform(5e-4, 2e-3)
        self.torque, self.mu = rng.uniform(0.2, 1.0) * self.inertia * self.rate**2, rng.uniform(0.0, 0.3)
        self.start, self.rest = 0.5 * np.pi - np.pi / self.slots + rng.uniform(0.05, 0.3), np.pi / self.slots
        self.turn = 2.0 * np.pi / self.rate
        """Span of each search, s. The pin passes a mouth in each turn. In a longer search, ``first_root`` misses short flights. In
        a shorter search, the gap just after a release is round-off beyond the points that ``first_root`` leaves out."""
        self.until = TURNS * self.turn

    def scene(self) -> Scene:
        drive = {"constant": {"rate": -self.rate, "start": self.start}}
        z, far = [0, 0, 1], self.apart
        axle = {"body": "ground", "point": [far, 0, 0]}
        shaft = {"type": "revolute", "axis": z, "inboard": axle, "outboard": "driver", "drive": drive}
        pivot = {"type": "revolute", "axis": z, "inboard": "ground", "outboard": "wheel", "start": {"q": self.rest}}
        pivot["friction"] = {"torque": self.torque}
        pin = {"type": "pin_in_slot", "axis": z, "reference": [1, 0, 0], "inboard": "wheel"}
        pin |= {"outboard": {"body": "driver", "point": [-self.crank, 0, 0]}, "friction": {"mu": self.mu}}
        pin |= {"curve": {"points": [[0.05 * far, 0], [self.mouth, 0]]}, "unilateral": {"starts": "open"}}
        pin["slot"] = {"play": self.play, "mouth": "end", "repeated": self.slots}
        bodies = {"driver": body(1.0, 1e-3), "wheel": body(1.0, self.inertia)}
        return scene(bodies, {"shaft": shaft, "pivot": pivot, "pin": pin}, gravity=[0, 0, 0])

    def pin(self, t: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Distance and angle of the pin from the wheel's axis, each with its first and second derivative."""
        q, w = self.start - self.rate * t, -self.rate
        p = np.array([self.apart - self.crank * np.cos(q), -self.crank * np.sin(q)])
        v, a = self.crank * w * np.array([np.sin(q), -np.cos(q)]), self.crank * w * w * np.array([np.cos(q), np.sin(q)])
        r = np.hypot(*p)
        dr = p @ v / r
        ddr = (v @ v + p @ a - dr * dr) / r
        db = (p[0] * v[1] - p[1] * v[0]) / r**2
        return (r, dr, ddr), (np.arctan2(p[1], p[0]), db, (p[0] * a[1] - p[1] * a[0]) / r**2 - 2.0 * db * dr / r)

    def in_slot(self, t: float, angle: float) -> np.ndarray:
        """Position of the pin along and across the nearest slot of a wheel at this angle."""
        (r, *_), (b, *_) = self.pin(t)
        pitch = 2.0 * np.pi / self.slots
        off = (b - angle + 0.5 * pitch) % pitch - 0.5 * pitch
        return r * np.array([np.cos(off), np.sin(off)])

    def pushed(self, t: float, side: float) -> np.ndarray:
        """Angle, up to whole slots, rate and acceleration of the wheel while the pin touches a wall."""
        (r, dr, ddr), (b, db, ddb) = self.pin(t)
        root = np.sqrt(r * r - self.play**2)
        acceleration = ddb + side * self.play * (ddr / (r * root) - dr * dr * (1.0 / (r * r * root) + 1.0 / root**3))
        return np.array([b - np.arcsin(side * self.play / r), db + side * self.play * dr / (r * root), acceleration])

    def push(self, t: float, side: float) -> float:
        """Normal force of the wall, N. Along the slot, the pin drags the wheel by friction, with the lever ``play``."""
        (r, dr, _), _ = self.pin(t)
        _, rate, acceleration = self.pushed(t, side)
        torque = self.inertia * acceleration + self.torque * np.sign(rate)
        return torque * side / (np.sqrt(r * r - self.play**2) - self.play * self.mu * np.sign(dr))

    def run_out(self, t: float, begin: float, angle: float, rate: float) -> tuple[float, float]:
        """Angle and rate of the free wheel."""
        slow = self.torque / self.inertia
        dt = min(t - begin, abs(rate) / slow)
        return angle + rate * dt - 0.5 * np.sign(rate) * slow * dt * dt, rate - np.sign(rate) * slow * dt

    def events(self) -> Iterator[tuple[str, float]]:
        """Openings and closings of the contact, and the instant of a penetration at the mouth."""
        t, angle, rate, inside = 0.0, self.rest, 0.0, False
        while True:
            free, out = (t, angle, rate), 1.0 if inside else -1.0

            def place(x: float, free: tuple[float, float, float] = free) -> np.ndarray:
                return self.in_slot(x, self.run_out(x, *free)[0])

            mouth: list[Function] = [lambda x, out=out, place=place: out * (self.mouth - place(x)[0])]
            found = first_root([*mouth, lambda x, place=place: self.play - abs(place(x)[1])] if inside else mouth, t, t + self.turn)
            if not found or found[0] > self.until:
                return
            (t, which), across = found, place(found[0])[1]
            if which == 0:
                (angle, rate), inside = self.run_out(t, *free), not inside
                if inside and abs(across) > self.play:
                    yield "penetration", t
                    return
                continue
            yield "contact_closed", t
            side = float(np.sign(across))
            whole = self.run_out(t, *free)[0] - self.pushed(t, side)[0]
            if self.push(t, side) > 0.0:
                ends: list[Function] = [lambda x, side=side: self.push(x, side)]
                ends.append(lambda x: self.mouth**2 + self.play**2 - self.pin(x)[0][0] ** 2)
                found = first_root(ends, t, t + self.turn)
                if not found or found[0] > self.until:
                    return
                t, inside = found[0], found[1] == 0
                yield "contact_opened", t
            angle, rate, _ = self.pushed(t, side) + np.array([whole, 0.0, 0.0])


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("seed", range(120))
def test_a_pin_indexes_a_geneva_wheel_eight_times_at_the_instants_of_the_closed_form(seed: int) -> None:
    g = Geneva(np.random.default_rng(seed))
    expected = list(g.events())
    r = simulate(g.scene(), until=g.until, rtol=1e-11, kernel="parts")
    if expected[-1][0] == "penetration":
        assert (r.outcome.name, r.outcome.joint) == ("penetration", "pin")
        assert r.outcome.time == pytest.approx(expected.pop()[1], abs=1e-9)
    else:
        assert r.outcome.ok, r.outcome
    found = [(e.kind, e.time) for e in r.events if e.joint == "pin" and e.kind in ("contact_opened", "contact_closed")]
    assert [k for k, _ in found] == [k for k, _ in expected]
    assert [t for _, t in found] == pytest.approx([t for _, t in expected], abs=1e-9)


def test_a_pin_without_play_across_its_slot_bounces_at_rigid_ends() -> None:
    """A ``point_on_curve`` holds the pin on the line. The ends of the ``pin_in_slot`` stop the pin ``play`` beyond the line. On a
    slope, the pin bounces like a ball on the ground."""
    tilt, length, play, e = 0.5, 0.4, 0.01, 0.6
    line = {"inboard": "ground", "outboard": "b", "axis": [0, 1, 0], "reference": [0, 0, 1]}
    line["curve"] = {"points": [[0.0, 0.0], [-length * np.sin(tilt), length * np.cos(tilt)]]}
    ends = {"type": "pin_in_slot", "slot": {"play": play}, "unilateral": {"restitution": e, "starts": "open"}}
    groove, fly = line | {"type": "point_on_curve"}, in_plane("b", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    joints = {"fly": fly, "groove": groove, "ends": line | ends}
    r = simulate(scene({"b": body(1.0, 0.1)}, joints), until=1.3, rtol=1e-10, kernel="parts")
    fall = np.sqrt(2.0 * (length + play) / (9.81 * np.sin(tilt)))
    hits = [x.time for x in r.events if x.kind == "contact_closed"]
    assert len(hits) == 3
    assert hits == pytest.approx(fall * (1.0 + 2.0 * np.cumsum([0.0, e, e * e])), abs=1e-9)
    assert r.audit.verdict == "within"


def test_compiled_kernel_and_sweep_agree_with_the_closed_form_of_a_geneva_wheel() -> None:
    """The pin enters along the slot. It touches the wall where the crank has turned by φ with r (1 − cos φ) = play."""
    g = Geneva(np.random.default_rng(3))
    enters = (g.start - 0.5 * np.pi + np.pi / g.slots) / g.rate
    plays = [1e-4, 3e-4]
    touches = [enters + np.arccos(1.0 - c / g.crank) / g.rate for c in plays]
    path, until = "joints.pin.slot.play", touches[1] + 0.01
    for c, t in zip(plays, touches, strict=True):
        r = simulate(g.scene(), overrides={path: c}, until=until, rtol=1e-11, kernel="compiled")
        assert r.events[0].time == pytest.approx(t, abs=1e-9)
    table = trunnion.sweep(g.scene(), {path: plays}, until=until, reductions=["first:contact_closed"]).table
    assert table["first:contact_closed"].to_pylist() == pytest.approx(touches, abs=1e-8)
