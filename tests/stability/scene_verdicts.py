"""Verdicts about a scene in a word or two. A run or statics gives the verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from trunnion.analysis.static_bounds.start_pose_statics import hold
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate


def ran(scene: sm.Scene, rtol: float = 1e-8, rows: int = 20) -> Result:
    """A run to the end time of the scene."""
    until = float(scene.simulation.until)
    return simulate(scene, until=until, every=until / rows, rtol=rtol, max_steps=500_000)


def holding(scene: sm.Scene, round_off: float = 0.0) -> str:
    """The word "holds" or "slips" by statics. If a short run gives another result, the text also names this result. round_off:
    largest rate at
    rest. With friction in a coupling of two shafts, the shafts' rates keep round-off; with friction in joints, rates are zero."""
    word = "holds" if hold(scene).holds else "slips"
    r = ran(scene)
    rests = all(np.all(np.abs(r[c]) <= round_off) for c in r.matching("*.qd[*]"))
    still = rests and not any(e.kind == "slip" for e in r.events)
    return word if (word == "holds") == still and r.outcome.ok else f"{word}, but the run {r.outcome.name}"


def honest(scene: sm.Scene) -> str:
    """The word "right" if a run reaches its end with its energy in balance and its loops closed. Otherwise the words for the
    failure."""
    r = ran(scene)
    if not r.outcome.ok:
        return r.outcome.name
    size = max(np.abs(r["energy.kinetic"]).max(), np.abs(r["energy.potential"] - r["energy.potential"][0]).max())
    lost = np.abs(r["energy.residual"]).max()
    closed = r["audit.constraint"].max() if "audit.constraint" in r else 0.0
    return "right" if lost <= 1e-5 * size and closed <= 1e-9 * _length(scene) else f"energy {lost / size:.1e}, closure {closed:.1e}"


def _length(scene: sm.Scene) -> float:
    from trunnion.system.construction.system_builder import build

    return float(build(scene).numbers.length)


def accepted(scene: sm.Scene) -> str:
    """The word "refused" if the scene is refused before it runs, else the verdict of ``honest``."""
    from trunnion.scene.checks import problems

    return "refused" if problems(scene) else honest(scene)


def settled(scene: sm.Scene) -> str:
    """The word "refused" if the scene is refused before it runs, else the verdict of ``holding``."""
    from trunnion.scene.checks import problems

    return "refused" if problems(scene) else holding(scene)


def bundled(name: str, until: float, **changes: float) -> Callable[[float], sm.Scene]:
    """Scenes of a bundled model with an end time in s. The given numbers of the scene are multiplied by 1 + beyond."""

    def make(beyond: float) -> sm.Scene:
        scene = load_scene(name)
        if changes:
            scene = apply(scene, {k.replace("__", "."): v * (1 + beyond) for k, v in changes.items()})
        return replace(scene, simulation=sm.Simulation(until=until), outputs=("*",))

    return make
