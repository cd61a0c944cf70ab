"""Rectangular sleeve of a prismatic joint, which the paper leaves out (METHOD, "Sleeve").

The inner part, which is the pin's, has half length c and half sizes a along e2 and b along e3. It is pressed at its two ends along
e2 and along e3, and a couple on its faces carries the torsion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from engine.basics.numbers import POSITIVE
from engine.basics.symbolic import SX, ca
from engine.contact.base import Contact, ContactElement, Hold, Place, Size, Solid, Wrench, ratio_held, signum, while_sliding
from engine.contact.journal import HALF_LENGTH, HALF_ROOT, LENGTHS, PRELOAD, far, half_length, length, preloaded, spanned
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

TINY = 1e-300


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f2", "f3") if adams else spanned(("f2", "f3", "m1", "m2", "m3"), numbers)


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[rates[0]]]


def _ratio(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> SX:
    return w.pin * laws[0].ratios(_velocity(rates, g)[0])[0]


def _forces(w: Wrench, k: SX, g: Mapping[str, SX]) -> tuple[SX, SX, SX, SX, SX]:
    """Forces on the inner part, N, with k friction per normal force: along e2 at −c and at +c, along e3 at −c and at +c, and the
    total force of the couple that carries the torsion (with its sign)."""
    a, b, c = g["half_width"], g["half_height"], half_length(w, g)
    d2 = (w["m3"] - k * a * w["f2"]) / (2 * c)
    d3 = (w["m2"] + k * b * w["f3"]) / (2 * c)
    h2, h3 = 0.5 * w["f2"], 0.5 * w["f3"]
    return h2 - d2, h2 + d2, h3 + d3, h3 - d3, w["m1"] / ca.fmax(a, b)


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    k = _ratio(w, rates, laws, g)
    return [w.pin * k * _load(w, k, g, adams)]


def _load(w: Wrench, k: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """What friction is proportional to: the sum of all normal forces (in Adams' form the force across the axis) and a preload."""
    load = length(w["f2"], w["f3"]) if adams else sum((ca.sqrt(x * x + TINY) for x in _forces(w, k, g)), ca.SX(0))
    return preloaded(load, g)


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    most = laws[0].static
    return [Hold(most * _load(w, w.pin * most * signum(u[0]), g, adams), ca.fabs(u[0]))]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    return [ca.fabs(rates[0]) * laws[0].sign(rates, (1.0,))]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
    """Forces of both ends as sums and differences over √2, and that of the couple which carries the torsion."""
    k = while_sliding(laws[0], _ratio(w, rates, laws, g)) if laws else ca.SX(0)
    a, b, c = g["half_width"], g["half_height"], half_length(w, g)
    tilts = ((w["m3"] - k * a * w["f2"]) / c, (w["m2"] + k * b * w["f3"]) / c)
    return [*(HALF_ROOT * x for x in (w["f2"], w["f3"], *tilts)), w["m1"] / ca.fmax(a, b)]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """The outward normal on the inner part is opposite to the force on it; contact 5 is the couple about e1."""
    k = _ratio(w, rates, laws, g)
    if laws[0].sets:
        side = w.pin * signum(eta[0])
        k = ca.if_else(laws[0].stuck, side * ratio_held(lambda x: _load(w, side * x, g, False), ca.fabs(eta[0])), k)
    p, q, r, s, couple = _forces(w, k, g)
    zero = ca.SX(0)
    out = [Contact(ca.sqrt(x * x + TINY), (zero, -x, zero), (2, 1)) for x in (p, q)]
    out += [Contact(ca.sqrt(x * x + TINY), (zero, zero, -x), (2, 1)) for x in (r, s)]
    return [*out, Contact(ca.sqrt(couple * couple + TINY), (couple, zero, zero), (2, 1))]


def _places(g: Mapping[str, float]) -> list[Place]:
    """Places of contacts 1 to 4; the couple has none."""
    c = far(g)
    sides = ("half_width", "half_height"), ("half_height", "half_width")
    return [Place("pin", 0, along, g[arm], area=2 * c * g[across]) for arm, across in sides for along in (-c, c)]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from engine.contact.resting import Capacity, Norm, Pair, preload, row, static, whole

    mu = static(j)
    if j.adams:
        capacities: tuple[Capacity, ...] = (Capacity((Norm(whole(j, ("f2", "f3")), mu), *preload(j, mu))),)
    else:
        a, b, c = j.sizes["half_width"], j.sizes["half_height"], j.sizes["half_length"]

        def norms(sense: int) -> tuple[Norm, ...]:
            k = sense * j.sense * mu
            rows = [row(j, f2=0.5 + s * k * a / (2 * c), m3=-s / (2 * c)) for s in (1, -1)]
            rows += [row(j, f3=0.5 + s * k * b / (2 * c), m2=s / (2 * c)) for s in (1, -1)]
            pressed = tuple(Norm(row[None, :], mu) for row in [*rows, row(j, m1=1.0 / max(a, b))])
            return (*pressed, *preload(j, mu))

        capacities = tuple(Capacity(norms(s), s) for s in (1, -1))
    return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), capacities, mu)]


SLEEVE = ContactElement(
    "sleeve", _needs, _friction, _speeds, _held, _contacts, _velocity, _pressed, 5, springs=5,
    rests=_rests, sizes=(
        HALF_LENGTH, *LENGTHS,
        Size("half_width", "m", "a: half size of the guide along e2", POSITIVE, '"20 mm"', symbol="a", drawn=0.02),
        Size("half_height", "m", "b: half size of the guide along e3", POSITIVE, '"20 mm"', symbol="b", drawn=0.02),
        PRELOAD,
    ),
    pairs=((0,),), places=_places,
    pins=lambda g: [Solid("box", (2 * far(g), 2 * g["half_width"], 2 * g["half_height"]))],
    anywhere=False, ideal="outboard",
)  # fmt: skip
