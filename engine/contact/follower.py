"""What follows a cam and slides on it, which the paper leaves out (METHOD, "Cams").

The follower presses along the normal of the curve; friction acts across it, where the surfaces touch. The joint frame is that of
the contact: e2 is the normal towards the follower, e3 the way its surface slides. A roller is a slider with the friction of its
pin: μ times pin radius over roller radius.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from engine.basics.symbolic import SX, ca
from engine.contact.base import Contact, ContactElement, Hold, Place, Solid, Wrench
from engine.contact.journal import HALF_ROOT
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

ACROSS = "f2"


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return (ACROSS,)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0]]]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    return [laws[0].ratios([rates[0]])[0] * ca.fabs(w[ACROSS])]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    return [ca.fabs(rates[0]) * laws[0].sign([rates[0]], (1.0,))]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    return [Hold(laws[0].static * ca.fabs(w[ACROSS]), ca.fabs(u[0]))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """One contact, whose outward normal is against the force on the inboard part: it changes sides as the follower lifts off."""
    none = ca.SX(0)
    return [Contact(ca.fabs(w[ACROSS]), (none, -w[ACROSS], none), (1, 2))]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
    return [HALF_ROOT * w[ACROSS]]


def _places(g: Mapping[str, float]) -> list[Place]:
    return []


def _pins(g: Mapping[str, float]) -> list[Solid]:
    return [Solid("sphere", (1e-3,))]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from engine.contact.resting import Capacity, Norm, Pair, static, whole

    mu = static(j)
    return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), (Capacity((Norm(whole(j, (ACROSS,)), mu),)),), mu)]


FOLLOWER = ContactElement(
    "follower", _needs, _friction, _speeds, _held, _contacts, _velocity, _pressed, 1, springs=1, rests=_rests, sizes=(),
    pairs=((0,),), places=_places, pins=_pins, anywhere=False,
)
