"""The cross of a universal joint (paper §7.4): two journals on a massless cross.

Journal 1 turns about u1. Its formula is (143), with the axes (u1, u2, u3). Journal 2 turns about u2. Its formula is (147): the
journal formulas for (−f_c, −m_c), with the axes (u2, u3, u1) and k2 = −μ_e sign(q̇2). This sign makes friction dissipate (theory,
"Universal joint"). The wrench is always that on the inboard part. If the pins are on the cross, forces and both ratios k change
sign."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.contact.clearance import Play
from trunnion.elements.contact.contact_element import (
    TINY,
    Contact,
    ContactElement,
    Hold,
    Place,
    Solid,
    Wrench,
    ratio_held,
    signum,
)
from trunnion.elements.contact.journal import HALF_LENGTH, HALF_ROOT, PRELOAD, RADIUS, length, split, sums, with_preload
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f1", "f2", "f3") if adams else ("f1", "f2", "f3", "m1", "m2", "m3")


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    return [[g[f"radius[{i + 1}]"] * rates[i]] for i in range(2)]


def _ratios(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> tuple[SX, SX]:
    """Friction ratios k1, k2 of the two journals, with the signs that the journal formulas expect."""
    v = _velocity(rates, g)
    return w.pin * laws[0].ratios(v[0])[0], -w.pin * laws[1].ratios(v[1])[0]


def _journals(
    form: Callable[..., tuple[SX, SX, SX, SX]], w: Wrench, k1: SX, k2: SX, g: Mapping[str, SX]
) -> tuple[tuple[SX, SX, SX, SX], tuple[SX, SX, SX, SX]]:
    """Normal forces of each journal, N (``split``), or sums and differences of these forces (``sums``)."""
    p, none = w.pin, ca.SX(0)
    c1, c2 = g["half_length[1]"], g["half_length[2]"]
    first = form(p * w["f2"], p * w["f3"], p * w["m2"], p * w["m3"], k1, none, none, c1)
    second = form(-p * w["f3"], -p * w["f1"], -p * w["m3"], -p * w["m1"], k2, none, none, c2)
    return first, second


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction torques (149) and (150): m_c·u1 = k1 r1 (f1+f2) and −m_c·u2 = k2 r2 (f5+f6)."""
    k1, k2 = _ratios(w, rates, laws, g)
    loads = _loads(w, k1, k2, g, adams)
    return [w.pin * k1 * g["radius[1]"] * loads[0], -w.pin * k2 * g["radius[2]"] * loads[1]]


def _loads(w: Wrench, k1: SX, k2: SX, g: Mapping[str, SX], adams: bool) -> list[SX]:
    """The load to which the friction of each journal is proportional: sum of its normal forces + preload. In Adams' form, |f_c|
    replaces the sum."""
    if adams:
        loads = [ca.sqrt(w["f1"] ** 2 + w["f2"] ** 2 + w["f3"] ** 2 + TINY)] * 2
    else:
        loads = [length(a1, b1) + length(a2, b2) for a1, b1, a2, b2 in _journals(split, w, k1, k2, g)]
    return [with_preload(load, g, f"preload[{i + 1}]") for i, load in enumerate(loads)]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """Hold of each journal, whose capacity is that of a revolute joint's journal."""
    most = [law.static for law in laws]
    loads = _loads(w, w.pin * most[0] * signum(u[0]), -w.pin * most[1] * signum(u[1]), g, adams)
    return [Hold(most[i] * loads[i], ca.fabs(u[i]) / g[f"radius[{i + 1}]"]) for i in range(2)]


def _still(w: Wrench, laws: list[Law], g: Mapping[str, SX], eta: list[SX], i: int) -> SX:
    """Friction ratio of journal i (0 or 1) at rest. The load of a journal does not depend on the ratio of the other journal."""
    side = (1, -1)[i] * w.pin * signum(eta[i])

    def load(k: SX) -> SX:
        return _loads(w, side * k, side * k, g, False)[i]

    return side * ratio_held(load, ca.fabs(eta[i]) / g[f"radius[{i + 1}]"], laws[i].static)


def _ratios_now(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> tuple[SX, SX]:
    """Friction ratios of sliding journals, or of journals at rest with the friction η."""
    k = _ratios(w, rates, laws, g)
    if not (laws[0].sets and eta):
        return k
    first, second = (ca.if_else(law.stuck, _still(w, laws, g, eta, i), k[i]) for i, law in enumerate(laws))
    return first, second


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    k1, k2 = _ratios_now(w, rates, laws, g, eta) if laws else (ca.SX(0), ca.SX(0))
    first, second = _journals(sums, w, k1, k2, g)
    return [HALF_ROOT * x for x in (*first, *second)]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """Contacts 1 and 2 are on journal 1 (n = cosθ u3 + sinθ u2). Contacts 3 and 4 are on journal 2 (n = cosθ u1 + sinθ u3)."""
    first, second = _journals(split, w, *_ratios_now(w, rates, laws, g, eta), g)
    out = [Contact(length(a, b), (ca.SX(0), b, a), (2, 1)) for a, b in (first[:2], first[2:])]
    return out + [Contact(length(a, b), (a, ca.SX(0), b), (0, 2)) for a, b in (second[:2], second[2:])]


def _places(g: Mapping[str, float]) -> list[Place]:
    """Positions of the contacts. The contacts of journal 1 are on the inboard e1, the contacts of journal 2 on the outboard e2."""
    ends = [(k, side * g[f"half_length[{k + 1}]"], g[f"radius[{k + 1}]"]) for k in (0, 1) for side in (-1, 1)]
    return [Place(("inboard", "outboard")[k], k, along, r, k, 2 * r * abs(along), r * abs(along)) for k, along, r in ends]


def _pins(g: Mapping[str, float]) -> list[Solid]:
    return [
        Solid("cylinder", (g[f"radius[{k + 1}]"], 2 * g[f"half_length[{k + 1}]"]), ("inboard", "outboard")[k], k) for k in (0, 1)
    ]


def _rests(j: Rubs) -> list[Pair]:
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair

    mu, name, out = j.static, j.joint, []
    names = ((("f2", "f3"), ("m2", "m3")), (("f3", "f1"), ("m3", "m1")))
    for k, (across, about) in enumerate(names):
        if j.adams:
            norms: tuple[Norm, ...] = (Norm(j.rows(j.adams_forces), mu),)
        else:
            norms = j.ends(across, about, j.sizes[f"half_length[{k + 1}]"], mu)
        norms += j.preload(mu, f"preload[{k + 1}]")
        out.append(Pair(name, k + 1, (j.eta[k],), np.array([[1.0 / j.sizes[f"radius[{k + 1}]"]]]), (Capacity(norms),), mu))
    return out


CROSS = ContactElement(
    "cross", _needs, _friction, _held, _contacts, _velocity, _pressed, 4, springs=8,
    rests=_rests,
    sizes=(replace(RADIUS, count=2), replace(HALF_LENGTH, count=2), replace(PRELOAD, count=2)),
    pairs=((0,), (1,)), places=_places, pins=_pins, frame="both", thrusts=("f1", "f2"),
    plays=(Play((1, 2), ("e1",), ("u3",), ("u3", "u2")), Play((2, 0), ("u2",), ("u3",), ("e1", "u3"), "out", True)),
)  # fmt: skip
