"""Checks of start values: their number must match the joint's coordinates and rates, and a quaternion must not be zero."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.scene.data_classes.scene import AxisAngle, Coordinates, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about start values."""
    for name, j in scene.joints.items():
        if j.start is None or REGISTRY[j.type].bodiless:
            continue
        kind, path = REGISTRY[j.type], ("joints", name, "start")
        if j.start.q is not None:
            yield from _coordinates((*path, "q"), j.start.q, kind)
        if j.start.qd is not None:
            given = len(j.start.qd) if isinstance(j.start.qd, tuple) else 1
            if given != kind.nv or (kind.nv != 1 and not isinstance(j.start.qd, tuple)):
                yield Finding((*path, "qd"), f"a {kind.name} joint has {_count(kind.nv, 'rate')}, not {given}")


def _coordinates(path: Path, q: Coordinates, kind: JointKind) -> Iterator[Finding]:
    if isinstance(q, AxisAngle):
        if kind.quaternion < 0:
            balls = sorted((k for k in REGISTRY.values() if k.quaternion >= 0), key=lambda k: k.nv)
            able = " and ".join(k.name for k in balls)
            yield Finding(path, f"axis and angle are for {able} joints, not for a {kind.name} joint", "give its coordinates")
        return
    values = q if isinstance(q, tuple) else (q,)
    if len(values) != kind.nq:
        hint = "q: {axis: y, angle: 30 deg}, or four numbers [w, x, y, z]" if kind.quaternion == 0 else ""
        yield Finding(path, f"a {kind.name} joint has {_count(kind.nq, 'coordinate')}, not {len(values)}", hint)
    elif kind.quaternion >= 0 and not any(values[kind.quaternion :]):
        yield Finding(path, "a quaternion of four zeros is not a rotation", "the identity is [1, 0, 0, 0]")


def _count(n: int, word: str) -> str:
    return f"no {word}" if n == 0 else f"{n} {word}" + ("s" if n > 1 else "")
