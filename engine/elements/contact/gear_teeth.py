"""Teeth of two gears, or of a pinion and its rack, which the paper does not treat (theory, "Teeth").

The pressure angle α is the angle between a tooth's force f and the motion of the pitch circles. The component f cos α drives; the
component f sin α pushes the wheels apart (a pinion in a ring gear: towards the ring's centre). The sliding speed of the flanks is
proportional to the distance between their contact point and the pitch point. The model has one pair of teeth in contact, with
contact points distributed evenly over one base pitch π m cos α. Friction therefore acts as a torque between the wheels, with the
mean arm ρ = π m cos α/4."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import Bound
from trunnion.elements.contact.contact_element import TINY, Contact, ContactElement, Hold, Size, Solid, Wrench, signum
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

ANGLE = Size(
    "pressure_angle", "rad", "pressure angle, between the force of a tooth and the motion of the pitch circles (usually 20 deg)",
    Bound(0.0, 1.0), '"20 deg"', symbol="α", bears=False,
)  # fmt: skip


def _arm(g: Mapping[str, Any], ops: Any = ca) -> Any:
    """Mean arm ρ of friction, m. ops: the symbolic library for expressions, ``math`` for plain numbers."""
    return 0.25 * math.pi * g["module"] * ops.cos(g["pressure_angle"])


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[_arm(g) * rates[0]]]


def _rests(j: Rubs) -> list[Pair]:
    """The capacity is μ_s f. The friction at the surface is the friction torque divided by the arm ρ."""
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Pair

    surface = np.array([[1.0 / _arm(j.sizes, math)]])
    return [Pair(j.joint, 1, j.eta[:1], surface, (Capacity((j.driving(j.static),)),), j.static)]


def _separation(g: Mapping[str, float]) -> float:
    return -g["side"] * math.tan(g["pressure_angle"])


def teeth(name: str, forces: tuple[str, ...], across: bool) -> ContactElement:
    """Teeth whose force has the components ``forces``. across: whether the force lies in the plane normal to the inboard axis
    (parallel axes, racks). Otherwise, the sign of the torque alone determines which flanks are in contact."""

    def needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
        return forces

    def load(w: Wrench) -> SX:
        """Magnitude of the tooth force, N."""
        return ca.sqrt(sum((w[n] * w[n] for n in forces), ca.SX(TINY)))

    def friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        """Friction torque, and force that pushes the wheels apart. The force also acts at rest."""
        k, f = laws[0].ratios(_velocity(rates, g)[0])[0], load(w)
        return [k * _arm(g) * f, -g["side"] * ca.sin(g["pressure_angle"]) * f]

    def held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        return [Hold(laws[0].static * load(w), ca.fabs(u[0]) / _arm(g))]

    def contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
        """One contact, whose outward normal opposes the force on the inboard wheel. The contact moves to the opposite flanks when
        the force along the motion of the teeth passes through zero. The torque about the wheel's axis is then zero, too."""
        none = ca.SX(0)
        lean = g["first"] * signum(w["m1"]) * g["pressure_angle"]
        c, s = ca.cos(lean), ca.sin(lean)
        way = (none, -(c * w["f2"] + s * w["f3"]), -(c * w["f3"] - s * w["f2"])) if across else (w["m1"] / g["module"], none, none)
        return [Contact(load(w), (-w["f1"] if "f1" in forces else none, -w["f2"], -w["f3"]), (2, 1), watched=way)]

    def pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
        """The tooth force. Friction does not change this force."""
        return [HALF_ROOT * w[n] for n in forces]

    return ContactElement(
        name, needs, friction, held, contacts, _velocity, pressed, 1, springs=len(forces), rests=_rests,
        sizes=(ANGLE,), pairs=((0,),), bound=(1,), pins=lambda g: [Solid("cylinder", (1e-3, 1e-3))], anywhere=False,
        separation=_separation,
    )  # fmt: skip


TEETH = teeth("flanks", ("f2", "f3"), True)
CONES = teeth("bevel_flanks", ("f1", "f2", "f3"), False)
