"""Thread of a screw joint, which the paper does not treat (theory, "Thread").

r is the mean radius and λ the lead angle, tan λ = pitch/(2π r). Normal forces act on the flanks around the whole circumference; the
sum of their magnitudes is f. The flank angle β is the inclination of the normals in the section normal to the thread. Friction k f
acts along the helix. One flank carries the whole axial force F = f_c·e1: f = |F| / (cos β cos λ + σ k sin λ), σ = sign F."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import Bound
from trunnion.elements.contact.contact_element import (
    COMPONENTS,
    TINY,
    Contact,
    ContactElement,
    SinglePair,
    Size,
    Solid,
    Wrench,
    signum,
)
from trunnion.elements.contact.journal import HALF_ROOT, PRELOAD, RADIUS, with_preload
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

FLANK = Size(
    "flank_angle", "rad", "inclination of the flanks in the section normal to the thread (15 deg: trapezoidal, 30 deg: metric)",
    Bound(0.0, 1.5), '"15 deg"', symbol="β", bears=False,
)  # fmt: skip


def _needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
    return ("f1",)


def _lead(g: Mapping[str, SX]) -> tuple[SX, SX]:
    """cos λ and sin λ."""
    slope = g["pitch"] / (2 * math.pi * g["radius"])
    cosine = (1 + slope * slope) ** -0.5
    return cosine, slope * cosine


def _velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
    """Velocity along the helix."""
    return [[g["radius"] * rates[0] / _lead(g)[0]]]


def _carried(w: Wrench, k: SX, g: Mapping[str, SX]) -> SX:
    """Axial force that the normal forces on the flanks and their friction carry, N. This is F minus the axial component of the
    friction due to a preload."""
    return w["f1"] - k * g["preload"] * _lead(g)[1] if "preload" in g else w["f1"]


def _normal(w: Wrench, k: SX, g: Mapping[str, SX]) -> SX:
    """Sum f of the normal forces on the flanks due to the load, N."""
    cosine, sine = _lead(g)
    lean = ca.cos(g["flank_angle"])
    carried = _carried(w, k, g)
    return ca.sqrt(carried * carried + TINY) / (lean * cosine + signum(carried) * k * sine)


def _load(w: Wrench, k: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """Load to which friction is proportional: sum of the normal forces + preload. In Adams' form, the axial force replaces the
    sum."""
    return with_preload(ca.sqrt(w["f1"] ** 2 + TINY) if adams else _normal(w, k, g), g)


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """Friction torque k f r/cos λ: the work per angle of the friction along the helix."""
    k = _PAIR.ratio(w, rates, laws, g)
    return [w.pin * k * g["radius"] / _lead(g)[0] * _load(w, k, g, adams)]


_PAIR = SinglePair(_velocity, _load, lambda eta, g: ca.fabs(eta) * _lead(g)[0] / g["radius"])


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """One contact for all flanks, without position or angle; its normal is parallel to the axis."""
    k = _PAIR.ratio_now(w, rates, laws, g, eta)
    f, none = _normal(w, k, g), ca.SX(0)
    return [Contact(f, (-signum(_carried(w, k, g)) * f, none, none), (2, 1))]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
    """All six components of the wrench, as for a joint without contacts. Only the axial force changes a thread's friction."""
    return [HALF_ROOT * w[n] / (g["radius"] if n.startswith("m") else 1) for n in COMPONENTS]


def _rests(j: Rubs) -> list[Pair]:
    """Let u be the friction along the helix, including the friction of a preload. The axial force F is the sum of the axial
    components of normal force and friction. Therefore the normal force is |F − u sin λ|/(cos β cos λ). If μ tan λ > cos β, a larger
    normal force increases the load more than the friction; the capacity is then an upper bound. A share is the friction divided by
    the capacity with u at its limit. Kernels define a share in the same way."""
    import numpy as np

    from trunnion.elements.contact.static_friction_capacity import AtLimit, Capacity, Norm, Pair

    mu, r = j.static, j.sizes["radius"]
    slope = j.sizes["pitch"] / (2 * math.pi * r)
    cosine = 1 / math.hypot(1.0, slope)
    lean, lift = math.cos(j.sizes["flank_angle"]) * cosine, slope * cosine
    flanks = Norm(j.rows(("f1",)), mu) if j.adams else Norm(j.rows(("f1",)), mu / lean, 1.0 / lean, own=-j.sense * lift)
    exact, preload = j.adams or mu * abs(lift) < lean, j.sizes.get("preload") or 0.0
    held, limits = Capacity((flanks, *j.preload(mu)), 0, exact), []
    for sense, side in ((a, b) for a in (1, -1) for b in (1, -1)):
        leans = sense * j.sense * mu * lift
        limits.append(AtLimit(sense, side * j.rows(("f1",)), -side * leans * preload, mu / (lean + side * leans), mu * preload))
    return [Pair(j.joint, 1, j.eta, np.array([[cosine / r]]), (held,), mu, limits=tuple(limits) if exact and not j.adams else ())]


THREAD = ContactElement(
    "thread", _needs, _friction, _PAIR.held, _contacts, _velocity, _pressed, 1, springs=6, rests=_rests,
    sizes=(RADIUS, FLANK, PRELOAD), pairs=((0,),), anywhere=False,
    pins=lambda g: [Solid("cylinder", (g["radius"], 4 * g["radius"]))],
)  # fmt: skip
