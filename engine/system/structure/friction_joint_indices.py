"""Joints with friction in the order of the complement equations (theory, "Complement equations"). An entry contains the components
of the reaction that the contact forms need, and offsets of the joint's values. This module does not need the symbolic library."""

from __future__ import annotations

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import ContactElement
from trunnion.elements.contact.contact_element import COMPONENTS, OVERLAP, SPAN
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.runtime.abi import PairKind
from trunnion.system.structure.bodies_and_joints import FrictionElement, Joint, System


@dataclass
class Element:
    """A joint with friction.

    needs   components of f_c, m_c that the contact forms use: rows n0, n0 + 1, … of the N block.
    rate0   index of the joint's first freedom among the rates of all joints with friction."""

    joint: Joint
    contact: ContactElement
    needs: tuple[str, ...]
    n0: int
    rate0: int

    @property
    def friction(self) -> FrictionElement:
        """The joint's friction data."""
        assert self.joint.friction is not None
        return self.joint.friction

    @property
    def eta(self) -> list[int]:
        """Indices of the joint's friction multipliers, one for each freedom."""
        return list(self.friction.eta)

    @property
    def law_kind(self) -> PairKind:
        """The kind of friction pair that the law needs. The kind follows from the law's behaviour at rest."""
        law = LAWS[self.friction.law]
        if law.bristles:
            return PairKind.TURN if all(len(s.eta) == 1 for s in self.friction.sliders) else PairKind.SMOOTH
        return PairKind.SET if law.sets else PairKind.KINK if law.kinks else PairKind.SMOOTH

    @property
    def sets(self) -> bool:
        """Whether the law is set-valued."""
        return self.law_kind == PairKind.SET


def everything(j: Joint) -> tuple[str, ...]:
    """All values that the contact forms of a joint may need: the components of f_c and m_c, and half the distance between the
    contacts (``SPAN``) if it changes."""
    return (*COMPONENTS, SPAN) if j.fit.ends == OVERLAP else COMPONENTS


def elements(system: System) -> list[Element]:
    """All joints with friction, in the order of the system's joints."""
    out: list[Element] = []
    n0 = rate0 = 0
    for j in system.frictional:
        f = j.friction
        assert f is not None
        contact = CONTACTS[f.contact]
        needs = contact.needs([name for name, _ in f.numbers], f.adams)
        out.append(Element(j, contact, needs, n0, rate0))
        n0 += len(needs)
        rate0 += j.kind.nv
    return out


def any_sets(system: System) -> bool:
    """Whether any friction law of the system is set-valued at rest."""
    return any(j.friction is not None and LAWS[j.friction.law].sets for j in system.frictional)
