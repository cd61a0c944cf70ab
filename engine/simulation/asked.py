"""What a run may be asked for: checked in one place, whoever asks (command line, Python, sweeps, the service)."""

from __future__ import annotations

from engine.basics.numbers import NOT_NEGATIVE, POSITIVE
from engine.basics.problems import Problem, SceneError
from engine.friction import REGISTRY as LAWS
from engine.integrators import REGISTRY as METHODS
from engine.integrators import Impulses
from engine.scene.model import RTOL, Scene
from engine.simulation import block as bl


def check_settings(until: float, every: float, s: bl.Settings, scene: Scene) -> None:
    """SceneError with everything that is wrong with these for the scene."""
    asked = {
        "until": (until, POSITIVE, "give a positive end time"),
        "every": (every, NOT_NEGATIVE, "give a positive spacing, or 0 for every step"),
        "rtol": (s.rtol, RTOL, RTOL.advice),
        "step": (s.step, NOT_NEGATIVE, "a positive step, or 0 for error control"),
    }
    problems = [Problem(k, bound.refusal(k, value), hint) for k, (value, bound, hint) in asked.items() if not bound.holds(value)]
    if s.method not in bl.METHODS:
        problems.append(Problem("method", f"{s.method!r} is unknown", f"one of {', '.join(bl.METHODS)}"))
    laws = {j.friction.law or scene.friction.law for j in scene.joints.values() if j.friction}
    stiff = sorted(law for law in laws if not LAWS[law].steps)
    if s.method in {m.name for m in METHODS if isinstance(m, Impulses)} and stiff:
        able = " or ".join(name for name, law in LAWS.items() if law.steps)
        problems.append(Problem("method", f"{s.method} cannot step law {stiff[0]}", f"use law {able}, or method auto"))
    if problems:
        raise SceneError(problems)
