"""What a run may be asked for: checked in one place, whoever asks (command line, Python, sweeps, the service)."""

from __future__ import annotations

import math

from engine.basics.problems import Problem, SceneError
from engine.scene.model import Scene
from engine.simulation import block as bl


def check_settings(until: float, every: float, s: bl.Settings, scene: Scene) -> None:
    """SceneError with everything that is wrong with these for the scene."""
    problems = []
    if not 0.0 < until < math.inf:
        problems.append(Problem("until", f"{until:g} s is not after the start", "give a positive end time"))
    if not 0.0 <= every < math.inf:
        problems.append(Problem("every", f"{every:g} s is no spacing of rows", "give a positive spacing, or 0 for every step"))
    if not 1e-14 <= s.rtol <= 0.1:
        problems.append(Problem("rtol", f"{s.rtol:g} is out of range", "between 1e-14 and 0.1; 1e-6 is a good start"))
    if s.method not in bl.METHODS:
        problems.append(Problem("method", f"{s.method!r} is unknown", f"one of {', '.join(bl.METHODS)}"))
    if not 0.0 <= s.step < math.inf:
        problems.append(Problem("step", f"{s.step:g} s is no step", "a positive step, or 0 for error control"))
    stiff = {j.friction.law or scene.friction.law for j in scene.joints.values() if j.friction} & {"regularized", "lugre"}
    if s.method == "moreau" and stiff:
        problems.append(Problem("method", f"moreau cannot step law {min(stiff)}", "use law coulomb or stribeck, or method auto"))
    if problems:
        raise SceneError(problems)
