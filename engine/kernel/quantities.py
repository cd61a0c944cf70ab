"""What a column is a quantity of: all that anyone who handles columns needs to know of it, declared once.

A column's key begins with its quantity; who fits bounds, differentiates, compares or exports columns asks here, not by name.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """name       first entry of the key (a second one where that tells them apart: "extra.events").
    integral   built from powers integrated beside the motion (else from the state, multipliers and accelerations of the instant).
    direct     forces act on it at once; the others follow by integration.
    steps      stays what it is between events (a count, a state, what the last event was).
    smooth     has a derivative by the numbers of the scene.
    runtime    known to the runtime alone: the symbolic side has no expression of its change.
    vector     "[k]" counts components of one vector in space (else coordinates, contacts, states).
    reacts     follows reactions, which a redundant loop can leave open.
    """

    name: str
    integral: bool = False
    direct: bool = False
    steps: bool = False
    smooth: bool = True
    runtime: bool = False
    vector: bool = True
    reacts: bool = False

    @property
    def instantaneous(self) -> bool:
        """Whether it is an expression of state, multipliers and accelerations."""
        return not (self.integral or self.runtime)


ALL = (
    Quantity(name="position"),
    Quantity(name="velocity"),
    Quantity(name="acceleration", direct=True),
    Quantity(name="orientation"),
    Quantity(name="omega"),
    Quantity(name="point"),
    Quantity(name="q", vector=False),
    Quantity(name="qd", vector=False),
    Quantity(name="qdd", vector=False, direct=True),
    Quantity(name="reaction", direct=True, reacts=True),
    Quantity(name="drive", direct=True),
    Quantity(name="tie", vector=False, direct=True),
    Quantity(name="device", vector=False, direct=True),
    Quantity(name="power", vector=False, direct=True),
    Quantity(name="latched", vector=False, steps=True, smooth=False),
    Quantity(name="line", direct=True),
    Quantity(name="bushing", direct=True),
    Quantity(name="friction", direct=True),
    Quantity(name="contact", direct=True, reacts=True),
    Quantity(name="contact.state", vector=False, direct=True, steps=True, reacts=True),
    Quantity(name="bristle"),
    Quantity(name="state", vector=False, steps=True, smooth=False, runtime=True),
    Quantity(name="kinetic"),
    Quantity(name="potential"),
    Quantity(name="quad", integral=True),
    Quantity(name="dissipated", integral=True),
    Quantity(name="residual", integral=True, smooth=False),
    Quantity(name="extra", smooth=False, runtime=True),
    Quantity(name="extra.events", steps=True, smooth=False, runtime=True),
    Quantity(name="extra.verdict", steps=True, smooth=False, runtime=True),
    Quantity(name="extra.overrun", steps=True, smooth=False, runtime=True),
    Quantity(name="extra.overruns", steps=True, smooth=False, runtime=True),
    Quantity(name="last", steps=True, smooth=False, runtime=True),
)
QUANTITIES = {q.name: q for q in ALL}


def quantity(key: tuple) -> Quantity:
    """The quantity a column's key begins with; a contact's is told apart by its last entry."""
    if key[0] == "contact" and key[-1] == "state":
        return QUANTITIES["contact.state"]
    return QUANTITIES.get(f"{key[0]}.{key[1]}" if len(key) > 1 else "") or QUANTITIES[key[0]]
