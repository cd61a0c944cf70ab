"""Friction of a cam follower, which the paper does not treat (theory, "Cams").

The force on the follower is normal to the curve; friction acts along the surface. The joint frame is fixed to the contact: e2 is
the normal towards the follower, e3 the sliding direction. The model treats a roller as a slider. The slider's μ is the μ of the
roller's pin, times pin radius / roller radius."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.contact.contact_element import Contact, ContactElement, Hold, Solid, Wrench
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

ACROSS = "f2"


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return (ACROSS,)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0]]]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    return [laws[0].ratios([rates[0]])[0] * ca.fabs(w[ACROSS])]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    return [Hold(laws[0].static * ca.fabs(w[ACROSS]), ca.fabs(u[0]))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """One contact, whose outward normal opposes the force on the inboard part. The contact therefore changes sides at the instant
    when the follower would lift off."""
    none = ca.SX(0)
    return [Contact(ca.fabs(w[ACROSS]), (none, -w[ACROSS], none), (1, 2))]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    return [HALF_ROOT * w[ACROSS]]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair

    mu = j.static
    return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), (Capacity((Norm(j.rows((ACROSS,)), mu),)),), mu)]


FOLLOWER = ContactElement(
    "follower",
    _needs,
    _friction,
    _held,
    _contacts,
    _velocity,
    _pressed,
    1,
    springs=1,
    rests=_rests,
    sizes=(),
    pairs=((0,),),
    pins=lambda g: [Solid("sphere", (1e-3,))],
    anywhere=False,
)
