"""A jump from one value to another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.signals.declaration import Corner, SignalKind
from trunnion.scene.units.numbers_with_units import Number, Time

NO_JUMP = (
    "a drive cannot jump: a jump of its coordinate or rate is an impact",
    "move, or ramp and trapezoid for the rate; or apply an effort instead",
)


@validated(frozen=True, config=STRICT)
class Step:
    """A jump from ``start`` to ``end`` at the time ``begin``."""

    end: Number
    """Value from ``begin`` on."""
    begin: Time = 0.0
    """Time of the jump."""
    start: Number = 0.0
    """Value before ``begin``."""


class StepKind(SignalKind):
    """Leaves of the signal: start, end, begin."""

    key, data, text = "step", Step, "Jump from one value to another."
    labels = {"step": 3}  # noqa: RUF012
    drives = NO_JUMP

    def signal(self, data: Step, put: Any) -> Any:
        return put.signal("step", put.own("start", data.start), put.own("end", data.end), put.kink("begin", data.begin, "s"))

    def load(self, sym: Any, s: Any) -> SX:
        start, end, begin = (sym.leaf(x) for x in s.leaves)
        return ca.if_else(sym.ts < begin, start, end)

    def corners(self, data: Step) -> Iterator[Corner]:
        yield Corner(data.begin)

    def values(self, data: Step, until: float) -> Mapping[str, Sequence[float]]:
        return {"": (data.start, data.end)}

    def value(self, data: Step, t: float) -> float:
        return float(data.start if t < data.begin else data.end)
