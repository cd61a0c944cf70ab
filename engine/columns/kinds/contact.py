"""Contacts of a joint with friction: normal force, position, and whether the contact is open."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import NOT_NEGATIVE
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import CONTACT_REACTION, FRICTION, JOINT_MULTIPLIERS, JOINT_POSE, JOINT_RATES
from trunnion.columns.subjects import FRICTIONAL_JOINT, Subject
from trunnion.elements.contact import REGISTRY as CONTACTS

if TYPE_CHECKING:
    from trunnion.elements.contact.contact_element import Contact
    from trunnion.recursion.body_kinematics import Pose
    from trunnion.recursion.complement_equation_terms import FrictionTerms

TINY = 1e-300
WATCHED = 4
"""Number of values of a ``tr_contact``. They are the force and three components of a vector: along the cosine axis, the sine axis
and the third axis. The contact's angle is atan2(sine component, cosine component)."""


def contacts(friction: FrictionTerms, reaction: SX, rates: SX, multipliers: SX, pose: Pose) -> dict[str, list[SX]]:
    """Contacts of a joint, computed by the closed forms of §7 of the paper. Vectors are in the inboard joint frame."""
    from trunnion.recursion.complement_equation_terms import wrench
    from trunnion.recursion.joint_reactions import pin_axes

    e = friction.element
    split = [[v[k] for k in range(v.numel())] for v in (rates, multipliers)]
    found = e.contact.contacts(wrench(e, reaction), split[0], friction.laws, friction.numbers, split[1])
    turn = ca.sparsify(pose.Ein.T @ pin_axes(e.joint, pose.Ein, pose.Eout))
    out: dict[str, list[SX]] = {name: [] for name in ("force", "angle", "elevation", "normal", "state", "watched")}
    for c in found:
        for name, values in _touch(c, turn).items():
            out[name] += values
    return out


def _touch(c: Contact, turn: SX) -> dict[str, list[SX]]:
    """The outputs of one contact. turn: rotation from the pin's frame into the inboard joint frame (3×3). The angle is measured in
    the pin's frame. For contacts with ``inboard`` (ball), the angle is measured in the inboard joint frame."""
    vector = turn @ ca.vertcat(*c.vector)
    normal = vector / ca.sqrt(ca.dot(vector, vector) + TINY)
    (axis, base), third = c.plane, 3 - c.plane[0] - c.plane[1]
    own = (vector[0], vector[1], vector[2]) if c.inboard else c.vector
    watched = c.watched or own
    return {
        "force": [c.force], "angle": [angle(own[base], own[axis])],
        "elevation": [ca.asin(ca.fmin(1, ca.fmax(-1, normal[third])))], "normal": [normal[k] for k in range(3)],
        "state": [c.force], "watched": [c.force, watched[axis], watched[base], watched[third]],
    }  # fmt: skip


def angle(y: SX, x: SX) -> SX:
    """atan2(y, x), but 0 at the origin, where the derivatives of atan2 are NaN."""
    none = x * x + y * y <= TINY
    return ca.if_else(none, 0, ca.atan2(y, ca.if_else(none, 1, x)))


def count(s: Subject) -> int:
    """Number of contacts of a joint."""
    return CONTACTS[s.data.friction.contact].count


def elevates(s: Subject) -> bool:
    """Whether contact normals may leave the plane in which the contact's angle is measured."""
    return CONTACTS[s.data.friction.contact].elevates


def held(_: Subject) -> str:
    """Post-processing: an open contact has no direction, so the runtime outputs the last direction of the contact."""
    return "hold"


def touching(_: Subject) -> str:
    """Post-processing: only the runtime knows how large the round-off of a contact force is."""
    return "touch"


KIND = ColumnKind(
    of=FRICTIONAL_JOINT,
    operands={"friction": FRICTION, "reaction": CONTACT_REACTION, "rates": JOINT_RATES, "multipliers": JOINT_MULTIPLIERS,
              "pose": JOINT_POSE},
    expression=contacts,
    repeats=count,
    beside=("watched",),
    quantities=(
        Quantity(name="contact", output="force", label=("force",), column="{joint}.contact[{item}].normal_force", unit="N",
                 text="normal force at contact {item} of {joint}", bound=NOT_NEGATIVE, direct=True, reacts=True),
        Quantity(name="contact", output="angle", label=("angle",), column="{joint}.contact[{item}].angle", unit="rad",
                 text="orientation angle of contact {item} of {joint}", post=held, direct=True, reacts=True),
        Quantity(name="contact", output="elevation", label=("elevation",), column="{joint}.contact[{item}].elevation", unit="rad",
                 text="elevation of contact {item} of {joint}", given=elevates, post=held, direct=True, reacts=True),
        Quantity(name="contact", output="normal", label=("normal",), column="{joint}.contact[{item}].normal[{component}]", size=3,
                 unit="1", text="outward normal of the pin, inboard joint frame", post=held, direct=True, reacts=True),
        Quantity(name="contact.state", output="state", label=("state",), column="{joint}.contact[{item}].state", unit="1",
                 text="1: touching, 0: no contact force", post=touching, vector=False, direct=True, steps=True, smooth=False,
                 reacts=True),
    ),
)  # fmt: skip
