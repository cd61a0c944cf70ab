"""Whether a sliding joint leaves the ends behind that its contacts sit at: a note of ``trunnion check``."""

from __future__ import annotations

import numpy as np

from engine.joints import REGISTRY
from engine.scene.model import Drive, Scene
from engine.scene.refs import body_of


def left_behind(scene: Scene) -> list[str]:
    """Sliding joints whose motion leaves ends that sit on the inboard part: perhaps those of the other are meant."""
    out = []
    for name, j in scene.joints.items():
        rub = j.friction
        if REGISTRY[j.type].slides_along < 0 or (j.ends or j.pin) != "inboard" or rub is None or rub.half_length is None:
            continue
        start = j.start.q if j.start is not None else None
        stops = j.stops[0] if isinstance(j.stops, tuple) else j.stops
        drive = j.drive[0] if isinstance(j.drive, tuple) else j.drive
        places = [start[0] if isinstance(start, tuple) else start, *((stops.lower, stops.upper) if stops else ())]
        places += driven_to(drive, float(scene.simulation.until)) if drive else []
        far = max((abs(float(p)) for p in places if isinstance(p, int | float)), default=0.0)
        half = float(rub.half_length[0] if isinstance(rub.half_length, tuple) else rub.half_length)
        if far > 2 * half:
            ends = f"within {half:g} m of the joint's point on {body_of(j.inboard)}"
            advice = "for a short sleeve on a long shaft write ends: outboard"
            out.append(f"{name}: its contacts stay {ends}, but it travels {far:g} m; {advice}")
    return out


def driven_to(drive: Drive, until: float) -> list[float]:
    """Coordinates that a drive's motion may reach up to a time: those at the ends of its pieces, of a sine the farthest."""
    if drive.harmonic is not None:
        return [s * abs(drive.harmonic.amplitude) + drive.harmonic.offset for s in (-1, 1)]
    if drive.table is not None:
        return [float(v) for v in drive.table.value]
    if drive.constant is not None:
        return [drive.constant.start + drive.constant.rate * t for t in (0.0, until)]
    if drive.move is not None:
        return [drive.move.start, drive.move.end]
    if drive.ramp is not None:
        r = drive.ramp
        times = np.linspace(0.0, until, 1001)
        rates = np.interp(times, (r.begin, r.begin + r.duration), (r.start, r.end))
        ways = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times))])
        return [float(r.origin + ways.min()), float(r.origin + ways.max())]
    return []
