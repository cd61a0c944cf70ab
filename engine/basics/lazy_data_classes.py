"""Decorators like ``dataclass`` of the standard library and of pydantic, which make a class at its first use. The original
decorators compile six methods of each class. The compilation would take a third of a command's start, although most classes have no
instance in a run. With this module, the original decorator makes the class at the first call of one of the six methods, or when the
fields are read. Unpickling calls none of the methods. A stored scene therefore needs neither validation nor pydantic. The standard
library makes the methods that compare and print values later, because three of four classes of a run never need them. Classes with
an own ``__init__``, ``__eq__``, ``__setattr__``, slots or an order are made at once."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable
from functools import wraps
from inspect import isfunction
from typing import TYPE_CHECKING, Any

LOCK = threading.RLock()
"""Held by the thread that makes a class or builds its validator. Pydantic fails if two threads do this at once."""
INIT = "__init__"
OF_VALUES = ("__repr__", "__eq__", "__hash__")
"""Methods that most classes of a run never need. They are made together, when one of them is called first."""
METHODS = (INIT, *OF_VALUES, "__setattr__", "__delattr__")
"""Methods that make the class when they are called, then call the class's method of the same name."""
FACTS = ("__dataclass_fields__", "__dataclass_params__", "__match_args__")
"""Attributes that make the class when they are read."""
OF_EACH = ("__dict__", "__weakref__", "_abc_impl")
"""Attributes that Python gives to each class."""
AT_ONCE = {"__init__", "__eq__", "__setattr__", "__slots__"}
OPTIONS_AT_ONCE = {"slots", "order", "unsafe_hash"}


class _Fact:
    """Stands for an attribute of a class until the class is made."""

    def __init__(self, owner: type, options: dict[str, Any], name: str):
        self.owner, self.options, self.name = owner, options, name

    def __get__(self, instance: Any, cls: type) -> Any:
        _make(self.owner, self.options)
        return getattr(cls, self.name)


def _method(owner: type, options: dict[str, Any], name: str) -> Any:
    """Stands for a method of a class until the class is made."""

    def first(self: Any, *given: Any, **named: Any) -> Any:
        with LOCK:
            _make(owner, options)
            if name in OF_VALUES:
                _make_methods_of_values(owner, options)
            made = getattr(owner, name)
            if made is None:
                raise TypeError(f"unhashable type: {owner.__name__!r}")
            return made(self, *given, **named)

    setattr(first, _MARK, True)
    return first


_MARK = "_until_made"


def _make(owner: type, options: dict[str, Any]) -> None:
    """Let the original decorator make the class, once."""
    with LOCK:
        if not isinstance(vars(owner).get(FACTS[0]), _Fact):
            return
        standing = [n for n, value in vars(owner).items() if isinstance(value, _Fact) or hasattr(value, _MARK)]
        if "config" not in options:
            _make_copy_first(owner, options, standing)
            return
        for name in standing:
            if name != INIT:  # pydantic replaces ``__init__``; until then, other threads wait in it
                delattr(owner, name)
        _decorated(owner, options)
        setattr(owner, INIT, _locked(vars(owner)[INIT]))


def _locked(made: Callable[..., None]) -> Callable[..., None]:
    """An ``__init__`` by pydantic, whose first call builds the validator."""

    def init(self: Any, *given: Any, **named: Any) -> None:
        with LOCK:
            made(self, *given, **named)

    return wraps(made)(init)


def _make_copy_first(owner: type, options: dict[str, Any], standing: list[str]) -> None:
    """Let the standard library make a copy of the class without ``OF_VALUES``. Then give the copy's attributes to the class, one by
    one. The class has all methods at any moment, so that other threads can use the class during the change. standing: names of the
    attributes that are ``_Fact`` objects or come from ``_method``."""
    own = {n: value for n, value in vars(owner).items() if n not in (*standing, *OF_EACH)}
    made = _made_copy(owner, own, options | {"repr": False, "eq": False})
    _without_values[owner] = own
    changed = [n for n, value in vars(made).items() if own.get(n, own) is not value]
    gone = [n for n in (*own, *standing) if n not in vars(made)]
    _take(owner, made, [n for n in (*changed, *gone) if n not in (*OF_VALUES, *OF_EACH)])


def _make_methods_of_values(owner: type, options: dict[str, Any]) -> None:
    """Let the standard library make the methods in ``OF_VALUES``. ``_make_copy_first`` has made the class without them."""
    if own := _without_values.pop(owner, None):
        standing = [n for n in OF_VALUES if hasattr(vars(owner)[n], _MARK)]
        _take(owner, _made_copy(owner, own, options | {"init": False}), standing)


_without_values: dict[type, dict[str, Any]] = {}
"""{class that is made without ``OF_VALUES``: the attributes that its author wrote}."""


def _made_copy(owner: type, own: dict[str, Any], options: dict[str, Any]) -> type:
    """A class that the standard library makes from the attributes ``own``. Its methods refer to ``owner`` in place of the copy."""
    made: type = _decorated(type(owner)(owner.__name__, owner.__bases__, dict(own)), options)
    for method in filter(isfunction, vars(made).values()):
        for cell in method.__closure__ or ():
            if cell.cell_contents is made:
                cell.cell_contents = owner
    return made


def _take(owner: type, made: type, names: list[str]) -> None:
    """Give the copy's attributes with these names to the class. Remove the attributes that the copy lacks."""
    for name in names:
        if name in vars(made):
            setattr(owner, name, vars(made)[name])
        else:
            delattr(owner, name)


def _decorated(cls: type, options: dict[str, Any]) -> Any:
    if "config" not in options:
        return dataclasses.dataclass(**options)(cls)
    from pydantic.dataclasses import dataclass as by_pydantic

    return by_pydantic(**options)(cls)


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass

    from pydantic.dataclasses import dataclass as validated
else:

    def dataclass(cls: type | None = None, **options: Any) -> Any:
        """The decorator of the standard library, or with ``config`` the decorator of pydantic, applied at the first use of the
        class."""
        if cls is None:
            return lambda cls: dataclass(cls, **options)
        if AT_ONCE & vars(cls).keys() or OPTIONS_AT_ONCE & options.keys():
            return _decorated(cls, options)
        for name in METHODS:
            if name not in vars(cls):
                setattr(cls, name, _method(cls, options, name))
        for name in FACTS:
            setattr(cls, name, _Fact(cls, options, name))
        return cls

    validated = dataclass
