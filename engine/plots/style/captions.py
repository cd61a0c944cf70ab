"""Texts about a run, for all pictures: friction laws, settings and events of the run."""

from __future__ import annotations

import math

from trunnion.elements.friction import REGISTRY
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.result import Result


def caption(result: Result) -> str:
    """One line with friction laws and their parameters, method, tolerance and outcome."""
    scene, used = result.scene, result.settings
    frictions = [j.friction for j in scene.joints.values() if j.friction is not None]
    laws = {scene.law_of(f) for f in frictions}
    words = [f"friction law {', '.join(sorted(laws))}"] if laws else []
    for n in {n.name: n for law in laws for n in REGISTRY[law].numbers if n.default is not None}.values():
        has = [f for f in frictions if n in REGISTRY[scene.law_of(f)].numbers]
        values = {float(getattr(f if getattr(f, n.name) is not None else scene.friction, n.name)) for f in has}
        words.append(f"{n.name} {', '.join(f'{v:g}' for v in sorted(values))} {n.unit}")
    words.append(f"method {used.get('method', '?')}")
    words.append(f"fixed step {used['step']:g} s" if used.get("step") else f"rtol {used.get('rtol', 0):g}")
    words.append(outcome_text(result))
    if result.certainty is not None and not result.certainty.promise.whole:
        words.append(f"no error is stated from t = {result.certainty.promise.until:.6g} s (shaded)")
    return " · ".join(words)


def outcome_text(result: Result) -> str:
    """A text that states how the run ended: outcome, joint and time."""
    where = f" in {result.outcome.joint}" if result.outcome.joint else ""
    return f"{result.outcome.name.replace('_', ' ')}{where} at t = {result.outcome.time:.6g} s"


def event_text(event: Event) -> str:
    """One line about an event: time, kind, joint, and the angle by which the contact normal turned."""
    turns = [f"{math.degrees(t):.4g}°" for t in event.turn if math.isfinite(t)]
    turned = f", normal turns {' and '.join(turns)}" if turns else ""
    return f"{event.time:.6g} s: {event.kind.replace('_', ' ')} in {event.joint}{turned}"
