"""Which parameters the data cannot tell apart, and which combination of them they determine.

By the near-null directions of the slopes in relative steps of the parameters (METHOD, "Intervals of fits"); confirmed where the
profile of a parameter is flat.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

ALIKE = {True: 1e-5, False: 1e-3}
"""Singular values of slopes scaled to columns of one size, of the largest, that are zero: for exact slopes, whose errors are
about a hundred times smaller, and for differenced ones."""
PART = 0.05
"""Part of the largest component of a null direction below which a parameter has no part in it."""
FLAT = 0.1
"""Rise over a relative step of ASIDE, of the rise at the ends of an interval, up to which a profile is flat."""
ASIDE = 0.2
WHOLE = 0.1
"""How near an exponent has to be to a small whole number or fraction to be rounded to it in words."""


@dataclass(frozen=True)
class Alike:
    """Parameters that the data cannot tell apart. names (p); determined: the combinations they do determine, each by the exponents
    of the parameters (of their values times numbers, where ``product`` is False), with its relative standard deviation; exact:
    whether it is so for any noise, or for this noise; confirmed: whether the profiles are flat."""

    names: tuple[str, ...]
    determined: tuple[tuple[tuple[float, ...], float], ...]
    product: bool
    exact: bool
    confirmed: bool

    def told(self) -> str:
        """What is to be known of it, and what to do."""
        if len(self.names) == 1:
            return f"the data say next to nothing of {self.names[0]}: give it, or measure something that it changes"
        which = f"{', '.join(self.names[:-1])} and {self.names[-1]}"
        combined = " and ".join(f"{self._combined(e)} (± {100 * s:.2g} %)" for e, s in self.determined)
        only = f"only {combined} {'is' if len(self.determined) == 1 else 'are'} determined" if combined else "none is determined"
        remedy = "give one of them, or measure something that only one of them changes"
        if not self.confirmed:
            remedy += "; their profiles are not flat: further from the estimate the data do bound them"
        return f"the data cannot tell {which} apart: {only}; {remedy}"

    def _combined(self, exponents: Sequence[float]) -> str:
        if not self.product:
            parts = [f"{e:+.3g} {n}" for n, e in zip(self.names, exponents, strict=True) if e]
            return " ".join(parts).removeprefix("+")
        parts = [n if e == 1.0 else f"{n}^{e:.3g}" for n, e in zip(self.names, exponents, strict=True) if e]
        about = [n if e == 1.0 else f"{n}^{e:g}" for n, e in zip(self.names, map(_round, exponents), strict=True) if e]
        return " · ".join(parts) + (f", about {' · '.join(about)}" if about != parts else "")

    def document(self) -> dict[str, Any]:
        """As plain data."""
        combined = [{"exponents": list(e), "deviation": s} for e, s in self.determined]
        return {"names": list(self.names), "determined": combined, "product": self.product, "exact": self.exact,
                "confirmed": self.confirmed, "told": self.told()}  # fmt: skip


def _round(exponent: float) -> float:
    near = float(Fraction(exponent).limit_denominator(2))
    return near if abs(exponent - near) <= WHOLE else round(exponent, 2)


@dataclass(frozen=True)
class Spectrum:
    """null (m × d): directions of relative steps that the data do not see; blind (m × b): those of them that they would not see
    whatever their noise; deviations (m): relative local standard deviations, infinite where a blind direction has a part;
    covariance (m × m): of what is seen."""

    null: np.ndarray
    blind: np.ndarray
    deviations: np.ndarray
    covariance: np.ndarray


def spectrum(J: np.ndarray, count: int, t: float, exact: bool) -> Spectrum:
    """The spectrum of slopes J ((N + priors) × m), in units of the noise, by relative steps, of which the first ``count`` rows are
    data: deviations heed priors, null directions are those of the data alone. t: threshold of the intervals; exact: whether slopes
    are."""
    blind, _ = _split(J[:count], exact)
    _, weak, W = np.linalg.svd(J[:count], full_matrices=False)
    hazy = [w for w, x in zip(W, weak, strict=True) if x < t and not _within(w, blind)]
    lost, root = _split(J, exact)
    covariance = root @ root.T
    deviations = np.sqrt(np.diag(covariance))
    for v in np.abs(lost.T):
        deviations[v > PART * v.max()] = math.inf
    return Spectrum(np.column_stack([blind, *hazy]), blind, deviations, covariance)


def _split(J: np.ndarray, exact: bool) -> tuple[np.ndarray, np.ndarray]:
    """(unit vectors that J does not see, m × b; a root of its pseudo-inverse's covariance, m × rest), by J with columns of one
    size."""
    size = np.linalg.norm(J, axis=0)
    size[size == 0.0] = 1.0
    _, s, V = np.linalg.svd(J / size, full_matrices=len(J) < J.shape[1])  # of the rows alone: as large as their square
    s = np.append(s, np.zeros(len(V) - len(s)))
    zero = s <= ALIKE[exact] * s.max(initial=0.0)
    lost = V[zero].T / size[:, None]
    return lost / np.linalg.norm(lost, axis=0), V[~zero].T / size[:, None] / s[~zero]


def _within(w: np.ndarray, basis: np.ndarray) -> bool:
    """Whether a vector is, nearly, in the space of the columns of ``basis``."""
    if not basis.shape[1]:
        return False
    rest = w - basis @ np.linalg.lstsq(basis, w, rcond=None)[0]
    return bool(np.linalg.norm(rest) < 0.1 * np.linalg.norm(w))


def alike(
    names: Sequence[str], found: Spectrum, positive: np.ndarray, units: np.ndarray, flat: Callable[[int], bool]
) -> tuple[Alike, ...]:
    """The groups of parameters that a spectrum cannot tell apart. positive (m): whether a parameter can be a factor of a product;
    units (m): what a relative step is measured by; flat: whether the profile of a parameter is."""
    basis, groups = _reduced(found.null), []
    left = list(range(basis.shape[1]))
    while left:
        columns = [left.pop(0)]
        members = _members(basis[:, columns])
        while more := [c for c in left if members & _members(basis[:, [c]])]:
            columns += more
            left = [c for c in left if c not in more]
            members = _members(basis[:, columns])
        at = sorted(members)
        product = bool(positive[at].all())
        scale = np.ones(len(at)) if product else 1.0 / units[at]
        combined = _complement(basis[np.ix_(at, columns)])
        inner = found.covariance[np.ix_(at, at)]
        determined = tuple((tuple((e * scale).tolist()), float(math.sqrt(max(e @ inner @ e, 0.0)))) for e in combined)
        exact, confirmed = all(_within(basis[:, c], found.blind) for c in columns), all(flat(i) for i in at)
        if len(at) > 1 or confirmed:  # one alone whose profile is not flat is known, though not to within its own size
            groups.append(Alike(tuple(names[i] for i in at), determined, product, exact, confirmed))
    return tuple(groups)


def _members(columns: np.ndarray) -> set[int]:
    part = np.abs(columns)
    return set(np.flatnonzero((part > PART * part.max(axis=0)).any(axis=1)).tolist())


def _reduced(basis: np.ndarray) -> np.ndarray:
    """A basis of the same space, reduced by columns with pivots, so that groups which have nothing to do with each other fall
    apart."""
    B = basis.copy()
    for c in range(B.shape[1]):
        rows = np.abs(B[:, c])
        pivot = int(rows.argmax())
        B[:, c] /= B[pivot, c]
        for other in range(B.shape[1]):
            if other != c:
                B[:, other] -= B[pivot, other] * B[:, c]
    return B


def _complement(basis: np.ndarray) -> list[np.ndarray]:
    """What is orthogonal to a basis (p × d): p − d vectors, reduced by rows, each with its largest component 1."""
    _, s, V = np.linalg.svd(basis.T, full_matrices=True)
    rows = _reduced(V[len(s) :].T).T
    return [np.where(np.abs(r) < PART * np.abs(r).max(), 0.0, r) / r[np.abs(r).argmax()] for r in rows]
