"""Fields of the scene's classes that are generated from the declarations of friction laws and contact elements."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import POSITIVE, Number
from trunnion.elements.contact import GIVEN, element_of, sizes
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction import numbers as law_numbers
from trunnion.elements.joints import REGISTRY as JOINTS
from trunnion.scene.data_classes.field_types import GROUP, LIST, SCALAR, STRICT, Field, Tag, either
from trunnion.scene.data_classes.signals import VARYING_FORMS, ByLoad, BySpeed, FromInput, Signal, load_or
from trunnion.scene.units.dimension_names import QUANTITIES
from trunnion.scene.units.numbers_with_units import Per

if TYPE_CHECKING:
    LawName = str
else:
    LawName = Literal[tuple(LAWS)]



@validated(frozen=True, config=STRICT)
class Wear:
    """Rate of wear by Archard's law: volume = k · normal force · sliding distance."""

    k: Annotated[float, Per("m^2/N", POSITIVE)]
    """Wear coefficient: volume per normal force and sliding distance, such as 1e-6 mm^3/(N*m)."""


def annotation(number: Number, count: int) -> Any:
    """The type of a number's field: a number in SI or text with a unit. If ``count`` > 1, a list of ``count`` numbers is allowed
    too. Raises ValueError when the number's unit is unknown in scenes."""
    if number.unit not in QUANTITIES:
        raise ValueError(f"number {number.name}: there is no unit {number.unit!r} in scenes; there are {', '.join(QUANTITIES)}")
    one: Any = Annotated[float, Per(number.unit, number.bound)]
    name = QUANTITIES[number.unit][0]
    if number.by_load:
        wanted = f"{name}, or a group of torque (or speed) and value"
        return Annotated[Annotated[one, SCALAR] | Annotated[ByLoad, GROUP], either(wanted)]
    if number.varies:
        forms: Any = Annotated[one, SCALAR] | Annotated[FromInput, Tag("·input")] | Annotated[Signal, Tag("·signal")]
        words = f"{name}, {VARYING_FORMS}"
        if number.by_speed:
            forms, words = forms | Annotated[BySpeed, Tag("·speed")], f"{words}, or speed and value"
        if count > 1:
            several: Any = tuple.__class_getitem__((Annotated[forms, load_or(words)],) * count)
            forms, words = forms | Annotated[several, LIST], f"{words} (some joints: or a list of {count})"
        return Annotated[forms, load_or(words)]
    if count == 1:
        return one
    several = tuple.__class_getitem__((one,) * count)
    wanted = f"{name} (some joints: or a list of {count})"
    return Annotated[Annotated[one, SCALAR] | Annotated[several, LIST], either(wanted)]


def of_joints() -> list[Field]:
    """The fields of a joint's ``friction``: numbers of laws, then sizes of contact elements. All fields are optional."""
    out: list[Field] = []
    for name, (n, laws) in law_numbers().items():
        own = "; default: the scene's" if n.default is not None else ""
        out.append((name, annotation(n, 1) | None, None, f"{sentence(n.text)} ({plural('law', laws)}){own}."))
    both = [
        (j.name, e)
        for j in JOINTS.values()
        for e in (j.friction, element_of("", j.freely_rubbed, GIVEN), j.loaded, j.banded)
    ]
    for name, (n, elements) in sizes().items():
        each = {joint: next(s for s in sized(e) if s.name == name) for joint, e in both if e in elements}
        who = ", ".join(f"{j}: one or a list of {s.count}" if s.count > 1 else j for j, s in each.items())
        count = max((s.count for s in each.values()), default=1)
        out.append((name, annotation(n, count) | None, None, f"{sentence(n.text)} ({who})."))
    return out


def of_scene() -> list[Field]:
    """The fields of the scene's ``friction``: default values for joints without a value of their own."""
    return [
        (name, annotation(n, 1), n.default, f"{sentence(n.text)} ({plural('law', laws)}).")
        for name, (n, laws) in law_numbers().items()
        if n.default is not None
    ]


def sized(element: str) -> tuple[Number, ...]:
    """The sizes that a contact element declares."""
    from trunnion.elements.contact import REGISTRY

    return REGISTRY[element].sizes


def plural(word: str, names: Iterable[str]) -> str:
    """The word (in the plural for several names) and the names: ``law a`` or ``laws a, b``."""
    listed = [f"``{n}``" for n in names]
    return f"{word}{'s' if len(listed) > 1 else ''} {', '.join(listed)}"


def sentence(text: str) -> str:
    """The text with a capital first letter, unless it begins with a symbol and a colon."""
    return text if text[1:2] == ":" else text[0].upper() + text[1:]
