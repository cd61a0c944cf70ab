"""The friction laws there are, and what the rest of the product asks about them by name."""

from __future__ import annotations

from collections.abc import Iterable

from engine.basics.numbers import Number, merged
from engine.friction.base import Law
from engine.friction.coulomb import Coulomb
from engine.friction.lugre import LuGre
from engine.friction.regularized import Regularized
from engine.friction.stribeck import Stribeck
from engine.friction.viscous import Viscous


def registered(laws: Iterable[type[Law]]) -> dict[str, type[Law]]:
    """The laws by name. ValueError when two have one name, mean different things by one number, or refer to a law that does not
    exist."""
    out: dict[str, type[Law]] = {}
    for law in laws:
        if law.name in out:
            raise ValueError(f"two laws are called {law.name}")
        out[law.name] = law
    merged({name: law.numbers for name, law in out.items()})
    for law in out.values():
        for role in ("exact", "dry"):
            other = getattr(law, role)
            if other and not (other in out and out[other].sets):
                raise ValueError(f"law {law.name}: {role} = {other!r} is no set-valued law there is")
    return out


REGISTRY = registered((Coulomb, LuGre, Regularized, Stribeck, Viscous))
DEFAULT = Coulomb.name
"""The law of a scene that names none: the most accurate and the least stiff."""


def numbers() -> dict[str, tuple[Number, tuple[str, ...]]]:
    """Every number a law has, by name, each with the laws that have it."""
    return merged({name: law.numbers for name, law in REGISTRY.items()})


def exact_of(law: str) -> str:
    """The law against which this one's errors are measured: itself, or the set-valued law it smooths."""
    return REGISTRY[law].exact or law


def twin_of(law: str) -> str:
    """The law that smooths this one; "" when there is none."""
    return next((name for name, other in REGISTRY.items() if other.exact == law), "")


def table() -> str:
    """The laws as a table in Markdown: what ``NOTATION.md`` shows of them."""
    lines = ["| law | k while sliding | at rest | numbers |", "|---|---|---|---|"]
    for name, law in REGISTRY.items():
        called = f"`{name}`" + (" (default)" if name == DEFAULT else "")
        formula, at_rest = (text.replace("|", "\\|") for text in (law.formula, law.at_rest))
        lines.append(f"| {called} | {formula} | {at_rest} | {', '.join(map(_described, law.numbers))} |")
    return "\n".join(lines)


def _described(n: Number) -> str:
    """A number of a law as the table shows it: its letter and unit, and when it is needed."""
    letter = n.symbol if n.symbol != n.name else ""
    unit = "" if n.unit == "1" else n.unit
    default = f"default {n.default:g}" if n.default is not None else ""
    about = ", ".join(x for x in (letter, unit, default, n.needed_with and f"with `{n.needed_with}`") if x)
    optional = "optional " if not n.needed and not n.needed_with else ""
    return f"{optional}`{n.name}`" + (f" ({about})" if about else "")
