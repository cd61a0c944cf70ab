"""Angular velocity of a body."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BODY_ANGULAR_VELOCITY
from trunnion.columns.subjects import BODY

KIND = ColumnKind(
    of=BODY,
    operands={"omega": BODY_ANGULAR_VELOCITY},
    quantities=(
        Quantity(name="omega", column="{body}.angular_velocity[{component}]", size=3, unit="rad/s",
                 text="angular velocity of {body}, world frame"),
    ),
)  # fmt: skip
