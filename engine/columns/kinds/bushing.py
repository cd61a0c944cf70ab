"""Displacement, force and power of a bushing, in the bushing's axes on the first body."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BUSHING_NUMBERS, LOAD_ENDS, Motion
from trunnion.columns.subjects import BUSHING


def bushing(ends: tuple[Motion, Motion], numbers: SX) -> dict[str, SX]:
    """Offset, rotation vector, force, torque and power of the bushing (theory, "Bushings")."""
    from trunnion.recursion.bushing_forces import bushing_state

    state = bushing_state(ends, numbers)
    return {"offset": state.offset, "turn": state.turn, "force": state.force, "torque": state.torque, "power": state.power}


KIND = ColumnKind(
    of=BUSHING,
    operands={"ends": LOAD_ENDS, "numbers": BUSHING_NUMBERS},
    expression=bushing,
    quantities=(
        Quantity(name="bushing", output="offset", label=("offset",), column="{load}.offset[{component}]", size=3, unit="m",
                 text="offset of the second point from the first in {load}, in the bushing's axes on the first part", direct=True),
        Quantity(name="bushing", output="turn", label=("turn",), column="{load}.turn[{component}]", size=3, unit="rad",
                 text="rotation vector of the second part in {load}, in the bushing's axes on the first part", direct=True),
        Quantity(name="bushing", output="force", label=("force",), column="{load}.force[{component}]", size=3, unit="N",
                 text="force of {load} on the second part, in the bushing's axes on the first part", direct=True),
        Quantity(name="bushing", output="torque", label=("torque",), column="{load}.torque[{component}]", size=3, unit="N*m",
                 text="torque of {load} on the second part, in the bushing's axes on the first part", direct=True),
        Quantity(name="bushing", output="power", label=("power",), column="{load}.power", unit="W",
                 text="power of {load} on the bodies", direct=True),
    ),
)  # fmt: skip
