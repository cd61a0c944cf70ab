"""Coordinates of a joint."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import COORDINATE
from trunnion.columns.subjects import COORDINATES, Subject


def continued(s: Subject) -> str:
    """Post-processing: measured angles of cut joints are within ±π. The runtime adds multiples of 2π, so that the angles are
    continuous."""
    return "wrap" if s.data.cut and s.data.kind.coordinates[s.key[1]] == "angle" else ""


KIND = ColumnKind(
    of=COORDINATES,
    operands={"q": COORDINATE},
    quantities=(
        Quantity(name="q", column="{joint}.q[{number}]", unit="{displacement}", text="coordinate {number} of {joint}",
                 post=continued, vector=False),
    ),
)  # fmt: skip
