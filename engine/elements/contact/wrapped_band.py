"""Friction of a band around a drum, and of a belt around two pulleys (theory, "Bands and belts").

The tension of a sliding band grows by exp(k φ) along the angle of wrap φ, where k is the friction ratio (Euler, Eytelwein). If the
tension S is given at one end, the tensions are S and S e^{kφ}. If the mean tension T_0 is given, the tensions are T_0 (1 ±
tanh(kφ/2)). The friction at the surface is the difference of both tensions. This difference does not depend on other forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import NOT_NEGATIVE, POSITIVE, Bound
from trunnion.elements.contact.contact_element import ContactElement, Hold, Size, Wrench, signum
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

TENSION = Size(
    "tension", "N", "tension at one end of the band, which is the slack end in forward motion (belt: of one strand)", NOT_NEGATIVE,
    '"200 N"', needed=False, symbol="S", bears=False, varies=True,
)  # fmt: skip
PRETENSION = Size(
    "pretension", "N", "mean tension of both ends of the band (belt: of both strands), instead of tension", NOT_NEGATIVE, '"300 N"',
    needed=False, symbol="T_0", bears=False, varies=True,
)  # fmt: skip
WRAP = Size(
    "wrap_angle", "rad", "angle of wrap (belt: about the smaller pulley, by default from the geometry); negative if the end with "
    "the given tension is the tight end in forward motion", Bound(nonzero=True), '"270 deg"', symbol="φ", bears=False,
)  # fmt: skip
RADIUS = Size("drum_radius", "m", "radius of a band brake's drum", POSITIVE, '"0.1 m"', symbol="R", bears=False)
Numbers = Mapping[str, Any]
"""Numbers of an element by name: expressions, or plain numbers."""


def difference(g: Numbers, k: Any, ops: Any) -> Any:
    """Difference of the tensions at both ends, N, with the sign of the friction ratio k. ops: ``exp`` and ``tanh``."""
    if PRETENSION.name in g:
        return 2 * g[PRETENSION.name] * ops.tanh(0.5 * k * ops.fabs(g[WRAP.name]))
    turns = g[WRAP.name]
    return g[TENSION.name] * ops.copysign(1.0, turns) * (ops.exp(k * turns) - 1)


@dataclass(frozen=True)
class Wrapped:
    """A band around a drum, or a belt.

    radius  name of the arm of the friction; "" if its freedom is a travel
    pulls   whether the sum of the tensions acts along a second freedom (belt)
    """

    radius: str = ""
    pulls: bool = False

    def arm(self, g: Numbers) -> Any:
        """Ratio of the friction along the freedom to the friction at the surface."""
        return g[self.radius] if self.radius else 1.0

    def needs(self, numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
        """The torque on the inboard pulley, if the sum of the tensions depends on this torque; otherwise no component."""
        return ("m1",) if self.pulls and TENSION.name in numbers else ()

    def velocity(self, rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
        """Sliding velocity of the pair (``ContactElement.velocity``)."""
        return [[self.arm(g) * rates[0]]]

    def friction(self, w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        """Friction, and sum of the tensions, which pulls the pulleys together. The sum also acts at rest."""
        k = laws[0].ratios(self.velocity(rates, g)[0])[0]
        along = self.arm(g) * difference(g, k, ca)
        return [along, _sum(w, g)] if self.pulls else [along]

    def held(self, w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        """Hold of the pair. The capacity is the one for the sense of the required friction."""
        most = difference(g, signum(u[0]) * laws[0].static, ca)
        return [Hold(ca.fabs(most), ca.fabs(u[0]) / self.arm(g))]

    def tensions(self, eta: Any, g: Numbers) -> list[Any]:
        """Tensions at both ends of the band (``ContactElement.tensions``)."""
        more = ca.copysign(1.0, g[WRAP.name]) * eta / self.arm(g)
        if PRETENSION.name in g:
            return [g[PRETENSION.name] - 0.5 * more, g[PRETENSION.name] + 0.5 * more]
        return [g[TENSION.name], g[TENSION.name] + more]

    def rests(self, j: Rubs) -> list[Pair]:
        """Capacities for both senses of friction. Reactions do not affect these capacities."""
        import numpy as np

        from trunnion.elements.contact.static_friction_capacity import Capacity, Pair

        most = {sense: abs(float(difference(j.sizes, sense * j.static, np))) for sense in (1, -1)}
        both = tuple(Capacity((j.constant(size, 1.0),), sense) for sense, size in most.items())
        return [Pair(j.joint, 1, (j.eta[0],), np.array([[1.0 / self.arm(j.sizes)]]), both, j.static)]

    def element(self, name: str, sizes: tuple[Size, ...]) -> ContactElement:
        """The contact element, which has no contacts."""
        return ContactElement(
            name, self.needs, self.friction, self.held, lambda w, rates, laws, g, eta: [], self.velocity,
            lambda w, rates, laws, g, eta: [], 0, springs=0, rests=self.rests, sizes=sizes, pairs=((0,),),
            bound=(1,) if self.pulls else (), anywhere=False, one_of=(TENSION.name, PRETENSION.name), tensions=self.tensions,
            scaled=False,
        )  # fmt: skip


def _sum(w: Wrench, g: Numbers) -> SX:
    """The sum of both strands' tensions."""
    if PRETENSION.name in g:
        return 2 * g[PRETENSION.name]
    torque = ca.copysign(1.0, g[WRAP.name]) * w["m1"]
    return 2 * g[TENSION.name] - torque / (0.5 * g["module"])  # the module is the diameter of the inboard pulley


BAND = Wrapped(RADIUS.name).element("band", (TENSION, PRETENSION, WRAP, RADIUS))
BELT = Wrapped(pulls=True).element("wrapped pulleys", (TENSION, PRETENSION, replace(WRAP, derived=True)))
