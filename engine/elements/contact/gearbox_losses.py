"""Friction of a gear unit, from its catalogue: efficiencies of both directions of power, and no-load torque (theory, "Gear units").

The load T is the torque on the output shaft. The torque on the input shaft, times the ratio i, is T + η with the friction η at the
output. If power flows from input to output, i T_in = T/η_f + i T_0. If power flows from output to input, i T_in = η_b T − i T_0.
Hence c_f = 1/η_f − 1 and c_b = 1 − η_b. The default η_b = 2 − 1/η_f makes both coefficients equal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.monotone_curves import KNOTS, monotone
from trunnion.basics.number_declarations import NOT_NEGATIVE, Bound
from trunnion.elements.contact.contact_element import Size
from trunnion.elements.contact.transmission_losses import Losses, Numbers, transmission

EFFICIENCY = Size(
    "efficiency", "1", "efficiency if power flows from input to output, without the no-load torque",
    Bound(0.0, 1.0, open=True, advice="an efficiency is a fraction of the power, such as 0.9"), "0.9", symbol="η_f", bears=False,
    by_load=True,
)  # fmt: skip
BACKWARD = Size(
    "efficiency_backward", "1", "efficiency if power flows from output to input; 0 is self-locking; default: 2 - 1/efficiency, at "
    "least 0", Bound(0.0, 1.0, advice="an efficiency is a fraction of the power; self-locking: 0"), "0.8",
    needed=False, symbol="η_b", bears=False, by_load=True,
)  # fmt: skip
NO_LOAD = Size(
    "no_load_torque", "N*m", "friction torque on the input shaft at any load", NOT_NEGATIVE, '"0.1 N*m"', needed=False,
    symbol="T_0", bears=False, varies=True,
)  # fmt: skip
TABLES = ("torque", "speed")
"""An efficiency may be a table over one of these quantities of the output shaft."""


def table_labels(name: str, over: str) -> tuple[tuple[str, str], ...]:
    """Names of the two numbers of each point in a table."""
    return tuple((f"{name}.{over}[{k + 1}]", f"{name}.value[{k + 1}]") for k in range(KNOTS))


EFFICIENCY_TABLES = tuple(table_labels(s.name, over) for s in (EFFICIENCY, BACKWARD) for over in TABLES)


def _efficiency(g: Numbers, name: str, at: Mapping[str, SX]) -> Any:
    """An efficiency: a number, or the value of its table at the torque or speed in ``at``; None if neither is given."""
    for over in TABLES:
        labels = table_labels(name, over)
        if labels[0][0] in g:
            return monotone(at[over], [g[x] for x, _ in labels], [g[y] for _, y in labels])
    return g.get(name)


def _coefficients(g: Numbers, load: Any, speed: Any) -> tuple[Any, Any]:
    at = dict(zip(TABLES, (load, speed), strict=True))
    efficiency, backward = (_efficiency(g, s.name, at) for s in (EFFICIENCY, BACKWARD))
    forward = 1 / efficiency - 1
    if backward is not None:
        return forward, 1 - backward
    return forward, ca.fmin(forward, 1) if isinstance(forward, ca.SX) else min(forward, 1.0)


def _constant(g: Numbers, sense: Any) -> Any:
    return abs(g["ratio"]) * g["no_load_torque"] if "no_load_torque" in g else 0.0


GEAR_UNIT = transmission("gear unit", Losses("m1", _coefficients, _constant), (EFFICIENCY, BACKWARD, NO_LOAD))
