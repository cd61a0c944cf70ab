"""Position of a named point of a body."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BODY_MOTION, BODY_POINT, Motion
from trunnion.columns.subjects import POINT


def point(motion: Motion, point: SX) -> dict[str, SX]:
    """Position r + R p of the point."""
    return {"position": motion.r + motion.R @ point}


KIND = ColumnKind(
    of=POINT,
    operands={"motion": BODY_MOTION, "point": BODY_POINT},
    expression=point,
    quantities=(
        Quantity(name="point", output="position", column="{body}.{point}.position[{component}]", size=3, unit="m",
                 text="point {point} of {body}, world frame"),
    ),
)  # fmt: skip
