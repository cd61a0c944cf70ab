"""``data_class``: the decorator ``dataclass`` of the standard library, with closures in place of compiled methods.

The standard library compiles the text of six methods for each class. Here only the text of ``__init__`` is compiled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError
from operator import attrgetter
from reprlib import recursive_repr
from typing import Any


def data_class(cls: type, *, frozen: bool = False, eq: bool = True, kw_only: bool = False) -> type:
    """The class with fields and methods, as ``dataclasses.dataclass`` makes it. All fields are arguments of ``__init__``."""
    made: type = dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
    fields: tuple[Field[Any], ...] = dataclasses.fields(made)
    methods: dict[str, Any] = {"__init__": _constructor(made, fields, frozen)}
    methods["__repr__"] = _text([f.name for f in fields if f.repr])
    if eq:
        values = _values([f.name for f in fields if f.compare])
        methods["__eq__"] = lambda a, b: values(a) == values(b) if a.__class__ is b.__class__ else NotImplemented
        methods["__hash__"] = (lambda a: hash(values(a))) if frozen else None
    if frozen:
        methods |= _refusals(made, {f.name for f in fields})
    for name, method in methods.items():
        if vars(made).get(name) is None:  # Python sets __hash__ to None in a class with an own __eq__
            setattr(made, name, method)
    return made


def _constructor(cls: type, fields: tuple[Field[Any], ...], frozen: bool) -> Callable[..., None]:
    """``__init__``. Fields of a frozen class are set by ``object.__setattr__``."""
    known: dict[str, Any] = {"_put": object.__setattr__, "_MISSING": MISSING}
    words, lines, star = ["self"], [], ["*"]
    for f in sorted(fields, key=lambda f: bool(f.kw_only)):
        default, value = "", f.name
        if f.default is not MISSING:
            known[f"_default_{f.name}"], default = f.default, f"=_default_{f.name}"
        elif f.default_factory is not MISSING:
            known[f"_make_{f.name}"], default = f.default_factory, "=_MISSING"
            value = f"_make_{f.name}() if {f.name} is _MISSING else {f.name}"
        if f.kw_only:
            words, star = words + star, []
        words.append(f.name + default)
        lines.append(f"_put(self, {f.name!r}, {value})" if frozen else f"self.{f.name} = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    exec(f"def __init__({', '.join(words)}):\n " + "\n ".join(lines or ["pass"]), known)
    made: Callable[..., None] = known["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = {f.name: f.type for f in fields} | {"return": None}
    return made


def _values(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """The values of fields, as a tuple."""
    return attrgetter(*names) if len(names) > 1 else lambda a: tuple(getattr(a, n) for n in names)


def _text(names: list[str]) -> Callable[[Any], str]:
    """``__repr__``."""
    return recursive_repr()(lambda a: f"{type(a).__qualname__}({', '.join(f'{n}={getattr(a, n)!r}' for n in names)})")


def _refusals(cls: type, names: set[str]) -> dict[str, Callable[..., None]]:
    """``__setattr__`` and ``__delattr__`` of a frozen class."""

    def put(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        object.__setattr__(self, name, value)

    def remove(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        object.__delattr__(self, name)

    return {"__setattr__": put, "__delattr__": remove}
