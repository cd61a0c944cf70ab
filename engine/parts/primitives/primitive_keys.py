"""Keys that determine the code of primitives: for a body with its joint, and for a joint's friction. This module does not need the
symbolic library."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import field, replace
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.elements.contact.gearbox_losses import EFFICIENCY_TABLES
from trunnion.elements.friction.coulomb import BY_SPEED
from trunnion.elements.joints import REGISTRY
from trunnion.system.structure.bodies_and_joints import Fit, FrictionElement, Joint
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.parameter_table import Leaves, Param

POSE = 21
"""Number of doubles of a joint's pose: inboard and outboard frame in the world (9 each, column-major), and s = p_out − p_in (3)."""
AROUND = "d_"
"""Prefix of operands that are tangents."""
VECTOR = "typedef double tr_vec __attribute__((vector_size(32),aligned(8)));\n"
"""First line of a C text with tangents (``runtime/base/compiler.h``)."""
PIECE, PIECE_SIZE = "piece", 5
"""``PIECE``: name of the operand for the active piece of a cam's profile (start, 4 coefficients), or for the foot on a curve.
``PIECE_SIZE``: size of a piece."""
OUT = "out_"
"""Prefix of the outputs of a column primitive."""
PIN_OUT, PIN_IN = "pin_out", "pin_in"
"""The two structures of the column operand ``reaction_arm``: the outboard part is the pin, or the inboard part."""
LATER_POINTS = frozenset(
    name for curve in (BY_SPEED, *EFFICIENCY_TABLES) for pair in curve[1:] for name in pair
)  # fmt: skip
"""Names of the numbers of a curve's points, without the first point, which stands for the curve in C names."""
KEPT = "kept"
"""Name of the operand with the values that tangents store at a point."""
BARE: dict[str, tuple[str, ...] | None] = {"": None, "moving": ("phi", "rate", "xi", "gin", "gout"), "closed": ("phi", "rate")}
"""Outputs of a cut joint's primitive, by variant. None: all outputs; "moving": those that stepping needs; "closed": those that
closure needs. "moving" and "closed" are only for joints without forces along their freedoms."""


@dataclass(frozen=True)
class Primitive:
    """A precompiled primitive: one op, or several ops that share code.

    operands: names of the operands of each op, in order. sizes: numbers of doubles, by kind. key: digest of the recipe. library:
    path. recipe: module, function and arguments that build the primitive. text (C text) and expressions exist only in the process
    that built the primitive; expressions exist only for a primitive with a single op."""

    operands: Mapping[str, tuple[str, ...]]
    sizes: Mapping[str, int] = field(default_factory=dict)
    text: str = ""
    key: str = ""
    library: str = ""
    recipe: tuple[Any, ...] = ()
    expressions: Any = field(default=None, compare=False, repr=False)

    @property
    def first(self) -> str:
        """Name of the first op, which is unique among all primitives."""
        return next(iter(self.operands))


@dataclass(frozen=True)
class BodyKey:
    """The data that determine the primitive of a body and its joint.

    forward: direction of the recursion across the joint. driven: freedoms with prescribed motion. rubbed: whether friction is
    solved along the recursion. looped: whether there are also multipliers of loops. rotors: whether freedoms turn rotor
    inertias."""

    kind: str
    forward: bool
    driven: tuple[int, ...]
    rubbed: bool = False
    looped: bool = False
    rotors: bool = False

    @property
    def name(self) -> str:
        """Prefix of the C names."""
        how = f"{''.join(map(str, self.driven))}{'_rubbed' * self.rubbed}{'_looped' * self.looped}{'_rotors' * self.rotors}"
        return f"p_{self.kind}_{'out' if self.forward else 'in'}{how}"

    @property
    def free(self) -> int:
        """Number of freedoms that are not prescribed."""
        return REGISTRY[self.kind].nv - len(self.driven)


@dataclass(frozen=True)
class FrictionKey:
    """The data that determine the primitives of a joint's friction: the joint, without names, values and offsets, and the reaction
    components that the friction needs."""

    joint: Joint
    needs: tuple[str, ...]

    @property
    def name(self) -> str:
        """Prefix of the C names."""
        f = self.joint.friction
        assert f is not None
        words = [self.joint.kind_name, f.law, *(["adams"] if f.adams else []), self.joint.fit.label]
        names = [name for name, _ in f.numbers if name not in LATER_POINTS]
        return "f_" + re.sub(r"\W", "_", "_".join([*words, *names]))


def library_name(recipe: tuple[Any, ...]) -> str:
    """Name of the installed library with the primitive of a recipe: the first joint type that the recipe names, or "all". There is
    a library for each joint type, because a scene loads the primitives of its joint types only."""
    return next(_joint_types(recipe), "all")


def _joint_types(value: Any) -> Iterator[str]:
    if isinstance(value, tuple):
        for each in value:
            yield from _joint_types(each)
    elif isinstance(value, BodyKey):
        yield value.kind
    elif isinstance(value, FrictionKey):
        yield value.joint.kind_name
    elif isinstance(value, str) and value in REGISTRY:
        yield value


def rubbing(e: Element) -> FrictionKey:
    """The key of an element's primitives."""
    f = e.friction
    first, flag = min(e.eta), f.sliders[0].flag
    sliders = tuple(replace(s, flag=s.flag - flag, eta=tuple(i - first for i in s.eta)) for s in f.sliders)
    numbers = ParameterCounter()
    bound = tuple(i - first for i in f.bound)
    own = FrictionElement(f.contact, f.law, f.adams, tuple((name, numbers.take_one()) for name, _ in f.numbers), sliders, bound)
    ends = OVERLAP if e.joint.fit.ends == OVERLAP else "pin"  # the choice of the part with the ends affects operands, not code
    fit = Fit(e.joint.fit.pin_out and bool(e.needs), ends)
    joint = replace(e.joint, name="", fit=fit, inb=0, out=0, inb_point=(), out_point=(), inb_frame=(), out_frame=(), pitch=None,
                    devices=(), friction=own, cut=False, child=0, forward=True, q0=0, v0=0, rows=0, stiffness=None,
                    wheels=None, mimic=None)  # fmt: skip
    return FrictionKey(joint, e.needs)


class ParameterCounter:
    """Assigns consecutive indices to a primitive's parameters."""

    def __init__(self) -> None:
        self.count = 0

    def take_one(self) -> Param:
        """The next parameter."""
        self.count += 1
        return Param(self.count - 1)

    def take(self, n: int) -> Leaves:
        """The next n parameters."""
        return tuple(self.take_one() for _ in range(n))


def sized(contact: str) -> tuple[str, ...]:
    """Labels of all sizes of a contact element that determine how the contacts carry load. Sizes that a scene omits are
    included."""
    return tuple(label for s in CONTACTS[contact].sizes if s.bears for label in s.labels)
