"""Thread of a screw joint, which the paper leaves out (METHOD, "Thread").

The flanks of a thread of mean radius r and lead angle λ, tan λ = pitch/(2π r), press all around with normal forces of sum f;
their normals lean by the flank angle β (in the section across the thread). Friction k f acts along the helix. Of the axial force
F = f_c·e1 one flank or the other carries all: f = |F| / (cos β cos λ + σ k sin λ), σ the sign of F.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from engine.basics.numbers import Bound
from engine.basics.symbolic import SX, ca
from engine.contact.base import COMPONENTS, TINY, Contact, ContactElement, Hold, Place, Size, Solid, Wrench, ratio_held, signum
from engine.contact.journal import HALF_ROOT, PRELOAD, RADIUS, preloaded
from engine.friction import Law

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs

FLANK = Size(
    "flank_angle", "rad", "angle by which a thread's flanks lean, in the section across it (15 deg: trapezoidal, 30 deg: metric)",
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
    """Along the helix."""
    return [[g["radius"] * rates[0] / _lead(g)[0]]]


def _ratio(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> SX:
    return w.pin * laws[0].ratios(_velocity(rates, g)[0])[0]


def _carried(w: Wrench, k: SX, g: Mapping[str, SX]) -> SX:
    """Axial force that the flanks and their own friction carry, N: what friction of a preload leaves of it."""
    return w["f1"] - k * g["preload"] * _lead(g)[1] if "preload" in g else w["f1"]


def _normal(w: Wrench, k: SX, g: Mapping[str, SX]) -> SX:
    """Sum of the normal forces that the load presses on the flanks, N."""
    cosine, sine = _lead(g)
    lean = ca.cos(g["flank_angle"])
    carried = _carried(w, k, g)
    return ca.sqrt(carried * carried + TINY) / (lean * cosine + signum(carried) * k * sine)


def _load(w: Wrench, k: SX, g: Mapping[str, SX], adams: bool) -> SX:
    """What friction is proportional to: the normal forces (in Adams' form the axial force) and a preload."""
    return preloaded(ca.sqrt(w["f1"] ** 2 + TINY) if adams else _normal(w, k, g), g)


def _friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    """k f r/cos λ: work of the friction along the helix for an angle of one."""
    k = _ratio(w, rates, laws, g)
    return [w.pin * k * g["radius"] / _lead(g)[0] * _load(w, k, g, adams)]


def _held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
    """k f grows with k, so that its value at μ_static is the capacity (METHOD, "Rest")."""
    most = laws[0].static
    return [Hold(most * _load(w, w.pin * most * signum(u[0]), g, adams), ca.fabs(u[0]) * _lead(g)[0] / g["radius"])]


def _speeds(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
    v = _velocity(rates, g)[0]
    return [ca.fabs(v[0]) * laws[0].sign(v, (1.0,))]


def _contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
    """One contact without place or angle: all flanks together, its normal along the axis."""
    k = _ratio(w, rates, laws, g)
    if laws[0].sets:
        side = w.pin * signum(eta[0])
        still = ratio_held(lambda x: _load(w, side * x, g, False), ca.fabs(eta[0]) * _lead(g)[0] / g["radius"])
        k = ca.if_else(laws[0].stuck, side * still, k)
    f, none = _normal(w, k, g), ca.SX(0)
    return [Contact(f, (-signum(_carried(w, k, g)) * f, none, none), (2, 1))]


def _pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX]) -> list[SX]:
    """All six components, as of a joint that has no contacts: they do not decide what friction of a thread is."""
    return [HALF_ROOT * w[n] / (g["radius"] if n.startswith("m") else 1) for n in COMPONENTS]


def _places(g: Mapping[str, float]) -> list[Place]:
    return []


def _pins(g: Mapping[str, float]) -> list[Solid]:
    return [Solid("cylinder", (g["radius"], 4 * g["radius"]))]


def _rests(j: Rubs) -> list[Pair]:
    """Bounds: friction that helps the load to turn the thread back presses less than one that hinders it."""
    import numpy as np

    from engine.contact.resting import Capacity, Norm, Pair, preload, static, whole

    mu, r = static(j), j.sizes["radius"]
    slope = j.sizes["pitch"] / (2 * math.pi * r)
    cosine = 1 / math.hypot(1.0, slope)
    lean, turned = math.cos(j.sizes["flank_angle"]) * cosine, mu * abs(slope) * cosine
    most, least = (mu / x if x > 0 else math.inf for x in (lean - turned, lean + turned))
    if j.adams:
        most = least = mu
    more = preload(j, mu)
    norms = (Norm(whole(j, ("f1",)), min(most, 1e9)), *more)
    held = Capacity(norms, 0, most == least and not more, (least, *(n.weight for n in more)))
    return [Pair(j.joint, 1, j.eta, np.array([[cosine / r]]), (held,), mu)]


THREAD = ContactElement(
    "thread", _needs, _friction, _speeds, _held, _contacts, _velocity, _pressed, 1, springs=6, rests=_rests,
    sizes=(RADIUS, FLANK, PRELOAD), pairs=((0,),), places=_places, pins=_pins, anywhere=False,
)  # fmt: skip
