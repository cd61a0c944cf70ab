"""Length, force and power of a spring-damper between two points."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import LOAD_ENDS, NONLINEAR_FORCE, SPRING_NUMBERS, Motion
from trunnion.columns.subjects import SPRING


def spring_damper(ends: tuple[Motion, Motion], numbers: SX, nonlinear: SX) -> dict[str, SX]:
    """Length L, force K (L − l0) + C L̇ + nonlinear forces, and power −force × L̇ on the bodies. A positive force pulls the
    ends together."""
    from trunnion.recursion.masses_and_forces import spring_line

    line = spring_line(ends, (numbers[3:6], numbers[6:9]))
    force = numbers[0] * (line.length - numbers[2]) + numbers[1] * line.rate + nonlinear
    return {"length": line.length, "force": force, "power": -force * line.rate}


KIND = ColumnKind(
    of=SPRING,
    operands={"ends": LOAD_ENDS, "numbers": SPRING_NUMBERS, "nonlinear": NONLINEAR_FORCE},
    expression=spring_damper,
    quantities=(
        Quantity(name="line", output="length", label=("length",), column="{load}.length", unit="m", text="length of {load}",
                 direct=True),
        Quantity(name="line", output="force", label=("force",), column="{load}.force", unit="N",
                 text="force with which {load} pulls its ends together", direct=True),
        Quantity(name="line", output="power", label=("power",), column="{load}.power", unit="W",
                 text="power of {load} on the bodies", direct=True),
    ),
)  # fmt: skip
