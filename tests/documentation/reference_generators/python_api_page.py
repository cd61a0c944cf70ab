"""``reference/python_api.md``: the public names of ``trunnion`` with their signatures and docstrings."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

HEAD = """# Python API

Import all names on this page from `trunnion`. Each name loads its module when it is first used.
Numbers are SI unless a unit is given (`"10 ms"`). Times are s, lengths m, angles rad.
"""


def page_text() -> str:
    """The page as Markdown."""
    import trunnion

    return HEAD + "".join(f"\n{section(name, getattr(trunnion, name))}" for name in sorted(trunnion.__all__, key=str.lower))


def section(name: str, found: Any) -> str:
    """One public name."""
    if inspect.isclass(found):
        return f"## `{name}`\n\n{text_of(found)}\n" + "".join(members(found))
    return f"## `{name}`\n\n{signature(name, found)}\n{text_of(found)}\n"


def members(kind: type) -> Iterator[str]:
    """The public methods and properties of a class and of the classes it extends."""
    own = [c for c in reversed(kind.__mro__) if c.__module__.startswith("trunnion")]
    for name, found in {n: f for c in own for n, f in vars(c).items()}.items():
        if name.startswith("_") or not inspect.getdoc(found):
            continue
        if isinstance(found, property):
            yield f"\n**`.{name}`** – {text_of(found)}\n"
        elif inspect.isfunction(found):
            yield f"\n**`.{name}{parameters(found)}`** – {text_of(found)}\n"


def signature(name: str, function: Callable[..., Any]) -> str:
    """A function's signature as a block of code, with one parameter in each line if it is long."""
    line = f"{name}{parameters(function)}"
    if len(line) > 100:
        inside = [plain(str(p)) for p in inspect.signature(function).parameters.values()]
        line = f"{name}(\n    " + ",\n    ".join(inside) + ",\n)"
    return f"```text\n{line}\n```\n"


def parameters(function: Callable[..., Any]) -> str:
    """The parameters of a function without ``self``."""
    given = inspect.signature(function)
    kept = [p for p in given.parameters.values() if p.name != "self"]
    return plain(str(given.replace(parameters=kept)))


def plain(text: str) -> str:
    """A signature without the quotes around its annotations."""
    return re.sub(r"(: |-> )'([^']*)'", r"\1\2", text)


def text_of(found: Any) -> str:
    """A docstring as Markdown; "" for the signature that ``dataclass`` writes in place of a docstring."""
    text = inspect.getdoc(found) or ""
    if dataclasses.is_dataclass(found) and text.startswith(f"{getattr(found, '__name__', '')}("):
        return ""
    return text.replace("``", "`")
