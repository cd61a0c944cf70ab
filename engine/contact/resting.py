"""What a pair can hold, as sums of norms of linear functions of the reactions (METHOD, "Bounds at rest").

The contact forms say it in closed form: a journal holds μ_s/√(1+μ_s²) ½(|F + Y| + |F − Y|), a ball μ_s/√(1+μ_s²) |f|, a sleeve
sums of absolute values that depend on the sense of friction. A contact element is one entry of ``HOLDS``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Rubs:
    """A joint with friction, as numbers. contact: its element; needs: the reaction components its forms use; eta: its multipliers;
    sizes: numbers of its contact and its law; sense: −1 where the outboard part carries the pin."""

    joint: str
    contact: str
    needs: tuple[str, ...]
    eta: tuple[int, ...]
    sizes: dict[str, float]
    sense: float
    adams: bool


@dataclass(frozen=True)
class Norm:
    """weight · |rows · f|, f the reaction components the element's forms use; rows in N per component's unit. contact: the part of
    |rows · f| that is the force of one contact (0: it is none of its own)."""

    rows: np.ndarray
    weight: float
    contact: float = 1.0


@dataclass(frozen=True)
class Capacity:
    """The most friction a pair holds, N at the surface: the sum of its norms. sense: of friction for which that holds, +1 or −1; 0:
    for every one. exact: else it is an upper bound (a shaft, whose load follows the direction of friction). least: the weights
    of a lower bound then, one for each norm."""

    norms: tuple[Norm, ...]
    sense: int = 0
    exact: bool = True
    least: tuple[float, ...] = ()


@dataclass(frozen=True)
class Pair:
    """A sliding pair at rest. friction: rows by which its multipliers become forces at the surface (1/r, or 1); capacities: what it
    holds; static: μ_s; across: rows of the force about which it holds no torque (a ball), else None; along: what it holds against a
    given direction of sliding (unit vector of surface velocities), where that differs from ``capacities``."""

    joint: str
    part: int
    eta: tuple[int, ...]
    friction: np.ndarray
    capacities: tuple[Capacity, ...]
    static: float
    across: np.ndarray | None = None
    along: Callable[[np.ndarray], Capacity] | None = None

    def against(self, direction: np.ndarray) -> Capacity:
        """What it holds against sliding in a direction, N at the surface along it."""
        if self.along is not None:
            return self.along(direction)
        return next(c for c in self.capacities if c.sense * direction[0] >= 0.0)


Makes = Callable[[Rubs], list[Pair]]


def _static(j: Rubs) -> float:
    return j.sizes.get("mu_static", j.sizes.get("mu", 0.0))


def _row(j: Rubs, **parts: float) -> np.ndarray:
    """A linear function of the components the element uses."""
    return np.array([parts.get(n, 0.0) for n in j.needs])


def _sine(mu: float) -> float:
    return mu / float(np.hypot(1.0, mu))


def _whole(j: Rubs, names: tuple[str, ...]) -> np.ndarray:
    return np.array([_row(j, **{n: 1.0}) for n in names])


def _adams(j: Rubs) -> tuple[str, ...]:
    return tuple(n for n in j.needs if n.startswith("f"))


def _ends(j: Rubs, across: tuple[str, str], about: tuple[str, str], c: float, mu: float) -> tuple[Norm, ...]:
    """F ± Y of a journal: F = f3 + i f2, Y = (m2 − i m3)/c, with the names (f2, f3) and (m2, m3) have in it."""
    f2, f3 = across
    m2, m3 = about
    return tuple(
        Norm(np.array([_row(j, **{f3: 1.0, m2: s / c}), _row(j, **{f2: 1.0, m3: -s / c})]), 0.5 * _sine(mu), 0.5)
        for s in (1.0, -1.0)
    )


def _journal(j: Rubs) -> list[Pair]:
    mu, r = _static(j), j.sizes["radius"]
    if j.adams:
        norms: tuple[Norm, ...] = (Norm(_whole(j, _adams(j)), mu),)
    else:
        norms = _ends(j, ("f2", "f3"), ("m2", "m3"), j.sizes["half_length"], mu)
        if "thrust_radius" in j.sizes:
            norms += (Norm(_whole(j, ("f1",)), mu * j.sizes["thrust_radius"] / r),)
    return [Pair(j.joint, 1, j.eta, np.array([[1.0 / r]]), (Capacity(norms),), mu)]


def _cross(j: Rubs) -> list[Pair]:
    mu, name, out = _static(j), j.joint, []
    names = ((("f2", "f3"), ("m2", "m3")), (("f3", "f1"), ("m3", "m1")))
    for k, (across, about) in enumerate(names):
        if j.adams:
            norms: tuple[Norm, ...] = (Norm(_whole(j, _adams(j)), mu),)
        else:
            norms = _ends(j, across, about, j.sizes[f"half_length[{k + 1}]"], mu)
        out.append(Pair(name, k + 1, (j.eta[k],), np.array([[1.0 / j.sizes[f"radius[{k + 1}]"]]]), (Capacity(norms),), mu))
    return out


def _ball(j: Rubs) -> list[Pair]:
    mu, r = _static(j), j.sizes["radius"]
    adams = j.adams
    force = _whole(j, ("f1", "f2", "f3"))
    held = Capacity((Norm(force, mu if adams else _sine(mu)),))
    return [Pair(j.joint, 1, j.eta, np.eye(3) / r, (held,), mu, None if adams else force)]


def _sleeve(j: Rubs) -> list[Pair]:
    mu = _static(j)
    if j.adams:
        capacities: tuple[Capacity, ...] = (Capacity((Norm(_whole(j, ("f2", "f3")), mu),)),)
    else:
        a, b, c = j.sizes["half_width"], j.sizes["half_height"], j.sizes["half_length"]

        def norms(sense: int) -> tuple[Norm, ...]:
            k = sense * j.sense * mu
            rows = [_row(j, f2=0.5 + s * k * a / (2 * c), m3=-s / (2 * c)) for s in (1, -1)]
            rows += [_row(j, f3=0.5 + s * k * b / (2 * c), m2=s / (2 * c)) for s in (1, -1)]
            return tuple(Norm(row[None, :], mu) for row in [*rows, _row(j, m1=1.0 / max(a, b))])

        capacities = tuple(Capacity(norms(s), s) for s in (1, -1))
    return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), capacities, mu)]


def _shaft(j: Rubs) -> list[Pair]:
    """An upper bound: with k_s, the axial part of friction, Y = Y_0 + β F with |β| ≤ μ r/c, so that each |F ± Y| is at most
    |F ± Y_0| + |β||F|. Against a given direction β is known."""
    mu, r = _static(j), j.sizes["radius"]
    if j.adams:
        held, along = Capacity((Norm(_whole(j, ("f2", "f3")), mu),)), None
    else:
        c, across = j.sizes["half_length"], _whole(j, ("f3", "f2"))
        ends = _ends(j, ("f2", "f3"), ("m2", "m3"), c, mu)
        loose = tuple(replace(n, weight=0.5 * mu) for n in ends)
        held = Capacity((*loose, Norm(across, mu * mu * r / c, 0.0)), 0, False, (0.5 * _sine(mu),) * 2 + (-_sine(mu) * mu * r / c,))

        def along(d: np.ndarray) -> Capacity:
            ks, kr = mu * j.sense * d
            beta = ks * r / c * (1 - 1j * kr) / (1 + kr * kr)
            turned = np.array([[beta.real, -beta.imag], [beta.imag, beta.real]]) @ across
            weight = 0.5 * mu / float(np.hypot(1.0, kr))
            return Capacity(tuple(Norm(n.rows + s * turned, weight, 0.5) for n, s in zip(ends, (1.0, -1.0), strict=True)))

    return [Pair(j.joint, 1, j.eta, np.diag([1.0, 1.0 / r]), (held,), mu, along=along)]


HOLDS: dict[str, Makes] = {"journal": _journal, "shaft": _shaft, "ball": _ball, "cross": _cross, "sleeve": _sleeve}


def pairs_at_rest(j: Rubs) -> list[Pair]:
    """The pairs of a joint whose law holds something at rest, in the engine's order."""
    return HOLDS[j.contact](j)
