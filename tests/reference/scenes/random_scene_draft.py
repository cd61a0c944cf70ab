"""A draft of a random scene in which devices interact: bodies, joints with friction, and loads under which sliding starts and
stops."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

GRAVITIES = ([0.0, 0.0, 0.0], [0.0, -9.81, 0.0], [0.0, 0.0, -9.81], [3.0, -9.0, -2.0])
"""Gravity, m/s²: none, along the plane of most linkages, across it, and oblique."""
Numbers = list[float]


@dataclass
class Draft:
    """A scene during its random generation."""

    rng: np.random.Generator
    bodies: dict[str, Any] = field(default_factory=dict)
    joints: dict[str, Any] = field(default_factory=dict)
    forces: dict[str, Any] = field(default_factory=dict)
    gravity: Numbers = field(default_factory=list)

    def __post_init__(self) -> None:
        self.gravity = self.gravity or list(GRAVITIES[int(self.rng.choice(4, p=[0.4, 0.3, 0.15, 0.15]))])

    def scene(self, until: float) -> dict[str, Any]:
        """The content of a scene file."""
        return {"schema": 1, "gravity": self.gravity, "bodies": self.bodies, "joints": self.joints, "forces": self.forces,
                "simulation": {"until": round(until, 3)}}  # fmt: skip

    # -- numbers ---------------------------------------------------------------------------------------------------------

    def of(self, low: float, high: float) -> float:
        """A uniform number."""
        return float(self.rng.uniform(low, high))

    def about(self, size: float) -> float:
        """A number of this size and any sign."""
        return self.of(0.4, 1.6) * size * (1 if self.rng.random() < 0.5 else -1)

    def chance(self, share: float) -> bool:
        """True with this probability."""
        return bool(self.rng.random() < share)

    def load(self, size: float, until: float) -> Any:
        """A ramp, a sine, a broken line or a constant. Most of these loads change sign during the run."""
        way = int(self.rng.choice(4, p=[0.35, 0.35, 0.2, 0.1]))
        if way == 0:
            first, last = self.about(size) * self.of(0, 1), self.about(size)
            return {"ramp": {"start": first, "end": last, "duration": self.of(0.3, 1.0) * until}}
        if way == 1:
            return {"harmonic": {"amplitude": self.about(size), "frequency": self.of(0.6, 2.5) / until, "phase": self.of(-1.5, 1.5),
                                 "offset": self.about(0.2 * size)}}  # fmt: skip
        if way == 2:
            times = np.concatenate([[0.0], np.sort(self.rng.uniform(0.1, 0.95, 3))]) * until
            return {"table": {"time": [float(t) for t in times], "value": [self.about(size) for _ in times]}}
        return self.about(size)

    def gripping(self, size: float, until: float) -> Any:
        """A brake force that grows, fades or varies, and is never negative."""
        way = int(self.rng.integers(3))
        if way == 0:
            low, high = self.of(0, 0.4) * size, self.of(0.8, 1.5) * size
            ends = (low, high) if self.chance(0.6) else (high, low)
            return {"ramp": {"start": ends[0], "end": ends[1], "duration": self.of(0.3, 0.9) * until}}
        if way == 1:
            half = self.of(0.4, 0.8) * size
            wave = {"amplitude": 0.95 * half, "frequency": self.of(0.6, 2.0) / until, "phase": self.of(-3, 3), "offset": half}
            return {"harmonic": wave}
        times = np.concatenate([[0.0], np.sort(self.rng.uniform(0.1, 0.95, 3))]) * until
        return {"table": {"time": [float(t) for t in times], "value": [self.of(0, 1.5) * size for _ in times]}}

    def lifting(self, until: float) -> Any:
        """The release signal of a latch. It lifts or lowers the hook, or keeps the hook down."""
        a, b = sorted(self.rng.uniform(0.2, 0.9, 2))
        tables = ([0.0, 0.0], [0.0, 1.0], [1.0, 0.0])
        value = tables[int(self.rng.choice(3, p=[0.3, 0.4, 0.3]))]
        return {"table": {"time": [float(a) * until, float(max(b, a + 0.05)) * until], "value": value}}

    def sudden(self, size: float, until: float, unit: str = " N*m") -> Any:
        """A step, pulses, a trapezoid, a limited sine or a formula of the time. Most of these loads change sign during the run.
        unit: unit of formulas."""
        way = int(self.rng.integers(5))
        if way == 0:
            first = self.about(size) * self.of(0, 1)
            return {"step": {"start": first, "end": self.about(size), "begin": self.of(0.1, 0.6) * until}}
        if way == 1:
            period = self.of(0.2, 0.5) * until
            often = {"period": period} if self.chance(0.6) else {}
            return {"pulse": {"base": self.about(0.3 * size), "peak": self.about(1.2 * size), "begin": self.of(0.05, 0.4) * until,
                              "duration": self.of(0.2, 0.8) * period, **often}}  # fmt: skip
        if way == 2:
            return {"trapezoid": {"base": self.about(0.3 * size), "peak": self.about(size)} | self._course(until)}
        if way == 3:
            wave = {"amplitude": 1.5 * self.about(size), "frequency": self.of(0.6, 2.5) / until, "phase": self.of(-1.5, 1.5)}
            return {"harmonic": wave, "limit": {"upper": self.of(0.4, 1.2) * size, "lower": -self.of(0.4, 1.2) * size}}
        size, pace, fade = self.about(size), self.of(4, 16) / until, self.of(0.3, 2) * until
        return {"expression": f"{size:.6g}{unit}*sin({pace:.6g} rad/s*t)*exp(-t/({fade:.6g} s))"}

    def rates(self, size: float, until: float) -> dict[str, Any]:
        """A drive whose rate is a trapezoid."""
        base = self.about(size) * self.of(0, 0.3)
        return {"drive": {"trapezoid": {"base": base, "peak": self.about(size)} | self._course(until)}}

    def _course(self, until: float) -> dict[str, Any]:
        rise, hold, fall = (self.of(0.05, 0.25) * until for _ in range(3))
        often = {"period": 1.1 * (rise + hold + fall)} if self.chance(0.3) else {}
        return {"rise": rise, "hold": hold, "fall": fall, "begin": self.of(0.0, 0.25) * until, **often}

    # -- nonlinear springs and dampers -----------------------------------------------------------------------------------

    def curved(self, reach: float, stiffness: float, damping: float, rest: float = 0.0) -> dict[str, Any]:
        """A nonlinear spring and a nonlinear damper. The spring hardens, or snaps through near its rest, within its reach. The
        damper differs between the directions, or is quadratic."""
        at = [rest + reach * x for x in (-1.5, -1.0, -0.4, 0.4, 1.0, 1.5)]
        middle = -self.of(0, 0.6) if self.chance(0.3) else self.of(0.05, 0.4)
        shares = (-self.of(3, 5), -1.0, -0.4 * middle, 0.4 * middle, self.of(0.6, 1.2), self.of(3, 5))
        out: dict[str, Any] = {"spring_curve": {"at": at, "effort": [stiffness * reach * x for x in shares]}}
        if self.chance(0.5):
            fast = stiffness * reach / max(damping, 1e-9)
            knee = self.of(0.1, 0.4)
            both = [(0.0, 0.0), (knee * fast, self.of(0.5, 0.9) * damping * knee * fast), (fast, damping * fast)]
            back = self.of(0.3, 3) if self.chance(0.5) else 0.0
            both = [(-v, -back * e) for v, e in reversed(both[1:]) if back] + both
            out["damping_curve"] = {"speed": [v for v, _ in both], "effort": [e for _, e in both]}
        elif self.chance(0.5):
            out["quadratic_damping"] = self.of(0.2, 2) * damping * damping / (stiffness * reach)
        return {"nonlinear": out}

    # -- friction --------------------------------------------------------------------------------------------------------

    def _law(self, mu: float) -> dict[str, Any]:
        way = self.rng.random()
        if way < 0.25:
            return {"mu": mu, "mu_static": mu * self.of(1.1, 1.5)}
        if way < 0.35:
            return {"mu": mu, "mu_static": mu * self.of(1.1, 1.4), "law": "stribeck", "v_stribeck": self.of(2e-3, 3e-2)}
        return {"mu": mu}

    def pin(self, torque: float = 0.05, thrust: bool = False) -> dict[str, Any]:
        """Friction of a revolute joint: friction of a journal, with or without a preload, or a constant torque of this size."""
        if self.chance(0.3):
            return {"friction": {"torque": self.of(0.3, 1.5) * torque}}
        rub = {**self._law(self.of(0.05, 0.35)), "radius": self.of(0.004, 0.012), "half_length": self.of(0.015, 0.03)}
        rub |= {"thrust_radius": self.of(0.004, 0.015)} if thrust or self.chance(0.2) else {}
        rub |= {"preload": self.of(0.5, 2) * torque / (0.2 * 0.008)} if self.chance(0.3) else {}
        return {"friction": rub}

    def guide(self, force: float = 2.0) -> dict[str, Any]:
        """Friction of a prismatic joint: friction of a sleeve long enough not to jam, or a constant force of this size."""
        if self.chance(0.3):
            return {"friction": {"force": self.of(0.3, 1.5) * force}}
        rub = {**self._law(self.of(0.03, 0.25)), "half_width": 0.02, "half_height": 0.02, "half_length": self.of(0.06, 0.15)}
        rub |= {"preload": self.of(0.5, 2) * force / 0.2} if self.chance(0.3) else {}
        return {"friction": rub}

    def teeth(self, share: float = 0.5) -> dict[str, Any]:
        """Friction of meshing teeth. A given share of the pairs has friction."""
        return {"friction": {"mu": self.of(0.03, 0.15), "pressure_angle": "20 deg"}} if self.chance(share) else {}

    def brake(self, torque: float, until: float) -> dict[str, Any]:
        """A brake about the axis of a revolute."""
        return {"friction": {"torque": self.gripping(torque, until)}}

    def freewheel(self, drag: float, grip: float) -> dict[str, Any]:
        """A freewheel with drag in one direction and a capacity in the other direction."""
        names = ("torque", "back_torque") if self.chance(0.5) else ("back_torque", "torque")
        return {"friction": dict(zip(names, (self.of(0.3, 1.5) * drag, self.of(0.5, 2.0) * grip), strict=True))}

    def unit(self, ratio: float, torque: float) -> dict[str, Any]:
        """A gear unit: its ratio and, in most cases, the losses of a catalogue. torque: size of the torque on the output shaft. A
        third of the units with losses are self-locking."""
        out: dict[str, Any] = {"ratio": self.about(ratio)}
        if self.chance(0.1):
            return out
        forward = self.of(0.5, 0.95)
        rub: dict[str, Any] = {"efficiency": forward}
        if self.chance(0.25):
            over = {"torque": [0.3 * torque, torque, 3 * torque]} if self.chance(0.5) else {"speed": [0.0, 2.0, 10.0]}
            rub["efficiency"] = over | {"value": [self.of(0.4, 0.6), self.of(0.6, 0.8), self.of(0.8, 0.95)]}
        way = int(self.rng.integers(3))
        rub |= ({}, {"efficiency_backward": 0.0}, {"efficiency_backward": self.of(0.2, 0.95)})[way]
        rub |= {"no_load_torque": self.of(0.02, 0.2) * torque / ratio} if self.chance(0.6) else {}
        rub |= {"mu_static": self.of(1.05, 1.3)} if self.chance(0.15) else {}
        return out | {"friction": rub}

    def loaded(self, size: float, key: str = "torque") -> dict[str, Any]:
        """Friction of a revolute or prismatic joint that grows with the transmitted torque or force."""
        rub = {key: self.of(0.1, 1.0) * size, "load_friction": self.of(0.03, 0.3)}
        rub |= {"load_friction_backward": self.of(0.05, 0.6)} if self.chance(0.6) else {}
        rub |= {f"back_{key}": self.of(0.1, 1.0) * size} if self.chance(0.3) else {}
        return {"friction": rub}

    # -- bodies and joints -----------------------------------------------------------------------------------------------

    def wheel(self, name: str, radius: float, at: Numbers, axis: str = "z", mass: float | None = None) -> None:
        """A disc, slightly out of balance."""
        m = mass or self.of(0.3, 1.5)
        spin = 0.5 * m * radius**2
        inertia = [spin if a == axis else 0.55 * spin for a in "xyz"]
        off = [0.0 if a == axis else self.of(-0.05, 0.05) * radius for a in "xyz"]
        self.bodies[name] = {"mass": m, "inertia": inertia, "position": at, "center": off}

    def block(self, name: str, at: Numbers, mass: float | None = None) -> None:
        """A block that slides."""
        m = mass or self.of(0.3, 1.5)
        self.bodies[name] = {"mass": m, "inertia": [m * 5e-4] * 3, "position": at, "points": {"o": [0, 0, 0]}}

    def bar(self, name: str, a: np.ndarray, b: np.ndarray) -> None:
        """A slender link between two points of the plane z = 0. Its frame lies in the middle of the link."""
        length, m = float(np.hypot(*(b - a))), self.of(0.3, 1.5)
        spin = m * length**2 / 12 + 1e-4
        middle, angle = (a + b) / 2, math.atan2(b[1] - a[1], b[0] - a[0])
        self.bodies[name] = {"mass": m, "inertia": [2e-4, spin, spin], "position": [float(middle[0]), float(middle[1]), 0.0],
                             "orientation": {"axis": "z", "angle": angle}}  # fmt: skip

    def join(self, name: str, kind: str, inboard: str, outboard: str, at: Numbers | np.ndarray | None, *more: dict[str, Any],
             axis: str | Numbers = "z") -> None:  # fmt: skip
        """A joint at a place of the world, with devices."""
        joint: dict[str, Any] = {"type": kind, "inboard": inboard, "outboard": outboard, "axis": axis}
        if at is not None:
            joint["at"] = [float(x) for x in at] + [0.0] * (3 - len(at))
        for one in more:
            joint |= one
        self.joints[name] = joint

    def rod(self, name: str, inboard: Any, outboard: Any) -> None:
        """A rod between two points. Its length is the distance of the points."""
        self.joints[name] = {"type": "rod", "inboard": inboard, "outboard": outboard}

    def stops(self, stiffness: float, low: float, high: float) -> dict[str, Any]:
        """End stops below and above 0, or only one of the two."""
        both: dict[str, Any] = {"stiffness": self.of(0.5, 2) * stiffness, "damping": self.of(0, 0.5)}
        which = int(self.rng.integers(3))
        both |= {"lower": -self.of(0.4, 1.2) * low} if which != 1 else {}
        both |= {"upper": self.of(0.4, 1.2) * high} if which != 0 else {}
        return {"end_stops": both}

    def going(self, rate: float, rest: float = 0.3) -> dict[str, Any]:
        """A start rate, or rest."""
        return {} if self.chance(rest) else {"start": {"qd": self.about(rate)}}
