"""A robot's hinge whose friction grows with the transmitted torque, under constant torques. The motion is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict


@dataclass(frozen=True)
class Hinge:
    """Data of a hinge: torques of the motor and of the load on the arm, inertias of arm and rotor, friction a + b |T|. For a guide,
    the data are forces and masses. constant_back: a for backward motion."""

    arm: float
    rotor: float
    motor: float
    load: float
    constant: float
    constant_back: float
    driving: float
    driven: float
    rate: float
    slides: bool = False
    pin: str = "inboard"

    def scene(self) -> sm.Scene:
        """The scene, with all numbers of its friction."""
        word, kind = ("force", "prismatic") if self.slides else ("torque", "revolute")
        friction = {word: self.constant, f"back_{word}": self.constant_back, "load_friction": self.driving,
                    "load_friction_backward": self.driven}  # fmt: skip
        joint = {"type": kind, "axis": "x", "inboard": "ground", "outboard": "arm", "pin": self.pin, "effort": self.motor,
                 "friction": friction, "rotor_inertia": self.rotor, "start": {"qd": self.rate}}  # fmt: skip
        load = {"type": word, "on": "arm", word: [self.load, 0, 0]}
        body = {"mass": self.arm if self.slides else 1.0, "inertia": [self.arm] * 3}
        data = {"gravity": [0, 0, 0], "bodies": {"arm": body}, "joints": {"hinge": joint}, "forces": {"pull": load}}
        return scene_from_dict(data | {"simulation": {"until": 1.0, "every": 0.05}})

    def friction(self, torque: float, sense: float) -> float:
        """Largest friction, for the transmitted torque and the sense of the motion."""
        constant = self.constant if sense > 0 else self.constant_back
        return (self.driving if sense * torque > 0 else self.driven) * abs(torque) + constant

    def acceleration(self, sense: float) -> float:
        """Acceleration of the arm while it moves with this sense: motor − rotor a = T + friction, T = arm a − load."""
        constant = self.constant if sense > 0 else self.constant_back
        for side in (1, -1):  # side: sign of T
            k = 1 + sense * side * (self.driving if side * sense > 0 else self.driven)
            a = (self.motor + k * self.load - sense * constant) / (self.rotor + k * self.arm)
            if side * (self.arm * a - self.load) >= 0:
                return a
        raise AssertionError("one of the two powers flows")

    @property
    def share(self) -> float:
        """Friction that the hinge needs at rest, relative to its largest friction."""
        needed = self.motor + self.load
        return abs(needed) / self.friction(-self.load, needed)

    def places(self, times: np.ndarray) -> np.ndarray:
        """Angles of the arm. The motion has at most two parts of constant acceleration, and rest."""
        out, q, w, t = np.empty(len(times)), 0.0, self.rate, 0.0
        while True:
            if w == 0.0:
                a = 0.0 if self.share <= 1 else self.acceleration(np.sign(self.motor + self.load))
            else:
                a = self.acceleration(np.sign(w))
            now = times >= t
            out[now] = q + w * (times[now] - t) + 0.5 * a * (times[now] - t) ** 2
            if w * a >= 0:
                return out
            span = -w / a
            q, w, t = q + 0.5 * w * span, 0.0, t + span


def random_hinge(seed: int) -> Hinge:
    """A hinge or guide near the band of rest, at rest or in motion."""
    rng = np.random.default_rng(seed)
    load = float(rng.choice([-1, 1]) * rng.uniform(1, 10))
    a, back, b, driven = rng.uniform(0, 2), rng.uniform(0, 2), rng.uniform(0, 0.4), rng.uniform(0, 0.4)
    arm, rotor = rng.uniform(0.1, 2), float(rng.choice([0.0, rng.uniform(0.1, 2)]))
    rate = float(rng.choice([0.0, rng.uniform(-3, 3)]))
    motor = -load * rng.uniform(0.2, 1.8)
    slides, pin = bool(rng.choice([True, False])), str(rng.choice(["inboard", "outboard"]))
    return Hinge(arm, rotor, motor, load, a, back, b, driven, rate, slides, pin)
