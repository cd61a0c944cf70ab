"""Friction of a gear unit, from its catalogue: efficiencies of both directions of power, and no-load torque (theory, "Gear units").

The load T is the torque on the output shaft. The torque on the input shaft, times the ratio i, is T + η with the friction η at the
output. With the power from input to output, i T_in = T/η_f + i T_0. With the power from output to input, i T_in = η_b T − i T_0.
Hence the friction is |η| = c |T| + i T_0 with c = 1/η_f − 1 where friction and load oppose the motion alike, and c = 1 − η_b where
the load drives the motion. Equal coefficients mean η_b = 2 − 1/η_f, the default."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.monotone_curves import KNOTS, monotone
from trunnion.basics.number_declarations import NOT_NEGATIVE, Bound
from trunnion.elements.contact.contact_element import TINY, Contact, ContactElement, Hold, Size, Wrench
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

ABOUT = "m1"
EFFICIENCY = Size(
    "efficiency", "1", "efficiency with the power from input to output, without the no-load torque",
    Bound(0.0, 1.0, open=True, advice="an efficiency is a fraction of the power, such as 0.9"), "0.9", symbol="η_f", bears=False, by_load=True,
)  # fmt: skip
BACKWARD = Size(
    "efficiency_backward", "1", "efficiency with the power from output to input, 0: self-locking; default: 2 - 1/efficiency, at "
    "least 0", Bound(0.0, 1.0, advice="an efficiency is a fraction of the power; a self-locking gear unit has 0"), "0.8",
    needed=False, symbol="η_b", bears=False, by_load=True,
)  # fmt: skip
NO_LOAD = Size(
    "no_load_torque", "N*m", "friction torque on the input shaft at any load", NOT_NEGATIVE, '"0.1 N*m"', needed=False, symbol="T_0",
    bears=False, varies=True,
)  # fmt: skip


TABLES = ("torque", "speed")
"""What a table of efficiencies may be over; both belong to the output shaft."""


def table_labels(name: str, over: str) -> tuple[tuple[str, str], ...]:
    """Names of the two numbers of each point of a table."""
    return tuple((f"{name}.{over}[{k + 1}]", f"{name}.value[{k + 1}]") for k in range(KNOTS))


EFFICIENCY_TABLES = tuple(table_labels(s.name, over) for s in (EFFICIENCY, BACKWARD) for over in TABLES)


def _efficiency(g: Mapping[str, SX], name: str, at: dict[str, SX]) -> SX | None:
    """An efficiency: a number, or the value of its table at the load or speed in ``at``; None without either."""
    for over in TABLES:
        labels = table_labels(name, over)
        if labels[0][0] in g:
            return monotone(at[over], [g[x] for x, _ in labels], [g[y] for _, y in labels])
    return g.get(name)


LEAST = 1e-9
"""Least coefficient in bounds at rest, which divide by the coefficients."""


def coefficients(efficiency: Any, backward: Any = None) -> tuple[Any, Any]:
    """Friction per load with the power from input to output, and from output to input; for numbers and expressions."""
    forward = 1 / efficiency - 1
    least = ca.fmin if isinstance(efficiency, ca.SX) else min
    return forward, least(forward, 1.0) if backward is None else 1 - backward


def friction_at(w: Wrench, sense: SX, g: Mapping[str, SX], speed: SX | float = 0.0) -> SX:
    """Friction torque on the output shaft, N m. sense: sign of the motion that the friction opposes. The torque on the output shaft
    is −m1."""
    load = ca.sqrt(w[ABOUT] ** 2 + TINY)
    at = {"torque": load, "speed": ca.SX(speed)}
    efficiency = _efficiency(g, EFFICIENCY.name, at)
    assert efficiency is not None
    forward, backward = coefficients(efficiency, _efficiency(g, BACKWARD.name, at))
    none = ca.fabs(g["ratio"]) * g["no_load_torque"] if "no_load_torque" in g else 0
    return ca.if_else(sense * w[ABOUT] < 0, forward, backward) * load + none


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return (ABOUT,)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0]]]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    k = laws[0].ratios([rates[0]])[0]
    return [k * friction_at(w, k, g, ca.sqrt(rates[0] ** 2 + TINY))]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    return [Hold(laws[0].static * friction_at(w, u[0], g), ca.fabs(u[0]))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    return []


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    """The torque at an arm of 1 m; friction does not change it."""
    return [HALF_ROOT * w[ABOUT]]


def _rests(j: Rubs) -> list[Pair]:
    """With the capacities c_f |T| and c_b |T| of the two directions of power, |u| ≤ c |T ± o u| holds for 1/c = (1/c_f + 1/c_b)/2 and
    o = (1/c_b − 1/c_f)/2. The constant part a is first subtracted from |u|. As in the kernel, a share is the friction divided by the
    capacity in its direction."""
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import AtLimit, Capacity, Norm, Pair

    mu, rows = j.static, j.rows((ABOUT,))
    forward, backward = (max(mu * c, LEAST) for c in coefficients(j.sizes["efficiency"], j.sizes.get("efficiency_backward")))
    constant = mu * abs(j.sizes["ratio"]) * j.sizes.get("no_load_torque", 0.0)
    lean, weight = (1 / forward - 1 / backward) / 2, 2 / (1 / forward + 1 / backward)
    held = tuple(
        Capacity((Norm(rows, weight, 0.0, -sense * lean * constant, lean), j.constant(constant, 1.0)), sense)
        for sense in ((1, -1) if constant else (0,))
    )
    ends = ((sense, side, forward if sense * side < 0 else backward) for sense in (1, -1) for side in (1, -1))
    limits = tuple(AtLimit(sense, side * rows, 0.0, c, constant) for sense, side, c in ends)
    return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), held, mu, limits=limits)]


GEAR_UNIT = ContactElement(
    "gear unit", _needs, _friction, _held, _contacts, _velocity, _pressed, 0, springs=1, rests=_rests,
    sizes=(EFFICIENCY, BACKWARD, NO_LOAD), pairs=((0,),), anywhere=False,
)  # fmt: skip
