"""Friction that depends on the transmitted force or torque, with a coefficient for each direction of power (theory, "Gear units").

T is the force or torque that the joint transmits to its outboard part, friction included. The friction is c |T| + a, with c = c_f
where the power flows to the outboard part, and c = c_b where the outboard part drives. There are no contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.contact_element import TINY, Contact, ContactElement, Hold, Size, Wrench
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.elements.friction import Law

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs

LEAST = 1e-9
"""Least coefficient in bounds at rest, which divide by the coefficients."""
Numbers = Mapping[str, Any]
"""Numbers of an element by name: expressions, or plain numbers."""


@dataclass(frozen=True)
class Losses:
    """Losses of a joint along its only freedom.

    along         the component of f_c, m_c that the joint transmits, f1 or m1
    coefficients  (numbers, |T|, speed) → c_f, c_b; with plain numbers, |T| and speed are 0
    constant      (numbers, sense of motion) → a; the sense is an expression or ±1
    """

    along: str
    coefficients: Callable[[Numbers, Any, Any], tuple[Any, Any]]
    constant: Callable[[Numbers, Any], Any]

    def friction(self, w: Wrench, sense: SX, g: Mapping[str, SX], speed: SX) -> SX:
        """Magnitude of the friction. sense: sign of the motion that the friction opposes. The force on the part with the pin is −T
        for the inboard part, T for the outboard part."""
        load = ca.sqrt(w[self.along] ** 2 + TINY)
        forward, backward = self.coefficients(g, load, speed)
        return ca.if_else(w.pin * sense * w[self.along] < 0, forward, backward) * load + self.constant(g, sense)

    def rests(self, j: Rubs) -> list[Pair]:
        """Let u be the friction in the sense of T. With different coefficients, |u| ≤ c |T| means |u| ≤ w |T + o u|. Here 1/w =
        (1/c_f + 1/c_b)/2 and o = (1/c_b − 1/c_f)/2. The part a is first subtracted from |u|. A share is the friction divided by the
        capacity in its direction. Kernels define a share in the same way."""
        import numpy as np

        from trunnion.elements.contact.static_friction_capacity import AtLimit, Capacity, Norm, Pair

        mu, rows = j.static, j.rows((self.along,))
        forward, backward = (max(mu * c, LEAST) for c in self.coefficients(j.sizes, 0.0, 0.0))
        constant = {sense: mu * self.constant(j.sizes, sense) for sense in (1, -1)}
        lean, weight = j.sense * (1 / forward - 1 / backward) / 2, 2 / (1 / forward + 1 / backward)
        held: tuple[Capacity, ...] = (Capacity((Norm(rows, weight, 0.0, 0.0, lean),)),)
        if any(constant.values()):
            held = tuple(
                Capacity((Norm(rows, weight, 0.0, -sense * lean * a, lean), j.constant(a, 1.0)), sense)
                for sense, a in constant.items()
            )
        ends = ((sense, side, forward if j.sense * sense * side < 0 else backward) for sense in (1, -1) for side in (1, -1))
        limits = tuple(AtLimit(sense, side * rows, 0.0, c, constant[sense]) for sense, side, c in ends)
        return [Pair(j.joint, 1, j.eta, np.array([[1.0]]), held, mu, limits=limits)]


def transmission(name: str, losses: Losses, sizes: tuple[Size, ...]) -> ContactElement:
    """An element with these losses."""

    def needs(numbers: Sequence[str], adams: bool) -> tuple[str, ...]:
        return (losses.along,)

    def velocity(rates: list[SX], g: Mapping[str, SX]) -> list[list[SX]]:
        return [[rates[0]]]

    def friction(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[SX]:
        k = laws[0].ratios([rates[0]])[0]
        return [k * losses.friction(w, k, g, ca.sqrt(rates[0] ** 2 + TINY))]

    def held(w: Wrench, u: list[SX], laws: list[Law], g: Mapping[str, SX], adams: bool) -> list[Hold]:
        return [Hold(laws[0].static * losses.friction(w, u[0], g, ca.SX(0)), ca.fabs(u[0]))]

    def contacts(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[Contact]:
        return []

    def pressed(w: Wrench, rates: list[SX], laws: list[Law], g: Mapping[str, SX], eta: list[SX]) -> list[SX]:
        """The transmitted torque at an arm of 1 m. Friction does not change this torque."""
        return [HALF_ROOT * w[losses.along]]

    return ContactElement(
        name, needs, friction, held, contacts, velocity, pressed, 0, springs=1, rests=losses.rests, sizes=sizes, pairs=((0,),),
        anywhere=False,
    )  # fmt: skip
