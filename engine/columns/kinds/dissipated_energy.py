"""Energy lost to friction and dampers."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import TAKEN_WORK
from trunnion.columns.subjects import SYSTEM


def dissipated(taken: SX) -> dict[str, SX]:
    """The work of friction and dampers, with the opposite sign."""
    return {"energy": -taken}


KIND = ColumnKind(
    of=SYSTEM,
    operands={"taken": TAKEN_WORK},
    expression=dissipated,
    quantities=(
        Quantity(name="dissipated", output="energy", column="energy.dissipated", unit="J", integral=True,
                 text="energy lost to friction and dampers"),
    ),
)  # fmt: skip
