"""The scene's classes as a tree of types: lookup of the class, unit or choice at a path.

Hints ("known keys: …"), units of parameters and the published schema use this tree; pydantic does the validation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, Field, fields
from functools import cache, lru_cache
from types import NoneType, UnionType
from typing import Annotated, Any, ForwardRef, Union, get_args, get_origin, get_type_hints

from trunnion.basics.number_declarations import ANY, Bound
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.units.numbers_with_units import AnyUnit

NAMED = (("bodies",), ("joints",), ("forces",), ("inputs",), ("parameters",), ("assemblies",))
"""Groups of a scene whose keys are names that users choose."""


@cache
def hints(cls: type) -> dict[str, Any]:
    """The annotations of a scene class by field name, with unions and unit markers. If pydantic has evaluated the annotations, they
    come from pydantic, because a second evaluation takes ten times as long. A stored scene needs no pydantic."""
    known = {n: (f.annotation, *f.metadata) for n, f in vars(cls).get("__pydantic_fields__", {}).items()}
    if not known or any(isinstance(a, ForwardRef) for a, *_ in known.values()):
        return get_type_hints(cls, include_extras=True)
    return {n: Annotated[a, *marks] if marks else a for n, (a, *marks) in known.items()}


def members(annotation: Any, unit: AnyUnit | None = None) -> Iterator[tuple[Any, AnyUnit | None]]:
    """The alternatives of an annotation without None, each with the unit marker that applies to it."""
    if get_origin(annotation) is Annotated:
        inner, *extras = get_args(annotation)
        marks = [e for e in extras if isinstance(e, AnyUnit)]
        yield from members(inner, marks[0] if marks else unit)
    elif get_origin(annotation) in (Union, UnionType):
        for a in get_args(annotation):
            yield from members(a, unit)
    elif annotation is not NoneType:
        yield annotation, unit


def step(annotation: Any, key: str | int) -> Iterator[Any]:
    """The annotations of the values at a key or index, from every alternative that has this key or index."""
    for a, _ in members(annotation):
        if isinstance(key, str) and is_scene_class(a):
            if key in hints(a):
                yield hints(a)[key]
        elif isinstance(key, str) and get_origin(a) is dict:
            yield get_args(a)[1]
        elif isinstance(key, int) and get_origin(a) is tuple:
            args = get_args(a)
            if args[-1] is Ellipsis or 0 <= key < len(args):
                yield args[0] if args[-1] is Ellipsis else args[key]


@lru_cache(maxsize=4096)  # users choose the names in paths, so the cache is bounded
def at(path: Path) -> tuple[Any, ...]:
    """Annotations at a path; empty when no scene has such a path."""
    found: list[Any] = [Scene]
    for key in path:
        found = [b for a in found for b in step(a, key)]
    return tuple(found)


def shape(path: Path) -> Path:
    """The path with user-chosen names replaced by "*" and indices limited to 2, so that ``at`` caches few different paths."""
    named = path[:1] in NAMED and len(path) > 1
    return tuple("*" if named and i == 1 else min(k, 2) if isinstance(k, int) else k for i, k in enumerate(path))


def is_scene_class(a: Any) -> bool:
    """Whether ``a`` is a data class. Unlike ``is_dataclass``, this function does not cause the class to be made
    (``basics.lazy_data_classes``)."""
    return isinstance(a, type) and "__dataclass_fields__" in vars(a)


def classes_at(path: Path) -> list[type]:
    """Scene classes that are allowed at a path."""
    return [a for annotation in at(path) for a, _ in members(annotation) if is_scene_class(a)]


def fields_by_key(cls: type) -> dict[str, Field[Any]]:
    """The fields of a scene class, by the keys that scenes use for them."""
    return {getattr(cls, "__key_names__", {}).get(f.name, f.name): f for f in fields(cls)}


def required_fields(cls: type) -> list[str]:
    """Names of the fields of a scene class that have no default."""
    return [f.name for f in fields(cls) if f.default is MISSING and f.default_factory is MISSING]


def keys_at(path: Path) -> list[str]:
    """Allowed keys of the group at a path, in order and without repetition; empty for groups whose names the user chooses."""
    return _keys_of(tuple(classes_at(path)))


@lru_cache(maxsize=256)
def _keys_of(classes: tuple[type, ...]) -> list[str]:
    return list(dict.fromkeys(key for c in classes for key in fields_by_key(c)))


def required_at(path: Path) -> list[str]:
    """Required keys of the group at a path."""
    return [name for c in classes_at(path) for name in required_fields(c)]


@lru_cache(maxsize=4096)  # cached, because the checks need the unit of every number
def unit_at(path: Path) -> AnyUnit | None:
    """The unit marker of the number at a path; None when there is no number at the path."""
    return next((u for annotation in at(path) for a, u in members(annotation) if a is float and u is not None), None)


def bound_at(path: Path) -> Bound:
    """The allowed values of the number at a path."""
    mark = unit_at(path)
    return mark.bound if mark is not None else ANY


def length_at(path: Path) -> int | None:
    """Number of entries of the list at a path; None when the list may have any number of entries, or there is no list."""
    for annotation in at(path):
        for a, _ in members(annotation):
            if get_origin(a) is tuple and get_args(a)[-1] is not Ellipsis:
                return len(get_args(a))
    return None
