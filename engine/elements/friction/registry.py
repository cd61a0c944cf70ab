"""All friction laws, and queries by law name. A new law needs a new file and a line in LAWS."""

from __future__ import annotations

from collections.abc import Iterable

from trunnion.basics.number_declarations import Number, merged
from trunnion.basics.objects_by_import_path import objects
from trunnion.elements.friction.friction_law import Law


def registered(laws: Iterable[type[Law]]) -> dict[str, type[Law]]:
    """The laws by name. Raises ValueError if two laws have the same name, if a number has two meanings, or if a law refers to an
    unknown law."""
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
                raise ValueError(f"law {law.name}: {role} = {other!r} is not the name of a set-valued law")
    return out


LAWS = (
    "coulomb.Coulomb",
    "lugre.LuGre",
    "regularized_coulomb.Regularized",
    "stribeck.Stribeck",
    "viscous.Viscous",
)
REGISTRY: dict[str, type[Law]] = registered(objects(__package__, LAWS))
DEFAULT = next(iter(REGISTRY))
"""The default law of a scene. It is the most accurate and the least stiff law."""


def numbers() -> dict[str, tuple[Number, tuple[str, ...]]]:
    """All numbers by name, each with the names of the laws that have this number."""
    return merged({name: law.numbers for name, law in REGISTRY.items()})


def exact_of(law: str) -> str:
    """The reference law for errors: the set-valued law that ``law`` smooths, or ``law`` itself if it smooths no law."""
    return REGISTRY[law].exact or law


def twin_of(law: str) -> str:
    """Name of the law that smooths ``law``; "" if no law does."""
    return next((name for name, other in REGISTRY.items() if other.exact == law), "")
