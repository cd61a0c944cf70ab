"""All laws of nonlinear springs and dampers. A new law needs a new file and a line in LAWS, which is in the order of the keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trunnion.basics.objects_by_import_path import objects
from trunnion.scene.force_laws.declaration import ForceLaw

LAWS = (
    "spring_curve.SpringCurveLaw",
    "quadratic_damping.QuadraticDampingLaw",
    "damping_curve.DampingCurveLaw",
    "attraction.AttractionLaw",
)
REGISTRY: dict[str, ForceLaw] = {law.key: law() for law in objects(__package__, LAWS)}


def given(group: Any) -> Iterator[tuple[ForceLaw, Any]]:
    """The laws that a group of keys gives, each with its value."""
    yield from ((law, value) for key, law in REGISTRY.items() if (value := getattr(group, key, None)) is not None)
