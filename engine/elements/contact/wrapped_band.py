"""Friction of a band around a drum, and of a belt around two pulleys (theory, "Bands and belts").

The tension of a sliding band grows by exp(k φ) along the angle of wrap φ, where k is the friction ratio (Euler, Eytelwein). Its
two ends have the tensions S and S e^{kφ} if S is given at one end, or T_0 (1 ± tanh(kφ/2)) if their mean T_0 is given. The friction
at the surface is the difference of both tensions. It does not depend on other forces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import NOT_NEGATIVE, POSITIVE, Bound
from trunnion.elements.contact.contact_element import Contact, ContactElement, Hold, Size, Wrench, signum
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


def wrapped(name: str, radius: str, sizes: tuple[Size, ...], pulls: Callable[[Wrench, Numbers], SX] | None) -> ContactElement:
    """An element with this friction. radius: name of the arm of the friction; "" if its freedom is a travel. pulls: sum of the
    tensions, which acts along a second freedom."""

    def needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
        return ("m1",) if pulls is not None and TENSION.name in numbers else ()

    def arm(g: Numbers) -> Any:
        return g[radius] if radius else 1.0

    def velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
        return [[arm(g) * rates[0]]]

    def friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        k = laws[0].ratios(velocity(rates, g)[0])[0]
        along = arm(g) * difference(g, k, ca)
        return [along] if pulls is None else [along, pulls(w, g)]

    def held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        most = difference(g, signum(u[0]) * laws[0].static, ca)
        return [Hold(ca.fabs(most), ca.fabs(u[0]) / arm(g))]

    def contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
        return []

    def pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
        return []

    def tensions(eta: SX, g: Mapping[str, SX]) -> list[SX]:
        more = ca.copysign(1.0, g[WRAP.name]) * eta / arm(g)
        if PRETENSION.name in g:
            return [g[PRETENSION.name] - 0.5 * more, g[PRETENSION.name] + 0.5 * more]
        return [g[TENSION.name], g[TENSION.name] + more]

    def rests(j: Rubs) -> list[Pair]:
        import numpy as np

        from trunnion.elements.contact.static_friction_capacity import Capacity, Pair

        most = {sense: abs(float(difference(j.sizes, sense * j.static, np))) for sense in (1, -1)}
        both = tuple(Capacity((j.constant(size, 1.0),), sense) for sense, size in most.items())
        return [Pair(j.joint, 1, (j.eta[0],), np.array([[1.0 / arm(j.sizes)]]), both, j.static)]

    return ContactElement(
        name, needs, friction, held, contacts, velocity, pressed, 0, springs=0, rests=rests, sizes=sizes, pairs=((0,),),
        bound=() if pulls is None else (1,), anywhere=False, one_of=(TENSION.name, PRETENSION.name), tensions=tensions,
        scaled=False,
    )  # fmt: skip


def _pull(w: Wrench, g: Numbers) -> SX:
    """The sum of both strands' tensions, which pulls the pulleys together."""
    if PRETENSION.name in g:
        return 2 * g[PRETENSION.name]
    torque = ca.copysign(1.0, g[WRAP.name]) * w["m1"]
    return 2 * g[TENSION.name] - torque / (0.5 * g["module"])  # the module is the diameter of the inboard pulley


BAND = wrapped("band", RADIUS.name, (TENSION, PRETENSION, WRAP, RADIUS), None)
BELT = wrapped("belt", "", (TENSION, PRETENSION, replace(WRAP, derived=True)), _pull)
