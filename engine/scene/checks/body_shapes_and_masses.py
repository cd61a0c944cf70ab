"""Checks of bodies: at most one shape, no contradictory mass properties, and a physically possible inertia."""

from __future__ import annotations

import math
from collections.abc import Iterator

from trunnion.scene.data_classes.bodies import AxialInertia
from trunnion.scene.data_classes.scene import Body, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.body_poses_and_joint_sides import vector
from trunnion.scene.queries.mass_properties import matrix, principal_moments, volume_and_moments
from trunnion.scene.queries.packed_surfaces import unpacked

SHAPES = ("box", "cylinder", "sphere")
SLACK = 1e-9
"""Relative violation of the inertia conditions that is accepted as rounding of the input."""


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about bodies."""
    if not scene.bodies:
        yield Finding(("bodies",), "the scene has no bodies", "add one: bodies: {block: {box: [1, 0.1, 0.1], density: 7800}}")
    for name, b in scene.bodies.items():
        path: Path = ("bodies", name)
        yield from _shape(path, b)
        yield from _amounts(path, b)
        yield from _inertia(path, b)
        yield from _surface(path, b)


def _surface(path: Path, b: Body) -> Iterator[Finding]:
    if b.surface is None:
        return
    try:
        unpacked(b.surface)
    except ValueError as e:
        yield Finding((*path, "surface"), f"invalid packed surface: {e}", "use the text that trunnion import wrote, or remove it")


def _shape(path: Path, b: Body) -> Iterator[Finding]:
    given = [s for s in SHAPES if getattr(b, s) is not None]
    for extra in given[1:]:
        yield Finding((*path, extra), f"two shapes: {given[0]} and {extra}", "keep one of them")
    if len(given) != 1 or b.inertia is not None:
        return
    volume, gyration = volume_and_moments(b)
    mass = b.mass if b.mass is not None else (b.density or 0.0) * volume
    if not all(math.isfinite(mass * k) for k in gyration):
        yield Finding((*path, given[0]), "a body of this size has no finite inertia", "check the unit of the size")


def _amounts(path: Path, b: Body) -> Iterator[Finding]:
    """A body with a shape needs density or mass. A body without a shape needs mass and inertia. An explicit inertia requires a
    mass."""
    shaped = any(getattr(b, s) is not None for s in SHAPES)
    keys = tuple((*path, k) for k in (*SHAPES, "density", "mass", "inertia"))
    if b.density is not None and (b.mass is not None or b.inertia is not None):
        other = "mass" if b.mass is not None else "inertia"
        yield Finding((*path, "density"), f"both density and {other} are given", f"remove density or {other}")
        if b.mass is not None:
            return
    if b.density is not None and not shaped:
        hint = "add box, cylinder or sphere; or give mass and inertia"
        yield Finding((*path, "density"), "a density without a shape gives no mass", hint, about=keys)
    elif b.density is None and b.mass is None:
        hint = "give density or mass" if shaped else "give a shape with density, or mass and inertia"
        yield Finding(path, "the body has no mass", hint, about=keys)
    elif not shaped and b.inertia is None:
        hint = "inertia: [0, 0, 0] makes it a point mass"
        yield Finding(path, "a mass without a shape gives no inertia", hint, about=keys)
    elif b.mass == 0.0 and b.inertia is None:
        yield Finding((*path, "mass"), "a shape of mass 0 gives no inertia", "add an inertia, such as [0, 0, 0]", about=keys)


def _inertia(path: Path, b: Body) -> Iterator[Finding]:
    if b.inertia is None:
        return
    at = (*path, "inertia")
    if isinstance(b.inertia, AxialInertia):
        if not any(vector(b.inertia.axis)):
            yield Finding((*at, "axis"), "an axis of length zero", "such as x, or [0, 1, 1]")
        return
    if len(b.inertia) not in (3, 6):
        yield Finding(at, f"{len(b.inertia)} entries in an inertia of 3 or 6", "[xx, yy, zz] or [xx, yy, zz, xy, xz, yz]")
        return
    low, mid, high = principal_moments(matrix(b.inertia))
    text = f"principal moments {low:g}, {mid:g}, {high:g}"
    if low < -SLACK * max(abs(high), abs(low)):
        yield Finding(at, f"no body has this inertia: {text}, of which one is negative", "check the signs of the products")
    elif low + mid < high * (1 - SLACK):
        yield Finding(
            at,
            f"no body has this inertia: {text}, of which the largest exceeds the sum of the others",
            "the largest moment of any body is at most the sum of the two others; give moments about the mass centre",
        )
