"""The lock of a Geneva wheel: a disc of the driver between the horns and in the concave arcs of the wheel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

import trunnion
from tests.engine.unilateral.unilateral_scenes import G, body, in_plane, scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import simulate

Z, X = [0, 0, 1], [1, 0, 0]


def turned(angle: float) -> np.ndarray:
    """A unit vector in the plane at an angle from x."""
    return np.array([np.cos(angle), np.sin(angle)])


def across(a: np.ndarray, b: np.ndarray) -> float:
    """The z component of a cross product."""
    return float(a[0] * b[1] - a[1] * b[0])


class LockedGeneva:
    """A Geneva wheel around the origin and a driver around (apart, 0). The driver turns at the constant rate −``rate``. A torque
    acts on the wheel. ``side`` is +1 if this torque turns the wheel as the pin will, else −1. The wheel starts with its arc around
    the driver's axis. Its angle is measured from there."""

    def __init__(self, seed: int):
        rng = np.random.default_rng(seed)
        self.side = 1 if seed % 2 else -1
        self.slots, self.apart, self.rate = int(rng.integers(3, 7)), rng.uniform(0.08, 0.15), rng.uniform(2.0, 8.0)
        half = np.pi / self.slots
        self.crank, self.rim = self.apart * np.sin(half), self.apart * np.cos(half)
        least = self.apart - self.rim
        self.radius = least + rng.uniform(0.4, 0.8) * (self.crank - least)
        self.play = rng.uniform(2e-5, 6e-5)
        self.bore = self.radius + self.play
        cosine = (self.apart**2 + self.rim**2 - self.bore**2) / (2 * self.apart * self.rim)
        self.horn = self.rim * turned(-self.side * np.arccos(cosine))
        """The horn at which the torque holds the wheel, in the wheel's axes while its angle is 0."""
        self.inertia, self.mu = rng.uniform(5e-4, 2e-3), rng.uniform(0.0, 0.3)
        self.torque = self.side * self.inertia * self.rate**2 * rng.uniform(0.01, 0.03)
        self.cut = 0.5 * np.pi - half
        """Half of the angle of the cut-out. The pin enters where the edge of the disc is on the line of centres."""
        self.reach = float(np.arctan2(abs(self.horn[1]), self.apart - self.horn[0]))
        """Half of the angle of an arc."""
        fall = np.sqrt(2 * abs(self.angle_at_horn()) * self.inertia / abs(self.torque))
        self.start = self.cut + self.reach + self.rate * fall * rng.uniform(1.1, 1.5)
        self.pin_play = 2e-3

    # -- the scene ---------------------------------------------------------------------------------------------------------------

    def scene(self) -> Scene:
        half, crank = np.pi / self.slots, [-self.crank, 0, 0]
        points = {"pin": crank, "low": [*-self.radius * turned(-self.cut), 0], "high": [*-self.radius * turned(self.cut), 0]}
        driver = body(1.0, 1e-3) | {"points": points}
        middle, tip = half, abs(np.arctan2(self.horn[1], self.horn[0]))
        shaft = {"type": "revolute", "axis": Z, "inboard": {"body": "ground", "point": [self.apart, 0, 0]}, "outboard": "driver"}
        shaft["drive"] = {"constant": {"rate": -self.rate, "start": self.start}}
        pivot = {"type": "revolute", "axis": Z, "inboard": "ground", "outboard": "wheel", "effort": self.torque}
        pin = {"type": "pin_in_slot", "axis": Z, "reference": [*turned(half), 0], "inboard": "wheel", "outboard": "driver.pin"}
        pin |= {"curve": {"points": [[0.05 * self.apart, 0], [self.rim, 0]]}, "unilateral": {"starts": "open"}}
        pin["slot"] = {"play": self.pin_play, "mouth": "end", "repeated": self.slots}
        joints = {"shaft": shaft, "pivot": pivot, "pin": pin}
        disc = {"angle": [-np.pi + self.cut, 0, np.pi - self.cut], "radius": [self.radius] * 3}
        arc = {"angle": [np.pi - self.reach, np.pi, np.pi + self.reach], "radius": [self.bore] * 3}
        free = {"type": "cam", "axis": Z} | ({"friction": {"mu": self.mu}} if self.mu > 0.0 else {})
        free["unilateral"] = {"starts": "open", "thickness": 0.1 * self.radius}
        for k in range(self.slots):
            toward = turned(2 * k * middle)
            for word, sign in (("low", -1), ("high", 1)):
                horn = self.rim * turned(2 * k * middle + sign * tip)
                joints[f"horn{k}{word}"] = free | {"inboard": "driver", "reference": X, "profile": disc,
                    "outboard": {"body": "wheel", "point": [*horn, 0]}}  # fmt: skip
                joints[f"arc{k}{word}"] = free | {"inboard": {"body": "wheel", "point": [*self.apart * toward, 0]},
                    "reference": [*toward, 0], "profile": arc, "internal": True, "outboard": f"driver.{word}"}  # fmt: skip
        return scene({"driver": driver, "wheel": body(1.0, self.inertia)}, joints, gravity=[0, 0, 0])

    # -- by hand -----------------------------------------------------------------------------------------------------------------

    def angle_at_horn(self) -> float:
        """Angle of the wheel at which the horn touches the disc: the horn's distance from the driver's axis is the radius."""
        cosine = (self.apart**2 + self.rim**2 - self.radius**2) / (2 * self.apart * self.rim)
        return float(self.side * (abs(np.arctan2(self.horn[1], self.horn[0])) - np.arccos(cosine)))

    def force_at_horn(self) -> float:
        """Normal force on the horn of the locked wheel: the torques about the wheel's axis balance. The disc rubs the horn
        clockwise about the driver's axis."""
        at = self.rim * turned(np.arctan2(self.horn[1], self.horn[0]) + self.angle_at_horn())
        push = (at - [self.apart, 0]) / self.radius
        return -self.torque / across(at, push + self.mu * np.array([push[1], -push[0]]))

    def on_driver(self, t: float, radius: float, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration of a point of the driver. angle: measured from the direction of the pin."""
        way = -radius * turned(self.start - self.rate * t + angle)
        return np.array([self.apart, 0]) + way, self.rate * np.array([way[1], -way[0]]), -self.rate**2 * way

    def on_edge(self, t: float) -> np.ndarray:
        """Angle, rate and acceleration of a wheel whose arc touches the lower edge of the disc. The centre of the arc has the
        distance ``bore`` from the edge."""
        p, v, a = self.on_driver(t, self.radius, -self.cut)
        r = np.hypot(*p)
        dr, turn = p @ v / r, across(p, v) / r**2
        ddr, dturn = (v @ v + p @ a - dr * dr) / r, across(p, a) / r**2 - 2 * turn * dr / r
        gap = self.apart**2 - self.bore**2
        k, dk = (r * r + gap) / (2 * self.apart * r), dr * (1 - gap / r**2) / (2 * self.apart)
        ddk = ddr * (1 - gap / r**2) / (2 * self.apart) + dr * dr * gap / (self.apart * r**3)
        root = np.sqrt(1 - k * k)
        return np.array([np.arctan2(p[1], p[0]) + np.arccos(k), turn - dk / root, dturn - ddk / root - k * dk * dk / root**3])

    def gap_at_edge(self, t: float, angle: float) -> float:
        return float(self.bore - np.hypot(*(self.on_driver(t, self.radius, -self.cut)[0] - self.apart * turned(angle))))

    def place_of_pin(self, t: float, angle: float) -> np.ndarray:
        """Position of the pin along and across the slot that it enters."""
        p, turn = self.on_driver(t, self.crank, 0.0)[0], turned(angle - np.pi / self.slots)
        return np.array([p @ turn, across(turn, p)])


def falls(g: LockedGeneva, t: float, angle: float, rate: float) -> Callable[[float], float]:
    """The angle of a wheel that turns freely from an instant on."""
    return lambda x: angle + rate * (x - t) + 0.5 * g.torque / g.inertia * (x - t) ** 2


def zero(f: Callable[[float], float], a: float, b: float, points: int = 4000) -> float:
    """The first time between a and b at which a function falls through zero; infinity, if there is none."""
    grid = a + (b - a) * np.linspace(0, 1, points) ** 2
    values = np.array([f(x) for x in grid])
    found = np.flatnonzero((values[:-1] > 0) & (values[1:] <= 0))
    return float(brentq(f, grid[found[0]], grid[found[0] + 1], xtol=1e-16, rtol=1e-15)) if len(found) else np.inf


def expected(g: LockedGeneva) -> tuple[list[tuple[str, str, float]], float]:
    """Kind, joint and instant of the contacts of the lock, and the instant at which the pin touches the wall of its slot."""
    horn, angle = f"horn0{'low' if g.side > 0 else 'high'}", g.angle_at_horn()
    enters = (g.start - g.cut) / g.rate
    out = [("contact_closed", horn, float(np.sqrt(2 * angle * g.inertia / g.torque)))]
    if g.side < 0:
        touch = zero(lambda t: g.pin_play - abs(g.place_of_pin(t, angle)[1]), enters, enters + 0.5 / g.rate)
        return [*out, ("contact_closed", "pin", touch)], touch
    at = g.rim * turned(np.arctan2(g.horn[1], g.horn[0]) + angle) - [g.apart, 0]
    leaves = float(g.start - g.cut - np.arctan2(-at[1], -at[0])) / g.rate
    out.append(("contact_opened", horn, leaves))
    free = falls(g, leaves, angle, 0.0)
    lands = zero(lambda t: g.gap_at_edge(t, free(t)), leaves + 1e-9, enters)
    if lands < enters:
        parts = zero(lambda t: g.torque - g.inertia * g.on_edge(t)[2], lands, enters)
        out += [("contact_closed", "arc0low", lands), ("contact_opened", "arc0low", parts)]
        free = falls(g, parts, *g.on_edge(parts)[:2])
    touch = zero(lambda t: g.pin_play - abs(g.place_of_pin(t, free(t))[1]), enters, enters + 0.8 / g.rate)
    return [*out, ("contact_closed", "pin", touch)], touch


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("seed", range(120))
def test_a_disc_locks_a_geneva_wheel_until_the_pin_takes_over_as_by_hand(seed: int) -> None:
    g = LockedGeneva(seed)
    events, touch = expected(g)
    horn, locked = events[0][1], 0.5 * (events[0][2] + [*events, ("", "", touch)][1][2])
    r = simulate(g.scene(), until=touch + 1e-4 / g.rate, every=locked, rtol=1e-11, kernel="parts")
    assert r.outcome.ok, r.outcome
    rows = [e for e in r.events if e.kind.startswith("contact_")]
    if g.side < 0:  # at the takeover, the horn opens, or stays unloaded for an instant
        rows = [e for e in rows if e.kind != "contact_opened"]
    found = {(e.kind, e.joint): e.time for e in rows}
    assert len(found) == len(rows), "each contact has one row"
    assert found == pytest.approx({x[:2]: x[2] for x in events}, abs=1e-9)
    assert r["pivot.q[1]"][1] == pytest.approx(g.angle_at_horn(), abs=1e-12)
    assert r[f"{horn}.contact[1].normal_force"][1] == pytest.approx(g.force_at_horn(), rel=1e-9)
    assert r.audit.verdict == "within"


@pytest.mark.slow
def test_compiled_kernel_and_sweep_agree_with_the_closed_form_of_the_lock() -> None:
    """After the disc has left the horn, the torque turns the wheel from rest."""
    g = LockedGeneva(3)
    events, _ = expected(g)
    since, pace = 1e-3, g.torque / g.inertia
    until = events[1][2] + since
    r = simulate(g.scene(), until=until, every=until, rtol=1e-11, kernel="compiled")
    assert [e.time for e in r.events if e.kind != "slip"] == pytest.approx([x[2] for x in events[:2]], abs=1e-9)
    assert r["pivot.q[1]"][-1] == pytest.approx(g.angle_at_horn() + 0.5 * pace * since**2, abs=1e-9)
    torques = [g.torque, 2.0 * g.torque]
    table = trunnion.sweep(g.scene(), {"joints.pivot.effort": torques}, until=until, reductions=["first:contact_closed"]).table
    falls = [events[0][2], events[0][2] / np.sqrt(2.0)]
    assert table["first:contact_closed"].to_pylist() == pytest.approx(falls, abs=1e-8)


NAMES = ["joints.pivot.effort", "joints.shaft.drive.constant.rate"]


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(1, 120, 2))
def test_a_lock_with_friction_has_the_derivatives_of_its_closed_form(seed: int) -> None:
    """The force on the horn grows in proportion to the torque. A faster driver releases the horn earlier, and the wheel then turns
    longer."""
    g = LockedGeneva(seed)
    events, touch = expected(g)
    (_, horn, closes), (_, _, leaves) = events[:2]
    locked, ends = 0.5 * (closes + leaves), [*events, ("", "", touch)][2][2]
    since, pace = min(0.5 * (ends - leaves), 0.9 * (2 * locked - leaves)), g.torque / g.inertia
    outputs = ["pivot.q[1]", f"{horn}.contact[1].normal_force"]
    found = trunnion.sensitivity(g.scene(), NAMES, outputs, until=leaves + since, every=locked, rtol=1e-11).derivatives
    assert found[1] == pytest.approx(np.array([[0.0, 0.0], [g.force_at_horn() / g.torque, 0.0]]), rel=1e-7, abs=1e-7)
    assert found[-1, 0] == pytest.approx([0.5 * since**2 / g.inertia, -pace * since * leaves / g.rate], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 40, 2))
def test_a_lock_with_friction_has_the_derivatives_of_differences_until_the_pin_takes_over(seed: int) -> None:
    """Differences of 1e-5 leave an error of about 1e-7, relative to the largest derivative of a column."""
    g = LockedGeneva(seed)
    until = 0.999 * expected(g)[1]
    columns, values, part = ["pivot.q[1]", "pivot.qd[1]"], (g.torque, -g.rate), 1e-5
    found = trunnion.sensitivity(g.scene(), NAMES, columns, until=until, every=until, rtol=1e-11).derivatives[-1]
    for k, (name, value) in enumerate(zip(NAMES, values, strict=True)):
        runs = [simulate(g.scene(), until=until, every=until, rtol=1e-12, overrides={name: (1 + x) * value}, kernel="parts")
                for x in (-part, part)]  # fmt: skip
        change = [(runs[1][c][-1] - runs[0][c][-1]) / (2 * part * value) for c in columns]
        assert found[:, k] == pytest.approx(change, rel=1e-6)


def test_friction_on_three_feet_in_a_line_has_no_derivative_while_all_carry() -> None:
    """The loads of the feet depend on their stiffness, which the model lacks."""
    line = {"points": [[3.0, 0.0], [-3.0, 0.0]]}
    feet = {f"foot{k}": {"type": "point_on_curve", "axis": Z, "reference": X, "inboard": "ground", "curve": line, "unilateral": {},
                         "friction": {"mu": 0.2}, "outboard": {"body": "block", "point": [0.1 * (k - 1), -0.05, 0]}}
            for k in range(3)}  # fmt: skip
    fly = {"type": "planar", "axis": Z, "reference": X, "inboard": "ground", "outboard": "block"}
    fly["start"] = {"q": [0.0, 0.05, 0.0], "qd": [1.0, 0.0, 0.0]}
    made = scene({"block": body(1.0, 0.1)}, {"fly": fly} | feet, gravity=[0, -G, 0])
    with pytest.raises(trunnion.SimulationError, match="redundant constraints do not determine"):
        trunnion.sensitivity(made, ["bodies.block.mass"], ["fly.q[1]"], until=0.1, every=0.1)


@pytest.mark.parametrize("thickness", [0.05, 20.0])
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_block_falls_beside_a_table_and_returns_below_its_top(thickness: float, kernel: str) -> None:
    """The block bounces once, passes the end of the table, and a force pulls it back. Below the top of a thin table it passes. In a
    thick table it meets the side of the table."""
    height, speed, end, e, pull = 0.5, 1.0, 0.4, 0.5, 0.8
    top = {"type": "point_on_curve", "inboard": "ground", "outboard": "block", "axis": [0, 1, 0]}
    top |= {"curve": {"points": [[0.0, -3.0], [0.0, end]]}}
    top["unilateral"] = {"restitution": e, "starts": "open", "thickness": thickness}
    fly = in_plane("block", (height, 0.0, 0.0), (0.0, speed, 0.0), effort=[None, -pull, None])
    hit, back = np.sqrt(2 * height / G), (speed + np.sqrt(speed**2 - 2 * pull * end)) / pull
    r = simulate(scene({"block": body(1.0, 0.1)}, {"fly": fly, "top": top}), until=back + 0.1, rtol=1e-10, kernel=kernel)
    assert [(x.kind, x.time) for x in r.events] == [("contact_closed", pytest.approx(hit, abs=1e-9))]
    if thickness < 1.0:
        assert r.outcome.ok, r.outcome
    else:
        assert (r.outcome.name, r.outcome.joint) == ("penetration", "top")
        assert r.outcome.time == pytest.approx(back, abs=1e-9)
