"""Friction independent of the load: a spring-loaded seal, a gearbox, a detent (theory, "Friction that is given").

A freewheel has different values for the two senses of motion. In one sense the freewheel drags; in the other sense it holds up to
its capacity. Each freedom has a friction pair. The friction of the pair is the given force or torque times the ratio of the pair's
law (μ defaults to 1). There are no contacts, and no reactions are needed. The sliding speed of a rotation is its rate times 1 m, so
that m/s in a law mean rad/s."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import NOT_NEGATIVE
from trunnion.elements.contact.contact_element import Contact, ContactElement, Hold, Size, Wrench
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

FORCE = Size("force", "N", "constant friction along the axis, at any load", NOT_NEGATIVE, '"5 N"', symbol="F", varies=True)
TORQUE = Size(
    "torque", "N*m", "constant friction about an axis, at any load", NOT_NEGATIVE, '"2 N*m"', symbol="T", varies=True
)
BACK_FORCE = Size(
    "back_force", "N", "constant friction in the backward direction, if it differs (one-way clutch)", NOT_NEGATIVE, '"5 kN"',
    needed=False, symbol="F_b", varies=True,
)  # fmt: skip
BACK_TORQUE = Size(
    "back_torque", "N*m", "constant friction when turning backward, if it differs (freewheel)", NOT_NEGATIVE,
    '"500 N*m"', needed=False, symbol="T_b", varies=True,
)  # fmt: skip


def constant(name: str, sizes: tuple[Size, ...], back: Size | None = None) -> ContactElement:
    """Element with constant friction. ``sizes`` contains one size for each freedom, in order. ``back`` is the optional friction of
    a single freedom in backward motion."""
    labels = [label for s in sizes for label in s.labels]

    def size(g: Mapping[str, SX], label: str, sense: SX) -> SX:
        return ca.if_else(sense < 0, g[back.name], g[label]) if back is not None and back.name in g else g[label]

    def needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
        return ()

    def velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
        return [[rate] for rate in rates]

    def friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        ratios = [law.ratios([rate])[0] for law, rate in zip(laws, rates, strict=True)]
        return [k * size(g, label, k) for k, label in zip(ratios, labels, strict=True)]

    def held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        return [Hold(law.static * size(g, label, x), ca.fabs(x)) for law, x, label in zip(laws, u, labels, strict=True)]

    def contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
        return []

    def pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
        return []

    return ContactElement(
        name, needs, friction, held, contacts, velocity, pressed, 0, springs=0, rests=_rests(labels, back),
        sizes=sizes if back is None else (*sizes, back),
        pairs=tuple((k,) for k in range(len(labels))),
    )  # fmt: skip


def _rests(labels: Sequence[str], back: Size | None) -> Callable[[Rubs], list[Pair]]:
    def rests(j: Rubs) -> list[Pair]:
        import numpy as np

        from trunnion.elements.contact.static_friction_capacity import Capacity, Pair

        mu = j.static
        if back is not None and back.name in j.sizes:
            both = tuple(Capacity((j.constant(j.sizes[n], mu),), sense) for n, sense in ((labels[0], 1), (back.name, -1)))
            return [Pair(j.joint, 1, (j.eta[0],), np.array([[1.0]]), both, mu)]
        return [
            Pair(j.joint, k + 1, (j.eta[k],), np.array([[1.0]]), (Capacity((j.constant(j.sizes[label], mu),)),), mu)
            for k, label in enumerate(labels)
        ]

    return rests


TURNING = constant("turning drag", (TORQUE,), BACK_TORQUE)
SLIDING = constant("sliding drag", (FORCE,), BACK_FORCE)
BOTH = constant("drag along and about", (FORCE, TORQUE))
CROSSED = constant("drag of a cross", (replace(TORQUE, count=2),))
