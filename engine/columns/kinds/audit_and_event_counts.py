"""Results of the runtime's audit, and numbers of events."""

from typing import Any

from trunnion.basics.number_declarations import ANY, NOT_NEGATIVE
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import RUNTIME_VALUES
from trunnion.columns.subjects import SYSTEM, Subject
from trunnion.runtime.abi import Overrun, Verdict
from trunnion.runtime.abi.run_records import EXTRA

VERDICTS = ", ".join(f"{v.value} {v.name.lower()}" for v in Verdict)
OVERRUNS = ", ".join(f"{o.value} {o.name.lower()}" for o in Overrun).replace("_", " ")


def bounded(s: Subject) -> bool:
    """Whether the scene has real-time steps, whose cost is bounded."""
    return s.data.bounded


def value(column: str, field: str, text: str, counts: bool = True, **more: Any) -> Quantity:
    """A column that shows a field of ``tr_extra``. counts: whether the value is constant between events and never negative."""
    name, bound = (f"extra.{field}", NOT_NEGATIVE) if counts else ("extra", ANY)
    more |= {"at": EXTRA.at(field), "label": (field,), "steps": counts, "bound": bound, "smooth": False, "runtime": True}
    return Quantity(name=name, column=column, unit="1", text=text, **more)


KIND = ColumnKind(
    of=SYSTEM,
    operands={"runtime": RUNTIME_VALUES},
    quantities=(
        value("audit.constraint", "closure", "largest loop closure residual (lengths per length scale, rad)", counts=False),
        value("audit.complement", "complement", "relative residual of the complement equations", counts=False),
        value("audit.contraction", "contraction", "contraction of fixed-point iteration of the complement equations", counts=False),
        value("audit.verdict", "verdict", f"verdict of the audit so far: {VERDICTS}"),
        value("events.count", "events", "events so far"),
        value("realtime.overrun", "overrun", f"fallback that completed the last bounded step: {OVERRUNS}", given=bounded),
        value("realtime.overruns", "overruns", "number of bounded steps so far that a fallback completed", given=bounded),
    ),
)
