"""Rest-to-rest motion of a drive."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

from trunnion.basics.lazy_casadi import ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.signals.declaration import Corner, SignalKind, Triple
from trunnion.scene.signals.motion_profiles import MOVES, PROFILES, derivative
from trunnion.scene.units.numbers_with_units import Number, Per, Time


@validated(frozen=True, config=STRICT)
class Move:
    """A motion of a drive from rest to rest: q = ``start`` until ``begin``, and q = ``end`` from ``begin + duration`` on."""

    start: Number
    """Coordinate before the motion."""
    end: Number
    """Coordinate after the motion."""
    duration: Annotated[float, Per("s", Bound(0.0, open=True, advice="a motion needs a positive duration"))]
    """Duration of the motion."""
    begin: Time = 0.0
    """Time at which the motion begins."""
    profile: Literal["polynomial", "trapezoid", "s_curve"] = "polynomial"
    """polynomial: degree 5, zero acceleration at the ends; trapezoid: constant acceleration, constant rate, constant
    deceleration, a third of the time each; s_curve: like trapezoid, with limited jerk."""


class MoveKind(SignalKind):
    """Leaves of the signal: start, end, begin, duration. The label names the profile."""

    key, data, text = "move", Move, "Motion from one coordinate to another, at rest before and after."
    labels = dict.fromkeys(MOVES, 4)
    loads = "a load changes by a ramp, a trapezoid or a table"

    def signal(self, data: Move, put: Any) -> Any:
        return put.signal(
            f"move_{data.profile}", put.own("start", data.start), put.own("end", data.end), put.kink("begin", data.begin, "s"),
            put.kink("duration", data.duration, "s"),
        )

    def motion(self, sym: Any, s: Any) -> Triple:
        start, end, begin, duration = (sym.leaf(x) for x in s.leaves)
        profile = PROFILES[s.kind.removeprefix("move_")]
        u, at = (sym.t - begin) / duration, (sym.ts - begin) / duration
        out = []
        pieces = profile.pieces
        for order in range(3):
            value = ca.SX(1 if order == 0 else 0)
            for first, last, piece in reversed(list(zip(profile.knots[:-1], profile.knots[1:], pieces, strict=True))):
                value = ca.if_else(at < last, sum((c * (u - first) ** k for k, c in enumerate(piece)), ca.SX(0)), value)
            out.append((end - start) / duration**order * ca.if_else(at < 0, 0, value))
            pieces = tuple(derivative(piece) for piece in pieces)
        return start + out[0], out[1], out[2]

    def corners(self, data: Move) -> Iterator[Corner]:
        yield from (Corner(data.begin + u * data.duration) for u in PROFILES[data.profile].knots)

    def travel(self, data: Move, until: float) -> Sequence[float]:
        return [data.start, data.end]
