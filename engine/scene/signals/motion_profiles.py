"""Profiles of rest-to-rest moves: the completed fraction of a move as piecewise polynomials of u, the elapsed fraction of the
duration (0 to 1)."""

from __future__ import annotations

from trunnion.basics.lazy_data_classes import dataclass

Polynomial = tuple[float, ...]
"""Coefficients of powers of u − (knot where the piece begins), the constant first."""


@dataclass(frozen=True)
class Profile:
    """A profile of a move. knots: values of u at which the pieces begin, then 1. pieces: a polynomial for each piece; the first
    starts at the value 0, and the last ends at the value 1."""

    knots: tuple[float, ...]
    pieces: tuple[Polynomial, ...]


def _of_jerks(lengths: tuple[float, ...], jerks: tuple[float, ...], accelerations: tuple[float, ...] = ()) -> Profile:
    """A profile with piecewise constant jerk, or with piecewise constant acceleration if ``accelerations`` is given. The result is
    scaled to end at 1. lengths: length of each piece in u."""
    knots, pieces, x, v, a = [0.0], [], 0.0, 0.0, 0.0
    for i, length in enumerate(lengths):
        a = accelerations[i] if accelerations else a
        jerk = 0.0 if accelerations else jerks[i]
        pieces.append((x, v, a / 2, jerk / 6))
        x += v * length + a * length**2 / 2 + jerk * length**3 / 6
        v += a * length + jerk * length**2 / 2
        a += jerk * length
        knots.append(knots[-1] + length)
    knots[-1] = 1.0
    return Profile(tuple(knots), tuple(tuple(c / x for c in piece) for piece in pieces))


THIRD, TWELFTH, SIXTH = 1 / 3, 1 / 12, 1 / 6
PROFILES: dict[str, Profile] = {
    "polynomial": Profile((0.0, 1.0), ((0.0, 0.0, 0.0, 10.0, -15.0, 6.0),)),
    "trapezoid": _of_jerks((THIRD,) * 3, (), (1.0, 0.0, -1.0)),
    "s_curve": _of_jerks((TWELFTH, SIXTH, TWELFTH, THIRD, TWELFTH, SIXTH, TWELFTH), (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)),
}
"""polynomial: degree 5, with zero rate and acceleration at both ends.
trapezoid: constant acceleration, speed and deceleration, each for a third of the duration.
s_curve: like trapezoid, with limited jerk. In each third with acceleration, the acceleration rises during the first quarter and
falls during the last quarter."""
MOVES = tuple(f"move_{name}" for name in PROFILES)
"""Values of ``Signal.kind`` for moves."""


def derivative(piece: Polynomial) -> Polynomial:
    """The derivative of a polynomial."""
    return tuple(k * c for k, c in enumerate(piece))[1:] or (0.0,)
