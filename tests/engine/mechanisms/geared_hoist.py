"""A motor that turns a drum through a gearbox, under constant torques. The motion is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict


@dataclass(frozen=True)
class Hoist:
    """A hoist. The torques act on the two shafts. Efficiencies and no-load torque are as in a catalogue. rate: of the drum at the
    start."""

    ratio: float
    rotor: float
    drum: float
    motor: float
    load: float
    forward: float
    backward: float
    no_load: float
    rate: float = 0.0

    def scene(self, **friction: object) -> sm.Scene:
        """The scene. ``friction``: keys that replace or extend the keys of the gearbox."""
        keys = {"efficiency": self.forward, "efficiency_backward": self.backward, "no_load_torque": self.no_load} | friction
        inertias = {"rotor": self.rotor, "drum": self.drum}
        efforts, rates = {"rotor": self.motor, "drum": self.load}, {"rotor": self.ratio * self.rate, "drum": self.rate}
        joints = {f"{n}_bearing": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": n, "effort": efforts[n],
                                   "start": {"qd": rates[n]}} for n in inertias}  # fmt: skip
        joints["box"] = {"type": "gearbox", "inboard": "rotor", "outboard": "drum", "ratio": self.ratio, "friction": keys}
        bodies = {n: {"mass": 1.0, "inertia": [J] * 3} for n, J in inertias.items()}
        data = {"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints}
        return scene_from_dict(data | {"simulation": {"until": 1.0, "every": 0.05}})

    def friction(self, torque: float, sense: float) -> float:
        """Largest friction at the drum for a torque and a sense of the motion, from the catalogue's efficiencies."""
        taken = torque / self.forward if sense * torque > 0 else self.backward * torque
        return abs(taken - torque) + abs(self.ratio) * self.no_load

    def acceleration(self, sense: float) -> float:
        """Acceleration of the drum while it moves with this sense: i T_in = T + η, where both torques follow from the balance of
        the shafts."""
        i, geared = self.ratio, self.ratio**2 * self.rotor
        for c, side in ((1 / self.forward - 1, sense), (1 - self.backward, -sense)):  # side: sign of the torque on the drum
            # i motor − geared a = T + sense (c side T + |i| no_load),  T = drum a − load
            k = 1 + sense * side * c
            a = (i * self.motor + k * self.load - sense * abs(i) * self.no_load) / (geared + k * self.drum)
            if side * (self.drum * a - self.load) >= 0:
                return a
        raise AssertionError("one of the two powers flows")

    @property
    def spare(self) -> float:
        """Reserve of friction at rest, relative to the largest friction; negative if the drum starts to move."""
        needed = self.ratio * self.motor + self.load
        return 1 - abs(needed) / self.friction(-self.load, needed)

    def angles(self, times: np.ndarray) -> np.ndarray:
        """Angles of the drum. The motion has at most two parts of constant acceleration, and rest."""
        out, q, w, t = np.empty(len(times)), 0.0, self.rate, 0.0
        while True:
            if w == 0.0:
                a = 0.0 if self.spare >= 0 else self.acceleration(np.sign(self.ratio * self.motor + self.load))
            else:
                a = self.acceleration(np.sign(w))
            now = times >= t
            out[now] = q + w * (times[now] - t) + 0.5 * a * (times[now] - t) ** 2
            if w * a >= 0:
                return out
            span = -w / a
            q, w, t = q + 0.5 * w * span, 0.0, t + span


def random_hoist(seed: int) -> Hoist:
    """A hoist at rest or in motion, whose torques are near the bands of lifting, holding and lowering."""
    rng = np.random.default_rng(seed)
    ratio = float(rng.choice([-1, 1]) * rng.uniform(2, 60))
    forward, backward = float(rng.choice([0.9, 0.6, rng.uniform(0.3, 1)])), float(rng.choice([0.9, 0.6, 0.0]))
    load, drum = float(rng.choice([-1, 1]) * rng.uniform(1, 20)), rng.uniform(0.1, 2)
    motor = -load / ratio * rng.uniform(-0.5, 2.5)
    rotor = drum / ratio**2 * rng.uniform(0.2, 3)
    no_load = abs(load / ratio) * float(rng.choice([0.0, rng.uniform(0, 0.3)]))
    rate = float(rng.choice([0.0, rng.uniform(-3, 3)]))
    return Hoist(ratio, rotor, drum, motor, load, forward, backward, no_load, rate)
