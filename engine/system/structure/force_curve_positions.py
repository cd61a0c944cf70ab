"""Positions in curves and fields that steps with error control must resolve (theory, "Error control"). The kernel's function
``events`` returns these positions after the values of the stops. Their order: joints' freedoms, lines between two points, points in
fields."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.scene.force_laws.registry import REGISTRY as FORCE_LAWS
from trunnion.system.structure.bodies_and_joints import Joint, LawForce, Load, System


def freedoms_with_curves(system: System) -> Iterator[tuple[Joint, int, LawForce]]:
    """(joint, freedom, law) of each law with pieces along a freedom of a joint."""
    for j in system.joints:
        for k, d in enumerate(j.devices):
            yield from ((j, k, law) for law in d.nonlinear or () if FORCE_LAWS[law.law].pieces)


def lines_with_curves(system: System) -> Iterator[tuple[Load, LawForce]]:
    """(load, law) of each law with pieces along the line between two points."""
    for load in system.loads:
        yield from ((load, law) for law in load.nonlinear if FORCE_LAWS[law.law].pieces)


def fields_with_width(system: System) -> Iterator[Load]:
    """The fields that declare the width of their narrowest part, ``numbers[0]``."""
    yield from (load for load in system.loads if load.kind == "field" and load.numbers)


def curve_positions(system: System) -> int:
    """Number of positions in curves and fields: one for each law, three for each field."""
    laws = sum(1 for _ in freedoms_with_curves(system)) + sum(1 for _ in lines_with_curves(system))
    return laws + 3 * sum(1 for _ in fields_with_width(system))
