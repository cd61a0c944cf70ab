"""A note of ``trunnion check``: a sliding joint moves beyond the ends of the part that carries its contacts."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Drive, Scene
from trunnion.scene.queries.body_references import body_of
from trunnion.scene.signals.registry import given


def contact_travel_notes(scene: Scene) -> list[str]:
    """Notes on sliding joints that move beyond the contacts at the ends of their inboard part. Perhaps the contacts of such a joint
    belong at the ends of its outboard part."""
    notes = []
    for name, j in scene.joints.items():
        rub = j.friction
        if REGISTRY[j.type].slides_along < 0 or (j.ends or j.pin) != "inboard" or rub is None or rub.half_length is None:
            continue
        start = j.start.q if j.start is not None else None
        stops = j.end_stops[0] if isinstance(j.end_stops, tuple) else j.end_stops
        drive = j.drive[0] if isinstance(j.drive, tuple) else j.drive
        coordinates = [start[0] if isinstance(start, tuple) else start, *((stops.lower, stops.upper) if stops else ())]
        coordinates += driven_to(drive, float(scene.simulation.until)) if drive else []
        travel = max((abs(float(p)) for p in coordinates if isinstance(p, int | float)), default=0.0)
        half = float(rub.half_length[0] if isinstance(rub.half_length, tuple) else rub.half_length)
        if travel > 2 * half:
            ends = f"within {half:g} m of the joint's point on {body_of(j.inboard)}"
            advice = "for a short sleeve on a long shaft write ends: outboard"
            notes.append(f"{name}: its contacts stay {ends}, but the joint travels {travel:g} m; {advice}")
    return notes


def driven_to(drive: Drive, until: float) -> Sequence[float]:
    """The least and the largest coordinate of a drive's motion up to a time, s."""
    if drive.input is not None:
        return []
    kind, data = given(drive)
    return kind.travel(data, until)
