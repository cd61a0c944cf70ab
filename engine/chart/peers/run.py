"""Measure every peer that is installed, with the law it can solve."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from engine.chart.peers.base import Peer, Setting, Unable, only_positions
from engine.chart.peers.exudyn import Exudyn
from engine.chart.peers.mujoco import Mujoco
from engine.chart.peers.pinocchio import Pinocchio
from engine.chart.peers.scipy import ScipyClosed, ScipyOnOurs
from engine.chart.peers.snapshot import Snapshot, snapshot
from engine.chart.peers.sundials import Sundials
from engine.chart.points import Point, Variant
from engine.chart.runs import Prepared, has_v_eps, repeated

if TYPE_CHECKING:
    from engine.chart.study import Study, Tell

PEERS: tuple[type[Peer], ...] = (ScipyOnOurs, ScipyClosed, Sundials, Mujoco, Pinocchio, Exudyn)
PATIENCE = 20.0
"""Seconds of one run after which a peer's finer steps and tighter tolerances of that method are not tried any more."""


def measure_peers(study: Study, ready: dict[Variant, Prepared], tell: Tell) -> None:
    """Measure the installed peers and add their points, and what they leave out, to the study."""
    chosen = smooth(ready)
    if chosen is None:
        study.peers.append(("all", "", "no law of this chart can be written as an ordinary differential equation"))
        return
    scene = snapshot(chosen)
    for k, kind in enumerate(PEERS):
        tell(kind.name, k, len(PEERS))
        if not kind.version():
            study.peers.append((kind.name, "", f"not installed (pip install {kind.package})"))
            continue
        try:
            peer = _made(kind, chosen, scene)
        except Unable as e:
            study.peers.append((kind.name, kind.version(), f"not run: {' '.join(str(e).split())}"))
            continue
        except Exception as e:  # noqa: BLE001  # whatever a foreign program does is a result here
            study.peers.append((kind.name, kind.version(), f"not run: {_reason(e)}"))
            continue
        study.peers.append((kind.name, kind.version(), peer.leaves_out()))
        study.points += _points(study, peer, chosen)


def smooth(ready: dict[Variant, Prepared]) -> Prepared | None:
    """The law other programs are given: none, or the smoothed one with the scene's own v_eps (the nearest charted)."""
    able = [p for v, p in ready.items() if not v.law or has_v_eps(p.scene)]
    if not able:
        return None
    return min(able, key=lambda p: abs(math.log(p.variant.v_eps / 1e-4)) if p.variant.v_eps else 0.0)


def _made(kind: type[Peer], ready: Prepared, scene: Snapshot) -> Peer:
    if not kind.all_columns and not only_positions(ready, scene):
        raise Unable("only positions of mass centres can be compared with it")
    return kind(ready, scene)


def _points(study: Study, peer: Peer, ready: Prepared) -> list[Point]:
    """Points of all settings of a peer; a method that has become too slow is not refined further."""
    out: list[Point] = []
    slow: set[str] = set()
    for s in peer.settings():
        if s.method in slow:
            continue
        where = (peer.name, s.method, s.rtol, s.step, ready.variant.law, ready.variant.v_eps)
        started = time.perf_counter()
        try:
            data, first = peer.run(s)
        except Exception as e:  # noqa: BLE001  # whatever a foreign program does is a result here
            out.append(Point(*where, math.nan, math.nan, math.nan, math.nan, 0, outcome=_reason(e), leaves_out=peer.leaves_out()))
            slow |= {s.method} if time.perf_counter() - started > PATIENCE / 4 else set()
            continue
        if first > PATIENCE / 4:
            slow.add(s.method)
        if not math.isfinite(float(abs(data).max())):
            out.append(Point(*where, math.nan, math.nan, first, first, 1, outcome="not finite", leaves_out=peer.leaves_out()))
            continue
        low, middle, count = _repeats(peer, s, first, study.choice.repeats)
        both = study.errors(ready.variant, data)
        out.append(Point(*where, *both, low, middle, count, leaves_out=peer.leaves_out()))
    return out


def _repeats(peer: Peer, s: Setting, first: float, repeats: int) -> tuple[float, float, int]:
    """(minimum, median, count) of the seconds of repeated runs; a long first run is counted and not repeated."""
    if first > 1.0:
        return first, first, 1
    return repeated(lambda: peer.run(s)[1], repeats)


def _reason(e: Exception) -> str:
    return f"{type(e).__name__}: {str(e).strip().splitlines()[0][:120] if str(e).strip() else ''}"
