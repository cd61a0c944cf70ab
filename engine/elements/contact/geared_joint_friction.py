"""Friction of a joint with its own gear, for example in robots (theory, "Gear units"). The friction has a constant part, and a part
proportional to the torque or force that the joint transmits. The transmitted torque acts on the outboard part about the joint's
axis. The transmitted torque is the torque of motor, efforts, springs, dampers and drive, minus friction and the torque that
accelerates a rotor."""

from __future__ import annotations

from typing import Any

from trunnion.basics.lazy_casadi import ca
from trunnion.basics.number_declarations import Bound
from trunnion.elements.contact.contact_element import Size
from trunnion.elements.contact.load_independent_friction import BACK_FORCE, BACK_TORQUE, FORCE, TORQUE
from trunnion.elements.contact.transmission_losses import Losses, Numbers, transmission

BELOW_ONE = Bound(0.0, 0.99, advice="from 1 on, a load would lock the joint; for a self-locking gear unit, use type: gearbox")
LOADED = Size(
    "load_friction", "1", "friction per transmitted torque or force, where the joint drives its outboard part", BELOW_ONE, "0.1",
    symbol="b", bears=False,
)  # fmt: skip
LOADED_BACK = Size(
    "load_friction_backward", "1", "friction per transmitted torque or force, where the outboard part drives, if it differs",
    BELOW_ONE, "0.15", needed=False, symbol="b_b", bears=False,
)  # fmt: skip


def _coefficients(g: Numbers, load: Any, speed: Any) -> tuple[Any, Any]:
    return g[LOADED.name], g.get(LOADED_BACK.name, g[LOADED.name])


def _loaded(name: str, along: str, constant: Size, back: Size) -> Any:
    def size(g: Numbers, sense: Any) -> Any:
        if back.name not in g:
            return g[constant.name]
        if isinstance(sense, ca.SX):
            return ca.if_else(sense < 0, g[back.name], g[constant.name])
        return g[back.name if sense < 0 else constant.name]

    return transmission(name, Losses(along, _coefficients, size), (constant, back, LOADED, LOADED_BACK))


LOADED_HINGE = _loaded("loaded hinge", "m1", TORQUE, BACK_TORQUE)
LOADED_GUIDE = _loaded("loaded guide", "f1", FORCE, BACK_FORCE)
