"""Data of the last event so far."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import RUNTIME_VALUES
from trunnion.columns.subjects import SYSTEM
from trunnion.runtime.abi import EventKind
from trunnion.runtime.abi.run_records import EXTRA, LAST

EVENTS = ", ".join(f"{e.value} {e.name.lower()}" for e in EventKind).replace("_", " ")


def of_last(name: str, field: str, unit: str, text: str) -> Quantity:
    """The column ``events.last.NAME`` for a field of ``tr_last``."""
    return Quantity(name="last", at=EXTRA.at("last") + LAST.at(field), label=(field,), column=f"events.last.{name}", unit=unit,
                    text=text, steps=True, smooth=False, runtime=True)  # fmt: skip


KIND = ColumnKind(
    of=SYSTEM,
    operands={"runtime": RUNTIME_VALUES},
    quantities=(
        of_last("time", "time", "s", "time of the last event (0: none yet)"),
        of_last("kind", "kind", "1", f"last event: {EVENTS}"),
        of_last("joint", "element", "1", "joint of the last event: k-th joint with friction in the columns' order (0: none)"),
        of_last("contact", "contact", "1", "contact whose normal turned most in the last event, from 1 (0: none)"),
        of_last("angle_before", "before", "rad", "angle of this contact before the event"),
        of_last("angle_after", "after", "rad", "angle of this contact after the event"),
        of_last("turn", "turn", "rad", "angle by which the normal of this contact turned"),
        of_last("marginal", "marginal", "1", "1: the last event is marginal: its margin is below the run's own error"),
    ),
)
