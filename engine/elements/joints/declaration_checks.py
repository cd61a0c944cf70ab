"""Numerical checks of a joint type's declaration. They run at registration and take about 0.1 ms per type. The numbers of freedoms
and constraints must add up to six. R must be a rotation matrix, and the unit matrix at q = 0. The declared axes must agree with the
derivatives of R and s. ``measure`` must invert ``rotation`` and ``travel``. The constraint rows must vanish for all q and prevent
all motion except along the axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from trunnion.elements.joints.joint_kind import JointKind, quaternion_rate

Vector = Sequence[float]
Place = tuple[list[list[float]], list[float]]
SAMPLE = {"angle": (0.7, -0.4, 1.1), "length": (0.3, -0.2, 0.5), "quaternion": (0.8, 0.2, -0.4, 0.4)}
"""Coordinates at which a declaration is checked, by kind of coordinate. The sample is a general position, with angles within the
range of ``measure``."""
STEP = 1e-5
"""Step h of the central differences, rad or m. The truncation error of the differences is about h²; the round-off error is about
1e-11."""
CLOSE = 1e-8
"""Largest accepted deviation: 100 times the error of the differences. A wrong axis or sign gives a deviation of at least 0.1."""


class Numeric:
    """The functions (sin, sqrt, if_else, …) that a declaration gets as ``ops``, implemented for plain numbers."""

    sin, cos, atan2, sqrt, fmax = math.sin, math.cos, math.atan2, math.sqrt, max

    @staticmethod
    def if_else(condition: bool, yes: float, no: float) -> float:
        """``yes`` if the condition holds, otherwise ``no``."""
        return yes if condition else no


def registered(*kinds: JointKind) -> dict[str, JointKind]:
    """Joint types by name. Raises ValueError with all faults of all declarations."""
    wrong = [f"joint type {k.name}: {fault}" for k in kinds for fault in faults(k)]
    names = [k.name for k in kinds]
    wrong += [f"joint type {n}: declared twice" for n in dict.fromkeys(names) if names.count(n) > 1]
    if wrong:
        raise ValueError("; ".join(wrong))
    return {k.name: k for k in kinds}


def faults(kind: JointKind) -> list[str]:
    """Faults of a declaration. The numerical checks run only if the numbers of freedoms, rows and coordinates are consistent."""
    if kind.bodiless:
        return ["a joint that carries no body must have exactly one row"] if kind.rows != 1 - kind.slips else []
    sizes = list(_sizes(kind))
    return sizes or [*_place(kind), *_motion(kind), *_rows(kind)]


def _sizes(kind: JointKind) -> Iterator[str]:
    """Faults of the numbers of freedoms, rows and coordinates, and of the order of coordinates and rates."""
    if kind.nv + kind.rows + kind.ties != 6:
        yield f"{kind.nv} freedoms, {kind.rows} rows and {kind.ties} ties do not add up to 6"
    n, ball = kind.nq, kind.quaternion
    if ball >= 0 and (n - ball != 4 or set(kind.coordinates[ball:]) != {"quaternion"}):
        yield "a quaternion must be the last four coordinates"
    elif kind.nv != (n if ball < 0 else n - 1):
        yield f"{n} coordinates but {kind.nv} rates"
    else:
        for k in range(kind.nv if ball < 0 else ball):
            if (kind.coordinates[k] == "angle") != kind.turns(k):
                yield f"coordinate {k + 1} is a {kind.coordinates[k]}, the first axis of its rate is not"
    for axes in kind.axes:
        if any(a.side == "out" and not a.rot for a in axes):
            yield "a sliding axis must belong to the inboard frame"
        if len(axes) != 1 and kind.cuttable:
            yield "a joint that can be cut must have exactly one axis per rate"


def _place(kind: JointKind) -> Iterator[str]:
    """Faults of R, s and ``measure``."""
    R, s = _at(kind, _sample(kind))
    if any(abs(_dot(R[i], R[k]) - (i == k)) > CLOSE for i in range(3) for k in range(3)) or _determinant(R) < 0:
        yield "rotation(q) is not a rotation matrix"
    rest = [0.0] * kind.nq
    if kind.quaternion >= 0:
        rest[kind.quaternion] = 1.0
    R0, s0 = _at(kind, rest)
    if any(abs(R0[i][k] - (i == k)) > CLOSE for i in range(3) for k in range(3)) or max(map(abs, s0)) > CLOSE:
        yield "the frames of the two sides do not coincide at q = 0"
    q, back = _sample(kind), kind.measure(R, s, Numeric)
    if len(back) != len(q) or any(abs(a - b) > CLOSE for a, b in zip(q, back, strict=True)):
        yield f"measure gives {_shown(back)} for the rotation and travel of {_shown(q)}"


def _motion(kind: JointKind) -> Iterator[str]:
    """Faults of the axes of each rate, found by comparison with the derivatives of R and s."""
    for k in range(kind.nv):
        spin, slip = _rates(kind, k)
        declared = _column(kind, k)
        if any(abs(a - b) > CLOSE for a, b in zip([*slip, *spin], declared, strict=True)):
            said = f"slides by {_shown(declared[:3])}, turns by {_shown(declared[3:])} (inboard frame)"
            yield f"rate {k + 1}: by its axes it {said}; by travel and rotation {_shown(slip)}, {_shown(spin)}"


def _rows(kind: JointKind) -> Iterator[str]:
    """Faults of the constraint rows (46) and (49). The rows must vanish, must not change along the axes, and must be linearly
    independent."""
    R, s = _at(kind, _sample(kind))
    rows = [[float(i == k) for i in range(6)] for k in kind.rows_s]
    for k in kind.rows_s:
        if abs(s[k]) > CLOSE:
            yield f"row r·h{k + 1} (49) is not zero along its motion"
    for m, k in kind.rows_r:
        if abs(R[m][k]) > CLOSE:
            yield f"row h{m + 1}·h{k + 1} (46) is not zero along its motion"
        outer = [R[i][k] for i in range(3)]
        e = [float(i == m) for i in range(3)]
        rows.append([0.0] * 3 + [outer[(i + 1) % 3] * e[(i + 2) % 3] - outer[(i + 2) % 3] * e[(i + 1) % 3] for i in range(3)])
    axes = [_column(kind, k) for k in range(kind.nv)]
    if _rank(axes) != kind.nv or (kind.cuttable and any(abs(_dot(a, b)) > CLOSE for a in axes for b in axes if a is not b)):
        yield "its axes are not at right angles"  # the rates of a cut joint are projections of the relative motion on its axes
    if _rank(rows) != kind.rows or any(abs(_dot(a, r)) > CLOSE for a in axes for r in rows):
        yield "its rows must prevent exactly what its axes exclude"


def _sample(kind: JointKind) -> list[float]:
    """Coordinates (nq) in general position."""
    next_of = {name: iter(values * 2) for name, values in SAMPLE.items()}
    return [next(next_of[c]) for c in kind.coordinates]


def _at(kind: JointKind, q: list[float]) -> Place:
    """(R, s) at q, for a pitch of 2π."""
    return kind.rotation(q, Numeric), kind.travel(q)


def _rates(kind: JointKind, rate: int) -> tuple[list[float], list[float]]:
    """(ω of the outboard part, ṡ), inboard frame, if this rate is 1 and all other rates are 0."""
    q, qd = _sample(kind), [0.0] * kind.nq
    if kind.coordinate_of(rate) >= 0:
        qd[kind.coordinate_of(rate)] = 1.0
    else:
        omega = [float(i == rate - kind.quaternion) for i in range(3)]
        qd[kind.quaternion :] = quaternion_rate(q[kind.quaternion :], omega)
    (Ra, sa), (Rb, sb) = (_at(kind, [x + h * v for x, v in zip(q, qd, strict=True)]) for h in (-STEP, STEP))
    R = _at(kind, q)[0]
    dR = [[(b - a) / (2 * STEP) for a, b in zip(x, y, strict=True)] for x, y in zip(Ra, Rb, strict=True)]
    spin = [0.5 * (_dot(dR[k], R[j]) - _dot(dR[j], R[k])) for j, k in ((1, 2), (2, 0), (0, 1))]
    return spin, [(b - a) / (2 * STEP) for a, b in zip(sa, sb, strict=True)]


def _column(kind: JointKind, rate: int) -> list[float]:
    """Declared motion of a rate: translation (3), rotation (3), inboard frame."""
    R, out = _at(kind, _sample(kind))[0], [0.0] * 6
    for a in kind.axes[rate]:
        for i in range(3):
            out[i + 3 * a.rot] += float(i == a.index) if a.side == "in" else R[i][a.index]
    return out


def _rank(vectors: list[list[float]]) -> int:
    """Number of linearly independent vectors, by Gram–Schmidt."""
    kept: list[list[float]] = []
    for v in vectors:
        for u in kept:
            along = _dot(u, v)
            v = [x - along * y for x, y in zip(v, u, strict=True)]
        size = math.sqrt(_dot(v, v))
        if size > CLOSE:
            kept.append([x / size for x in v])
    return len(kept)


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _determinant(R: list[list[float]]) -> float:
    return sum(R[0][i] * (R[1][(i + 1) % 3] * R[2][(i + 2) % 3] - R[1][(i + 2) % 3] * R[2][(i + 1) % 3]) for i in range(3))


def _shown(values: Vector) -> str:
    return "(" + ", ".join(f"{v:.3g}" for v in values) + ")"
