"""Thread of a worm in the teeth of its wheel (theory, "Worms").

In the joint frame, e1 is the worm's axis, and e2 points to the wheel's axis. e3 = e1 × e2 is the direction of the thread's
circumference at the pitch point. γ is the lead angle, α the normal pressure angle, f the normal force. The component f cos α of
this force in the plane of e1 and e3 is the multiplier of the rolling constraint; the component f sin α pushes the axes apart.
Friction k f acts along the thread, (sin γ, 0, cos γ)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.contact.contact_element import TINY, Contact, ContactElement, Hold, Solid, Wrench
from trunnion.elements.contact.gear_teeth import ANGLE
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

FORCES = ("f1", "f3")


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return FORCES


def _across(w: Wrench, g: Mapping[str, SX]) -> SX:
    """Component of the force on the worm across the thread, without the radial component, N. This component does not depend on
    friction."""
    return ca.cos(g["lead_angle"]) * w["f1"] - ca.sin(g["lead_angle"]) * w["f3"]


def _normal(w: Wrench, g: Mapping[str, SX]) -> SX:
    across = _across(w, g)
    return ca.sqrt(across * across + TINY) / ca.cos(g["pressure_angle"])


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0]]]


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction along the thread, and force that pushes the axes apart. The pushing force also acts at rest."""
    f = _normal(w, g)
    return [laws[0].ratios([rates[0]])[0] * f, -ca.sin(g["pressure_angle"]) * f]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    return [Hold(laws[0].static * _normal(w, g), ca.fabs(u[0]))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """One contact, which moves to the opposite flanks when the force across the thread passes through zero."""
    none = ca.SX(0)
    return [Contact(_normal(w, g), (-w["f1"], -w["f2"], -w["f3"]), (2, 1), watched=(none, none, -_across(w, g)))]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    """The force in the plane of e1 and e3, friction along the thread included."""
    return [HALF_ROOT * w[n] for n in FORCES]


def _rests(j: Rubs) -> list[Pair]:
    """The capacity is μ_s f."""
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Pair

    return [Pair(j.joint, 1, j.eta[:1], np.array([[1.0]]), (Capacity((j.driving(j.static),)),), j.static)]


def _separation(g: Mapping[str, float]) -> float:
    return -math.tan(g["pressure_angle"])


THREAD = ContactElement(
    "worm thread", _needs, _friction, _held, _contacts, _velocity, _pressed, 1, springs=2, rests=_rests,
    sizes=(ANGLE,), pairs=((0,),), bound=(1,), pins=lambda g: [Solid("cylinder", (1e-3, 1e-3))], anywhere=False,
    frame="inboard", separation=_separation,
)  # fmt: skip
