"""Groups of parameters that the data cannot distinguish, and the combinations of these parameters that the data determine.

A group is a direction of relative parameter changes along which the measured curves hardly change (theory, "Intervals of fits").
The group is confirmed if the profile of each of its parameters is flat.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass

NULL_THRESHOLD = {True: 1e-5, False: 1e-3}
"""A singular value counts as zero if it is below this multiple of the largest singular value. The first multiple applies to exact
derivatives, the second to finite differences. The columns of the derivatives are scaled to equal norm. The relative errors of the
derivatives are about a hundred times smaller than these multiples."""
LEAST_PART = 0.05
"""A parameter belongs to a null direction if its component exceeds this multiple of the largest component."""
FLAT = 0.1
"""A profile is flat if a relative step FLAT_STEP of the parameter raises it little: by less than this multiple of the rise at the
ends of an interval."""
FLAT_STEP = 0.2
ROUNDING = 0.1
"""An exponent is printed as the nearest multiple of ½ if the difference is at most this value."""


@dataclass(frozen=True)
class UnidentifiableGroup:
    """Parameters that the data cannot distinguish.

    Attributes:
        names: names of the parameters (p).
        determined: (exponents (p), relative standard deviation) of each combination that the data determine.
        product: whether combinations are products of powers. Otherwise they are sums, and ``determined`` holds coefficients.
        exact: True if the data cannot distinguish the parameters at any noise; False if less noise would allow the distinction.
        confirmed: whether the profiles of all its parameters are flat.
    """

    names: tuple[str, ...]
    determined: tuple[tuple[tuple[float, ...], float], ...]
    product: bool
    exact: bool
    confirmed: bool

    def describe(self) -> str:
        """The group and the remedy, in words."""
        if len(self.names) == 1:
            return f"the data hardly determine {self.names[0]}: fix its value, or measure a quantity that it changes"
        which = f"{', '.join(self.names[:-1])} and {self.names[-1]}"
        combined = " and ".join(f"{self._combination(e)} (± {100 * s:.2g} %)" for e, s in self.determined)
        only = f"only {combined} {'is' if len(self.determined) == 1 else 'are'} determined" if combined else "all are undetermined"
        remedy = "fix the value of one parameter, or measure a quantity that only one of these parameters changes"
        if not self.confirmed:
            remedy += "; far from the estimate the data do bound these parameters, because their likelihood profiles are not flat"
        return f"the data cannot separate {which}: {only}; {remedy}"

    def _combination(self, exponents: Sequence[float]) -> str:
        if not self.product:
            parts = [f"{e:+.3g} {n}" for n, e in zip(self.names, exponents, strict=True) if e]
            return " ".join(parts).removeprefix("+")
        parts = [n if e == 1.0 else f"{n}^{e:.3g}" for n, e in zip(self.names, exponents, strict=True) if e]
        about = [n if e == 1.0 else f"{n}^{e:g}" for n, e in zip(self.names, map(_round, exponents), strict=True) if e]
        return " · ".join(parts) + (f", about {' · '.join(about)}" if about != parts else "")

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        combined = [{"exponents": list(e), "deviation": s} for e, s in self.determined]
        return {"names": list(self.names), "determined": combined, "product": self.product, "exact": self.exact,
                "confirmed": self.confirmed, "told": self.describe()}  # fmt: skip


def _round(exponent: float) -> float:
    near = float(Fraction(exponent).limit_denominator(2))
    return near if abs(exponent - near) <= ROUNDING else round(exponent, 2)


@dataclass(frozen=True)
class Spectrum:
    """The identifiability of m parameters, for relative changes of the parameters.

    Attributes:
        null: directions that the data do not determine with the present noise (m × d).
        blind: directions that the data do not determine for any noise (m × b).
        deviations: relative local standard deviations (m); infinite for parameters in blind directions.
        covariance: covariance of the determined directions (m × m).
    """

    null: np.ndarray
    blind: np.ndarray
    deviations: np.ndarray
    covariance: np.ndarray


def slope_spectrum(J: np.ndarray, count: int, t: float, exact: bool) -> Spectrum:
    """The spectrum of J ((N + priors) × m): the derivatives of the curves, in units of the noise, by relative changes of the
    parameters.

    The first ``count`` rows of J belong to the data. The null directions follow from the data only; the deviations include the
    priors.

    t: threshold of the intervals; exact: whether the derivatives are exact.
    """
    blind, _ = _null_space(J[:count], exact)
    _, weak, W = np.linalg.svd(J[:count], full_matrices=False)
    hazy = [w for w, x in zip(W, weak, strict=True) if x < t and not _is_in_span(w, blind)]
    lost, root = _null_space(J, exact)
    covariance = root @ root.T
    deviations = np.sqrt(np.diag(covariance))
    for v in np.abs(lost.T):
        deviations[v > LEAST_PART * v.max()] = math.inf
    return Spectrum(np.column_stack([blind, *hazy]), blind, deviations, covariance)


def _null_space(J: np.ndarray, exact: bool) -> tuple[np.ndarray, np.ndarray]:
    """(null space of J, unit vectors, m × b; root of the covariance of the other directions, m × rest). The columns of J are
    scaled to equal norm."""
    size = np.linalg.norm(J, axis=0)
    size[size == 0.0] = 1.0
    _, s, V = np.linalg.svd(J / size, full_matrices=len(J) < J.shape[1])  # a full U, which is not needed, would have rows² entries
    s = np.append(s, np.zeros(len(V) - len(s)))
    zero = s <= NULL_THRESHOLD[exact] * s.max(initial=0.0)
    lost = V[zero].T / size[:, None]
    return lost / np.linalg.norm(lost, axis=0), V[~zero].T / size[:, None] / s[~zero]


def _is_in_span(w: np.ndarray, basis: np.ndarray) -> bool:
    """Whether a vector lies nearly in the span of the columns of ``basis``."""
    if not basis.shape[1]:
        return False
    rest = w - basis @ np.linalg.lstsq(basis, w, rcond=None)[0]
    return bool(np.linalg.norm(rest) < 0.1 * np.linalg.norm(w))


def find_unidentifiable(
    names: Sequence[str], found: Spectrum, positive: np.ndarray, units: np.ndarray, flat: Callable[[int], bool]
) -> tuple[UnidentifiableGroup, ...]:
    """The groups of parameters in the null directions of a spectrum.

    positive (m): whether a parameter can be a factor of a product; units (m): magnitudes of relative steps; flat(i): whether the
    profile of parameter i is flat.
    """
    basis, groups = _reduce_columns(found.null), []
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
        combined = _orthogonal_complement(basis[np.ix_(at, columns)])
        inner = found.covariance[np.ix_(at, at)]
        determined = tuple((tuple((e * scale).tolist()), float(math.sqrt(max(e @ inner @ e, 0.0)))) for e in combined)
        exact, confirmed = all(_is_in_span(basis[:, c], found.blind) for c in columns), all(flat(i) for i in at)
        if len(at) > 1 or confirmed:  # a single parameter with a rising profile is determined
            groups.append(UnidentifiableGroup(tuple(names[i] for i in at), determined, product, exact, confirmed))
    return tuple(groups)


def _members(columns: np.ndarray) -> set[int]:
    part = np.abs(columns)
    return set(np.flatnonzero((part > LEAST_PART * part.max(axis=0)).any(axis=1)).tolist())


def _reduce_columns(basis: np.ndarray) -> np.ndarray:
    """Another basis of the same space, from column operations with pivots. In this basis, independent groups of parameters are in
    separate columns."""
    B = basis.copy()
    for c in range(B.shape[1]):
        rows = np.abs(B[:, c])
        pivot = int(rows.argmax())
        B[:, c] /= B[pivot, c]
        for other in range(B.shape[1]):
            if other != c:
                B[:, other] -= B[pivot, other] * B[:, c]
    return B


def _orthogonal_complement(basis: np.ndarray) -> list[np.ndarray]:
    """The orthogonal complement of a basis (p × d): p − d row-reduced vectors, each scaled so that its largest component is 1."""
    _, s, V = np.linalg.svd(basis.T, full_matrices=True)
    rows = _reduce_columns(V[len(s) :].T).T
    return [np.where(np.abs(r) < LEAST_PART * np.abs(r).max(), 0.0, r) / r[np.abs(r).argmax()] for r in rows]
