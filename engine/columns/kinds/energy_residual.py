"""Energy residual, for the audit of a run."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import DRIVE_WORK, ENERGIES, LOAD_WORK, RUNTIME_VALUES, TAKEN_WORK
from trunnion.columns.subjects import SYSTEM
from trunnion.runtime.abi.run_records import EXTRA


def residual(energies: SX, runtime: SX, drives: SX, loads: SX, taken: SX) -> dict[str, SX]:
    """Present energy, minus energy at the start, minus work of drives and loads, minus work of friction and dampers (≤ 0)."""
    return {"residual": energies[0] + energies[1] - runtime[EXTRA.at("energy0")] - (drives + loads) - taken}


KIND = ColumnKind(
    of=SYSTEM,
    operands={"energies": ENERGIES, "runtime": RUNTIME_VALUES, "drives": DRIVE_WORK, "loads": LOAD_WORK, "taken": TAKEN_WORK},
    expression=residual,
    quantities=(
        Quantity(name="residual", output="residual", column="energy.residual", unit="J", integral=True, smooth=False,
                 text="energy now − energy at the start − work of drives and loads + dissipated energy"),
    ),
)  # fmt: skip
