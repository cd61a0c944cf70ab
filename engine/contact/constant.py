"""Friction that does not follow the load: a spring-loaded seal, a gearbox, a detent (METHOD, "Friction that is given").

One that differs by the sense of motion is a freewheel: it drags one way and holds the other, up to what it can.

A pair for each freedom holds or drags with a force or torque that is given, times the ratio of its law: μ, which is 1 where it is
not given. Nothing touches at a place, so that it has no contacts and needs no reactions. A turning freedom slides by its rate
times an arm of 1 m: what a law says in m/s is in rad/s there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from engine.basics.numbers import NOT_NEGATIVE
from engine.basics.symbolic import SX, ca
from engine.contact.base import Contact, ContactElement, Hold, Place, Size, Solid, Wrench
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

FORCE = Size("force", "N", "constant friction along the axis, whatever the load", NOT_NEGATIVE, '"5 N"', symbol="F", varies=True)
TORQUE = Size(
    "torque", "N*m", "constant friction about an axis, whatever the load", NOT_NEGATIVE, '"2 N*m"', symbol="T", varies=True
)
BACK_FORCE = Size(
    "back_force", "N", "constant friction backwards, where it differs: what a one-way clutch holds", NOT_NEGATIVE, '"5 kN"',
    needed=False, symbol="F_b", varies=True,
)  # fmt: skip
BACK_TORQUE = Size(
    "back_torque", "N*m", "constant friction when turning back, where it differs: what a freewheel holds", NOT_NEGATIVE,
    '"500 N*m"', needed=False, symbol="T_b", varies=True,
)  # fmt: skip


def constant(name: str, sizes: tuple[Size, ...], back: Size | None = None) -> ContactElement:
    """The element of joints with these frictions, a freedom each, in the order of their freedoms; back: of the only freedom when it
    goes backwards, where that may differ."""
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

    def speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        return [ca.fabs(rate) * law.sign([rate], (1.0,)) for law, rate in zip(laws, rates, strict=True)]

    def held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        return [Hold(law.static * size(g, label, x), ca.fabs(x)) for law, x, label in zip(laws, u, labels, strict=True)]

    def contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
        return []

    def pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
        return []

    return ContactElement(
        name, needs, friction, speeds, held, contacts, velocity, pressed, 0, springs=0, rests=_rests(labels, back),
        sizes=sizes if back is None else (*sizes, back),
        pairs=tuple((k,) for k in range(len(labels))), places=_none, pins=_nothing,
    )  # fmt: skip


def _none(g: Mapping[str, float]) -> list[Place]:
    return []


def _nothing(g: Mapping[str, float]) -> list[Solid]:
    return []


def _rests(labels: Sequence[str], back: Size | None) -> Callable[[Rubs], list[Pair]]:
    def rests(j: Rubs) -> list[Pair]:
        import numpy as np

        from engine.contact.resting import Capacity, Pair, given, static

        mu = static(j)
        if back is not None and back.name in j.sizes:
            both = tuple(Capacity((given(j, j.sizes[n], mu),), sense) for n, sense in ((labels[0], 1), (back.name, -1)))
            return [Pair(j.joint, 1, (j.eta[0],), np.array([[1.0]]), both, mu)]
        return [
            Pair(j.joint, k + 1, (j.eta[k],), np.array([[1.0]]), (Capacity((given(j, j.sizes[label], mu),)),), mu)
            for k, label in enumerate(labels)
        ]

    return rests


TURNING = constant("turning drag", (TORQUE,), BACK_TORQUE)
SLIDING = constant("sliding drag", (FORCE,), BACK_FORCE)
BOTH = constant("drag along and about", (FORCE, TORQUE))
CROSSED = constant("drag of a cross", (replace(TORQUE, count=2),))
