"""All possible continuations of pairs at rest under Coulomb's law. The search tries every combination of modes, with bodies in
absolute coordinates, with loops, for every joint type with friction. The code shares nothing with the engine's mode decisions.

A pair at rest sticks or starts to slide. A choice of modes for all pairs is a system of equations in the frictions η. The search
solves it as a least-squares problem from many starts:

    sticks              its freedoms do not accelerate, and η is less than the friction of sliding along η with the static
                        coefficient
    +, - (one freedom)  η is the friction of sliding that way, and the pair accelerates that way
    slides (several)    η is the friction of sliding along the acceleration; a ball whose acceleration lies within its friction cone
                        turns about its contact then (``contact_roots.ball``)
    moves               the pair is in motion: η is the friction of this sliding

Where sticking pairs are redundant, many values of friction solve a choice. The found solution then shows only that a solution
exists. """

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from math import hypot

import numpy as np
from scipy.optimize import leastsq

from tests.reference.contact_and_friction.sliding_closed_forms import Pair, sliding_pairs
from tests.reference.mechanics.kinematics import State
from tests.reference.mechanics.newton_euler_equations import Equations, typical_length

STICKS, SLIDES, MOVES = "sticks", "slides", "moves"
STILL = 1e-9
"""Part of the fastest speed below which a pair is at rest."""
SOLVED = 1e-8
"""Residual below which equations count as solved, relative to the forces and accelerations that cancel."""
SLACK = 1e-7
"""Allowed excess of friction over its limit, or acceleration in the wrong direction, relative to the same quantities."""
HELD = 1e-3
"""Part of the acceleration that a freedom would have with free bodies. An acceleration below this part is round-off: loops hold the
freedom."""
FAR = 1e6
"""Largest η of a solution, in multiples of force · lever. Larger values are no solution, whatever their residual is, because a
joint that its loop holds at rest can carry any friction."""
SPREAD = 3.0
"""Size of random starts, in multiples of force · lever; every other one has a tenth of it."""


@dataclass(frozen=True)
class Answer:
    """One consistent choice: the modes of all pairs at rest, the frictions η, and all accelerations of the freedoms with
    friction."""

    modes: dict[str, str]
    eta: np.ndarray = field(repr=False)
    acceleration: np.ndarray = field(repr=False)


class Decision:
    """All choices at a state. ``rest``: names of the pairs at rest; by default, the pairs slower than STILL."""

    def __init__(self, state: State, rest: set[str] | None = None, starts: int = 6, seed: int = 0):
        self.state, self.eq = state, Equations(state)
        self.starts, self.rng = starts, np.random.default_rng(seed)
        self.pairs = sliding_pairs(self.eq)
        length = typical_length(state)
        speeds = [p.speed for p in self.pairs] + [float(np.linalg.norm(v)) for v in state.v.values()]
        self.fastest = max(speeds + [length * float(np.linalg.norm(w)) for w in state.omega.values()])
        still = {p.name for p in self.pairs if p.speed <= STILL * self.fastest}
        names = still if rest is None else rest
        self.rest = [p for p in self.pairs if p.name in names]
        self.unit = _units(self.eq, self.pairs)
        self.Q = np.array([self.eq.accelerations(n)[k] for n, k in self.eq.eta]).reshape(-1, len(self.eq.eta) + 1)
        self.scale = np.abs(self.Q) @ np.r_[1.0, self.unit] + HELD * self._free()

    def _free(self) -> np.ndarray:
        """Acceleration of each freedom if all bodies were free: due to its own friction, and due to all other forces."""
        rows, inertia, known = np.abs(self.eq.f[:, 1:]), self.eq.M, self.eq.f[:, :1]
        own = np.einsum("ij,ij->j", self.eq.f[:, 1:], np.linalg.solve(inertia, self.eq.f[:, 1:])) * self.unit
        return own + rows.T @ np.maximum(np.abs(np.linalg.solve(inertia, known)), np.abs(self.eq.u[:, :1]))[:, 0]

    # -- the equations of a choice ---------------------------------------------------------------------------------------------

    def choices(self) -> list[dict[str, str]]:
        """Every assignment of modes to the pairs at rest. Assignments with more sticking pairs come first."""
        options = [(STICKS, "+", "-") if len(p.freedoms) == 1 else (STICKS, SLIDES) for p in self.rest]
        made = [dict(zip([p.name for p in self.rest], c, strict=True)) for c in product(*options)]
        return sorted(made, key=lambda m: -sum(x == STICKS for x in m.values()))

    def friction(self, p: Pair, mode: str, eta: np.ndarray, acc: np.ndarray) -> list[float]:
        """Friction along the freedoms of p, for the sliding that the mode states."""
        if mode == MOVES:
            way = [float(self.state.qd[p.joint][k]) for k in p.freedoms]
        else:
            way = [float(acc[i]) for i in p.places] if mode == SLIDES else [1.0 if mode == "+" else -1.0]
        return p.friction(way, p.mu, np.r_[1.0, eta]) if any(way) else [0.0] * len(way)

    def hold(self, p: Pair, mu: float, eta: np.ndarray) -> tuple[float, float]:
        """Size of a pair's friction, and its limit with this coefficient, N. For a ball, a torque about the ball's force is added
        to the size."""
        load = hypot(*(eta[i] / a for i, a in zip(p.places, p.arms, strict=True)))
        if p.kind != "ball":
            way = [eta[i] / a**2 for i, a in zip(p.places, p.arms, strict=True)]
            most = p.friction(way, mu, np.r_[1.0, eta]) if any(way) else [0.0]
            return load, hypot(*(v / a for v, a in zip(most, p.arms, strict=False)))
        force = p.sign * (p.load @ np.r_[1.0, eta])[:3]
        size = float(np.linalg.norm(force))
        about = abs(float((p.turned @ eta[list(p.places)]) @ force)) / size / p.arms[0] if size > 0.0 else 0.0
        return load + about, size * mu / (1.0 + mu**2) ** 0.5

    def lack(self, y: np.ndarray, modes: dict[str, str]) -> np.ndarray:
        """Residuals of a choice at y = η/unit: each freedom's equation, then the excess over the limit for each sticking pair."""
        eta = y * self.unit
        acc = self.Q @ np.r_[1.0, eta]
        out, beyond = np.zeros(len(y)), []
        for p in self.pairs:
            here, mode = list(p.places), modes.get(p.name, MOVES)
            if mode == STICKS:
                out[here] = acc[here] / self.scale[here]
                load, most = self.hold(p, p.static, eta)
                beyond.append(max(0.0, load - most) * p.arms[0] / self.unit[here[0]])
            else:
                out[here] = (eta[here] - self.friction(p, mode, eta, acc)) / self.unit[here]
        return np.r_[out, beyond]

    def fits(self, eta: np.ndarray, modes: dict[str, str]) -> bool:
        """True if a solution is consistent: sticking pairs hold, pairs that start to slide accelerate in this direction, and
        friction adds no power."""
        acc = self.Q @ np.r_[1.0, eta]
        for p in self.rest:
            here, mode = list(p.places), modes[p.name]
            if mode == STICKS:
                load, most = self.hold(p, p.static, eta)
                if load > most * (1.0 + 10.0 * SLACK) + SLACK * self.unit[here[0]] / p.arms[0] * SOLVED:
                    return False
            elif mode == SLIDES:
                # a ball that turns about its contact dissipates no power
                least = -SOLVED * np.linalg.norm(eta[here]) * np.linalg.norm(acc[here])
                if not np.linalg.norm(acc[here] / self.scale[here]) > SLACK or eta[here] @ acc[here] < least:
                    return False
            elif not acc[here[0]] * (1.0 if mode == "+" else -1.0) > SLACK * self.scale[here[0]]:
                return False
        return True

    # -- answers ---------------------------------------------------------------------------------------------------------------

    def solutions(self, modes: dict[str, str], most: int | None = None) -> list[np.ndarray]:
        """Different η that satisfy a choice, found from zero and from random starts; at most ``most``."""
        n, found = len(self.unit), []
        for i in range(self.starts):
            if most is not None and len(found) >= most:
                break
            start = SPREAD * (0.1 if i % 2 else 1.0) * self.rng.normal(size=n) * (i > 0)
            try:
                y = leastsq(self.lack, start, args=(modes,), xtol=1e-14, ftol=1e-14, maxfev=30 * (n + 1), full_output=True)[0]
            except (np.linalg.LinAlgError, ArithmeticError):
                continue
            far = np.abs(y).max(initial=0.0)
            solved = far <= FAR and np.abs(self.lack(y, modes)).max(initial=0.0) <= SOLVED * (1.0 + far)
            new = not any(np.allclose(y, z, rtol=1e-6, atol=1e-8) for z in found)
            if solved and new and self.fits(y * self.unit, modes):
                found.append(y)
        return [y * self.unit for y in found]

    def answers(self, most: int | None = None) -> list[Answer]:
        """Consistent choices, each with its first solution; at most ``most``."""
        out: list[Answer] = []
        for modes in self.choices():
            if most is not None and len(out) >= most:
                break
            for eta in self.solutions(modes, 1):
                out.append(Answer(modes, eta, self.Q @ np.r_[1.0, eta]))
        return out

    def motions(self) -> list[Answer]:
        """Answers with different accelerations."""
        kept: list[Answer] = []
        for a in self.answers():
            if not any(np.all(np.abs(a.acceleration - b.acceleration) <= 1e-6 * self.scale) for b in kept):
                kept.append(a)
        return kept


def _units(eq: Equations, pairs: list[Pair]) -> np.ndarray:
    """Unit of friction of each freedom. It is the friction that the largest force in any pair without friction would cause with
    coefficient 1."""
    force = max([float(np.abs(p.load[:3, 0]).max()) for p in pairs], default=1.0)
    unit = np.ones(len(eq.eta))
    for p in pairs:
        unit[list(p.places)] = max(force, 1e-300) * np.array(p.arms)
    return unit
