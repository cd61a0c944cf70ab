"""Friction laws with a continuous passage through rest: Coulomb's law is their limit for a small speed ``eps``.

Below eps friction rises in proportion to the speed, to its largest value at rest. Above eps, the law is exact. A pair with a larger
coefficient at rest has a state: it slides until its speed is below eps, and rests until its speed reaches ``BEGINS`` eps. (Pairs
that move together reach their own eps at different times. With this state, every pair has its largest friction before any pair
slides. A law that falls with the speed would have an unstable branch, which implicit steps would follow.) All functions take many
states and pairs at once. """

from __future__ import annotations

import numpy as np

from tests.reference.mechanics.time_signals import load_value

AGAIN = 0.999
"""Speed, relative to eps, below which a sliding pair rests."""
BEGINS = 100.0
"""Speed, relative to eps, at which a resting pair begins to slide."""


PERIODS = 100
"""Number of periods of a signal whose kinks are taken into account."""


class NotJudged(NotImplementedError):
    """Error for a feature of a scene that the compliant model does not support. Its text names the feature."""


class Signals:
    """Loads of a scene as functions of many times."""

    def __init__(self, scene, loads):
        self.scene, self.loads = scene, loads
        for load in loads:
            if hasattr(load, "speed") or getattr(load, "curve", None) is not None:
                raise NotJudged("a number that depends on the speed or on a curve of an input")
        fixed = [0.0 if callable(getattr(x, "__len__", None)) else x for x in loads]
        self.constant = all(x is None or isinstance(x, (int, float)) for x in loads)
        self.values = np.array([float(x or 0.0) for x in fixed]) if self.constant else np.zeros(len(loads))

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """Values at times t: len(t) x number of loads."""
        if self.constant or not self.loads:
            return self.values[None]
        times, back = np.unique(t, return_inverse=True)
        return np.array([[load_value(self.scene, x, float(s)) for x in self.loads] for s in times])[back]


def bends(load) -> list[float]:
    """The instants at which a signal has a kink or a jump."""
    if getattr(load, "ramp", None) is not None:
        return [load.ramp.begin, load.ramp.begin + load.ramp.duration]
    if getattr(load, "step", None) is not None:
        return [load.step.begin]
    if getattr(load, "pulse", None) is not None:
        return _repeated(load.pulse, 0.0, load.pulse.duration)
    if getattr(load, "trapezoid", None) is not None:
        s = load.trapezoid
        return _repeated(s, 0.0, s.rise, s.rise + s.hold, s.rise + s.hold + s.fall)
    return list(load.table.time) if getattr(load, "table", None) is not None else []


def _repeated(signal, *after: float) -> list[float]:
    """Instants after each beginning of a signal."""
    starts = [signal.begin + k * (signal.period or 0.0) for k in range(PERIODS if signal.period else 1)]
    return [start + x for start in starts for x in after]


class Laws:
    """The laws of many friction pairs. ``eps``: speed (at the surface, or the rate of a given friction) below which each pair
    rests."""

    def __init__(self, scene, frictions: list, eps: np.ndarray, given: bool = False):
        self.kinds = [f.law or scene.friction.law for f in frictions]
        for kind in self.kinds:
            if kind not in ("coulomb", "stribeck", "regularized", "viscous"):
                raise NotJudged(f"friction law {kind}")
        first = 1.0 if given else 0.0
        mu = [f.mu if f.mu is not None else first for f in frictions]
        self.mu = Signals(scene, mu)
        self.rest = Signals(scene, [f.mu_static if f.mu_static is not None else m for f, m in zip(frictions, mu, strict=True)])
        own = [f.v_eps if f.v_eps is not None else scene.friction.v_eps for f in frictions]
        smooth = np.array([k == "regularized" for k in self.kinds])
        self.viscous = np.array([k == "viscous" for k in self.kinds])
        self.eps = np.where(smooth, own, eps)
        falls = [f.v_stribeck if k == "stribeck" else np.inf for f, k in zip(frictions, self.kinds, strict=True)]
        self.fall = np.array(falls, float)
        drags = ("stribeck", "viscous")
        both = list(zip(frictions, self.kinds, strict=True))
        self.drag = np.array([(f.viscosity or 0.0) if k in drags else 0.0 for f, k in both], float)

        self.jumps = np.flatnonzero([k == "coulomb" and f.mu_static is not None for f, k in both])
        self.slides = np.zeros(len(frictions), bool)
        self.share = np.zeros((1, len(frictions)))

    def slope(self, t: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Friction per normal force and speed, for speeds (n x pairs)."""
        mu = np.maximum(self.mu(t), 0.0)
        rest = np.maximum(self.rest(t), mu)
        self.share = speed / self.eps
        held = np.where(np.isinf(self.fall), ~self.slides, np.exp(-((speed / self.fall) ** 2)))
        return np.where(self.viscous, 0.0, (mu + (rest - mu) * held) / np.maximum(speed, self.eps)) + self.drag

    def switches(self) -> np.ndarray:
        """To be called after ``slope``. Functions that are negative where a pair's state must change (n x ``jumps``)."""
        x = self.share[:, self.jumps]
        return np.where(self.slides[self.jumps], x - AGAIN, BEGINS - x)

    def switch(self, k: int) -> None:
        """Change the state of the pair to which function k belongs."""
        self.slides[self.jumps[k]] = not self.slides[self.jumps[k]]
