"""Friction of a point on a plane, which the paper does not treat (theory, "Points on planes").

The force on the point is normal to the plane. Friction acts against sliding in the plane, or holds the point in any direction of
the plane. Turning about the point has no friction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.contact.contact_element import TINY, Contact, ContactElement, Hold, Solid, Wrench
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

NORMAL = "f1"


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return (NORMAL,)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0], rates[1]]]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    along, across = laws[0].ratios([rates[0], rates[1]], (1.0, 1.0))
    load = ca.fabs(w[NORMAL])
    return [along * load, across * load, ca.SX(0), ca.SX(0), ca.SX(0)]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    size = ca.sqrt(u[0] * u[0] + u[1] * u[1] + TINY) - math.sqrt(TINY)  # the size is exactly 0 for u = 0
    return [Hold(laws[0].static * ca.fabs(w[NORMAL]), size)]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v, u = rates[0], rates[1]
    return [ca.sqrt(v * v + u * u + TINY) * laws[0].sign([v, u], (1.0, 1.0))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """One contact, whose outward normal opposes the force on the part with the pin. The contact therefore changes sides where the
    force would pull."""
    none = ca.SX(0)
    return [Contact(ca.fabs(w[NORMAL]), (-w[NORMAL], none, none), (0, 1), inboard=True)]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    return [HALF_ROOT * w[NORMAL]]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair

    held = Capacity((Norm(j.rows((NORMAL,)), j.static),))
    return [Pair(j.joint, 1, j.eta, np.eye(2, 5), (held,), j.static)]


PLANE = ContactElement(
    "point_contact", _needs, _friction, _held, _contacts, _velocity, _pressed, 1, springs=1, rests=_rests, own_speeds=_speeds,
    sizes=(), pairs=((0, 1),), bound=(2, 3, 4), pins=lambda g: [Solid("sphere", (1e-3,))], anywhere=False, frame="inboard",
)  # fmt: skip
