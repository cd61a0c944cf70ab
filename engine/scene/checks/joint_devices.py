"""Checks of devices along the freedoms of joints (springs, dampers, end stops, drives, efforts), and of every function of time."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.scene.data_classes.scene import Drive, Joint, Scene, Signal
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.loads_and_signals import each, entries, signals
from trunnion.scene.signals import limit
from trunnion.scene.signals.registry import DRIVES, LOADS
from trunnion.scene.signals.registry import REGISTRY as SIGNALS

FIELDS = ("spring", "damping", "nonlinear", "rotor_inertia", "end_stops", "drive", "effort", "motor", "latch")
NEED_COORDINATE = {"spring": "a spring", "end_stops": "an end stop", "drive": "a drive", "latch": "a latch"}


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about devices and signals."""
    for name, j in scene.joints.items():
        kind = REGISTRY[j.type]
        if kind.bodiless and not kind.nq:
            continue  # ``bodiless_joints`` checks joints without coordinates
        for field in FIELDS:
            yield from _lengths(("joints", name, field), getattr(j, field), kind)
        yield from _rotations(name, j, kind)
        yield from _spun(name, j, kind)
        for path, stops in entries(j.end_stops, ("joints", name, "end_stops")):
            along_curve = kind.follows == "curve"  # end stops of a curve are at the ends of the curve
            if stops.lower is None and stops.upper is None and not along_curve:
                yield Finding(path, "end stops need lower, upper or both", about=((*path, "lower"), (*path, "upper")))
    for path, s in signals(scene):
        yield from _signal(path, s)


def _lengths(path: Path, value: object, kind: JointKind) -> Iterator[Finding]:
    if value is None:
        return
    given = len(value) if isinstance(value, tuple) else 1
    freedoms = f"{kind.nv} freedoms" if kind.nv != 1 else "one freedom"
    if given != kind.nv:
        hint = f"give a list of {kind.nv} entries; null stands for a freedom without the device" if kind.nv > 1 else ""
        yield Finding(path, f"a {kind.name} joint has {freedoms if kind.nv else 'no freedom'}, not {given}", hint)


def _rotations(name: str, j: Joint, kind: JointKind) -> Iterator[Finding]:
    """A finding for every spring, end stop, drive or latch along a rotation of a quaternion joint. Such a rotation has no
    coordinate of its own."""
    for field, what in NEED_COORDINATE.items():
        for path, _ in entries(getattr(j, field), ("joints", name, field)):
            k = path[-1] if isinstance(path[-1], int) else 0
            if k < kind.nv and kind.coordinate_of(k) < 0:
                hint = "use damping or effort, or build the joint from revolutes" if field != "drive" else "drive revolute joints"
                yield Finding(path, f"{what} cannot act on the rotation of a {kind.name} joint", hint)


def _spun(name: str, j: Joint, kind: JointKind) -> Iterator[Finding]:
    """A finding if the rotor inertias about the three axes of a quaternion joint differ. Neither part carries these axes, so the
    energy of an inertia about one of these axes is undefined."""
    about = each(j.rotor_inertia, kind.nv)[kind.nv - 3 :] if kind.quaternion >= 0 and j.rotor_inertia is not None else []
    if len({v or 0.0 for v in about}) > 1:
        what = f"the three rotations of a {kind.name} joint must have the same rotor inertia"
        yield Finding(("joints", name, "rotor_inertia"), what, "give all three the same, or build the joint from revolutes")


def _signal(path: Path, s: Drive | Signal) -> Iterator[Finding]:
    drive = isinstance(s, Drive)
    known = [*DRIVES, "input"] if drive else [*LOADS]
    kinds, what = [k for k in known if getattr(s, k) is not None], "drive" if drive else "signal"
    if not kinds:
        yield Finding(path, f"an empty {what}", f"give one of: {', '.join(known)}", about=tuple((*path, k) for k in known))
    for extra in kinds[1:]:
        yield Finding((*path, extra), f"a {what} has one kind: {kinds[0]} or {extra}, not both")
    for key in kinds:
        if key in SIGNALS:
            yield from SIGNALS[key].findings((*path, key), getattr(s, key), drive)
    if isinstance(s, Signal) and s.limit is not None and kinds:
        yield from limit.limit_findings((*path, "limit"), s.limit, SIGNALS[kinds[0]], getattr(s, kinds[0]))
