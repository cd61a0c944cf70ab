"""Rectangular sleeve of a prismatic joint, which the paper does not treat (theory, "Sleeve").

The inner part is the pin, with half length c and half sizes a along e2 and b along e3. At both ends of the inner part, forces act
along e2 and e3. A couple on the faces carries the torsion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import POSITIVE
from trunnion.elements.contact.clearance import Play
from trunnion.elements.contact.contact_element import (
    TINY,
    Contact,
    ContactElement,
    Place,
    SinglePair,
    Size,
    Solid,
    Wrench,
)
from trunnion.elements.contact.journal import (
    HALF_LENGTH,
    HALF_ROOT,
    LENGTHS,
    PRELOAD,
    drawn_half_length,
    half_length,
    length,
    with_preload,
    with_span,
)
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f2", "f3") if adams else with_span(("f2", "f3", "m1", "m2", "m3"), numbers)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0]]]


def _forces(w: Wrench, k: SX, g: Mapping[str, SX]) -> tuple[SX, SX, SX, SX, SX]:
    """Signed forces, N, on the inner part for friction ratio k: along e2 at −c and +c, along e3 at −c and +c, and the total force
    of the torsion couple."""
    a, b, c = g["half_width"], g["half_height"], half_length(w, g)
    d2 = (w["m3"] - k * a * w["f2"]) / (2 * c)
    d3 = (w["m2"] + k * b * w["f3"]) / (2 * c)
    h2, h3 = 0.5 * w["f2"], 0.5 * w["f3"]
    return h2 - d2, h2 + d2, h3 + d3, h3 - d3, w["m1"] / ca.fmax(a, b)


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    k = _PAIR.ratio(w, rates, laws, g)
    return [w.pin * k * _load(w, k, g, adams)]


def _load(w: Wrench, k: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """Load to which friction is proportional: sum of all normal forces + preload. In Adams' form, the force normal to the axis
    replaces the sum."""
    load = length(w["f2"], w["f3"]) if adams else sum((ca.sqrt(x * x + TINY) for x in _forces(w, k, g)), ca.SX(0))
    return with_preload(load, g)


_PAIR = SinglePair(_velocity, _load, lambda eta, g: ca.fabs(eta))


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    """Sums and differences of the forces at both ends, divided by √2, and the force of the torsion couple."""
    k = _PAIR.ratio_now(w, rates, laws, g, eta) if laws else ca.SX(0)
    a, b, c = g["half_width"], g["half_height"], half_length(w, g)
    tilts = ((w["m3"] - k * a * w["f2"]) / c, (w["m2"] + k * b * w["f3"]) / c)
    return [*(HALF_ROOT * x for x in (w["f2"], w["f3"], *tilts)), w["m1"] / ca.fmax(a, b)]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """Contacts 1 to 4 at the ends, and contact 5 for the couple about e1. The outward normal on the inner part opposes the force
    on this part."""
    p, q, r, s, couple = _forces(w, _PAIR.ratio_now(w, rates, laws, g, eta), g)
    zero = ca.SX(0)
    out = [Contact(ca.sqrt(x * x + TINY), (zero, -x, zero), (2, 1)) for x in (p, q)]
    out += [Contact(ca.sqrt(x * x + TINY), (zero, zero, -x), (2, 1)) for x in (r, s)]
    return [*out, Contact(ca.sqrt(couple * couple + TINY), (couple, zero, zero), (2, 1))]


def _places(g: Mapping[str, float]) -> list[Place]:
    """Positions of contacts 1 to 4; the couple has no position."""
    c = drawn_half_length(g)
    sides = ("half_width", "half_height"), ("half_height", "half_width")
    return [Place("pin", 0, along, g[arm], area=2 * c * g[across]) for arm, across in sides for along in (-c, c)]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair

    mu = j.static
    if j.adams:
        capacities: tuple[Capacity, ...] = (Capacity((Norm(j.rows(("f2", "f3")), mu), *j.preload(mu))),)
    else:
        a, b, c = j.sizes["half_width"], j.sizes["half_height"], j.sizes["half_length"]

        def norms(sense: int) -> tuple[Norm, ...]:
            k = sense * j.sense * mu
            rows = [j.row(f2=0.5 + s * k * a / (2 * c), m3=-s / (2 * c)) for s in (1, -1)]
            rows += [j.row(f3=0.5 + s * k * b / (2 * c), m2=s / (2 * c)) for s in (1, -1)]
            pressed = tuple(Norm(row[None, :], mu) for row in [*rows, j.row(m1=1.0 / max(a, b))])
            return (*pressed, *j.preload(mu))

        capacities = tuple(Capacity(norms(s), s) for s in (1, -1))
    return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), capacities, mu)]


SLEEVE = ContactElement(
    "sleeve", _needs, _friction, _PAIR.held, _contacts, _velocity, _pressed, 5, springs=5,
    rests=_rests, sizes=(
        HALF_LENGTH, *LENGTHS,
        Size("half_width", "m", "a: half size of the guide along e2", POSITIVE, '"20 mm"', symbol="a", drawn=0.02),
        Size("half_height", "m", "b: half size of the guide along e3", POSITIVE, '"20 mm"', symbol="b", drawn=0.02),
        PRELOAD,
    ),
    pairs=((0,),), places=_places,
    pins=lambda g: [Solid("box", (2 * drawn_half_length(g), 2 * g["half_width"], 2 * g["half_height"]))],
    anywhere=False, ideal="outboard",
    plays=tuple(Play((k,), (f"e{4 - k}",), ("e1", "e2", "e3"), ("e3", "e2")) for k in (1, 2)),
)  # fmt: skip
