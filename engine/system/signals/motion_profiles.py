"""Ways from rest to rest: how far a point-to-point drive has come, as polynomials between knots (u of the duration, 0 to 1)."""

from __future__ import annotations

from dataclasses import dataclass

Polynomial = tuple[float, ...]
"""Coefficients of powers of u − (begin of the piece), the constant first."""


@dataclass(frozen=True)
class Profile:
    """knots: where pieces begin, and 1; pieces: their polynomials, of which the first begins at 0 and the last ends at 1."""

    knots: tuple[float, ...]
    pieces: tuple[Polynomial, ...]


def _of_jerks(lengths: tuple[float, ...], jerks: tuple[float, ...], accelerations: tuple[float, ...] = ()) -> Profile:
    """A profile of piecewise constant jerk (or where it jumps, acceleration), made as high as it comes to 1."""
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
"""polynomial: of degree 5, at rest without acceleration at both ends; trapezoid: constant acceleration, speed, deceleration, a
third each; s_curve: the same with the jerk limited (a quarter of each third)."""
MOVES = tuple(f"move_{name}" for name in PROFILES)
"""Kinds of signals of such drives."""


def derivative(piece: Polynomial) -> Polynomial:
    """The rate of a polynomial."""
    return tuple(k * c for k, c in enumerate(piece))[1:] or (0.0,)
