"""Building blocks of the scene classes: vectors, directions, and fields that take one of several forms.

A field may allow a number, a list or a group of keys. The form of the value then selects the type before validation, so that
mistakes are reported for this type only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Annotated, Any, Literal, TypeVar

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.units.numbers_with_units import Length, Number

STRICT: Any = {"extra": "forbid", "defer_build": True}


class Marker:
    """Marks a type with an annotation of pydantic. The package pydantic is imported when a scene is validated."""

    name = ""
    """Name of the annotation's class."""

    def __init__(self, *given: Any, **named: Any):
        self.given, self.named = given, named

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and vars(other) == vars(self)

    def __hash__(self) -> int:
        return hash((self.name, *self.given))

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        import pydantic

        return getattr(pydantic, self.name)(*self.given, **self.named).__get_pydantic_core_schema__(source, handler)


class Tag(Marker):
    """Marks one form of a value by the tag that the discriminator returns."""

    name = "Tag"

    def __init__(self, tag: str):
        super().__init__(tag)
        self.tag = tag


class Discriminator(Marker):
    """Marks a value that may have several forms. A function of the value returns the tag of the value's form."""

    name = "Discriminator"


class Before(Marker):
    """Marks a type with a function that a value passes before validation."""

    name = "BeforeValidator"


class Exactly(Marker):
    """Marks a type whose values are not converted from other types."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return handler(source) | {"strict": True}


@dataclass(frozen=True)
class Says:
    """Marks a field with a text from a registry, which is appended to the field's description in the published schema."""

    text: str


SCALAR, LIST, GROUP = Tag("·scalar"), Tag("·list"), Tag("·group")
"""Tags of the three forms. The dot distinguishes a tag from a scene key in the location of a pydantic error."""


def _form(value: Any) -> str:
    if isinstance(value, list | tuple):
        return LIST.tag
    return GROUP.tag if isinstance(value, dict) or is_dataclass(value) else SCALAR.tag


def either(wanted: str) -> Discriminator:
    """A discriminator for types tagged SCALAR, LIST and GROUP; ``wanted`` completes the error "… is expected, not …"."""
    return Discriminator(_form, custom_error_type="wrong_form", custom_error_message=wanted)


Vector = tuple[Number, Number, Number]
Position = tuple[Length, Length, Length]
AxisName = Literal["x", "y", "z", "-x", "-y", "-z"]
Direction = Annotated[
    Annotated[AxisName, SCALAR] | Annotated[Vector, LIST], either("an axis (x, y, z, -x, -y, -z) or a list of three numbers")
]
"""A direction in a body's frame: the name of an axis, or three numbers, which are normalised later."""

PointOf = Annotated[Annotated[str, SCALAR] | Annotated[Position, LIST], either("the name of a point or a list of three lengths")]
"""A point: its name among the body's points, or its position in the body's frame."""

T = TypeVar("T", bound=type)
Field = tuple[str, Any, float | None, str]
"""A field to generate: key, type, default, description."""


def with_fields(declared: list[Field]) -> Callable[[T], T]:
    """A class decorator, applied before ``dataclass``, that inserts the declared fields before the class's own fields. The
    decorator stores the descriptions of these fields in ``__field_docs__``."""

    def put(cls: T) -> T:
        cls.__annotations__ = {name: kind for name, kind, _, _ in declared} | cls.__annotations__
        for name, _, default, _ in declared:
            setattr(cls, name, default)
        setattr(cls, "__field_docs__", {name: doc for name, _, _, doc in declared})  # noqa: B010
        return cls

    return put
