"""Trunnion's engine: a scene in, motion and joint contacts out.

``load_scene(name_or_path)``, ``simulate(scene, until=…, every=…, rtol=…, method=…, overrides=…)`` → ``Result``;
``sweep(scene, over={path: "first:last:count"}, reductions=[…])`` → ``Sweep``: many cases, one table;
``optimise(scene, bounds, minimise=…)`` → the best numbers; ``refine(scene, bounds, of=…)`` → where results jump or outcomes change;
``sensitivity(scene, parameters, outputs)`` → derivatives along a run; ``fit(scene, parameters, time, measured)`` →
parameters and how sure they are, ``compare`` (laws), ``propose`` (experiments);
``hold(scene, bounds=True)`` → what a mechanism at rest can hold; ``equilibrium(scene)`` → where it rests; ``modes(scene)`` → how it
swings about that; ``inverse(scene, time, motion)`` → what a motion takes; ``wear(result)`` → what it takes off; ``knocks(result,
clearance)`` → where pins would hit their bearings.
Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from engine.basics.problems import Problem, SceneError, SimulationError
    from engine.batch.sweeping import Sweep, sweep
    from engine.bounds.api import hold
    from engine.fits import Candidate, Evidence, Fit, Interval, Measured, Trial, compare, fit, propose
    from engine.questions.equilibrium import Equilibrium, equilibrium
    from engine.questions.inverse import inverse
    from engine.questions.kinematics import kinematics
    from engine.questions.knocks import Knock, knocks
    from engine.questions.modes import Modes, modes
    from engine.questions.wear import Wear, wear
    from engine.scene import Scene, load_scene, models_dir
    from engine.sensitivities import Sensitivity, sensitivity
    from engine.simulation.event import Event
    from engine.simulation.linearize import Linearization, linearize
    from engine.simulation.result import Result
    from engine.simulation.run import simulate
    from engine.studies.running import Studied, optimise, refine

_HOMES = {
    "Problem": "engine.basics.problems",
    "SceneError": "engine.basics.problems",
    "SimulationError": "engine.basics.problems",
    "Scene": "engine.scene",
    "load_scene": "engine.scene",
    "models_dir": "engine.scene",
    **dict.fromkeys(
        ("Candidate", "Evidence", "Fit", "Interval", "Measured", "Trial", "compare", "fit", "propose"), "engine.fits"
    ),
    "Sensitivity": "engine.sensitivities",
    "sensitivity": "engine.sensitivities",
    "Event": "engine.simulation.event",
    "Result": "engine.simulation.result",
    "Linearization": "engine.simulation.linearize",
    "linearize": "engine.simulation.linearize",
    "simulate": "engine.simulation.run",
    "hold": "engine.bounds.api",
    "Equilibrium": "engine.questions.equilibrium",
    "equilibrium": "engine.questions.equilibrium",
    "Modes": "engine.questions.modes",
    "modes": "engine.questions.modes",
    "inverse": "engine.questions.inverse",
    "Wear": "engine.questions.wear",
    "wear": "engine.questions.wear",
    "Knock": "engine.questions.knocks",
    "knocks": "engine.questions.knocks",
    "kinematics": "engine.questions.kinematics",
    "Studied": "engine.studies.running",
    "optimise": "engine.studies.running",
    "refine": "engine.studies.running",
    "Sweep": "engine.batch.sweeping",
    "sweep": "engine.batch.sweeping",
}
__all__ = [
    "Candidate", "Equilibrium", "Event", "Evidence", "Fit", "Interval", "Knock", "Linearization", "Measured", "Modes", "Problem",
    "Result", "Scene", "SceneError", "Sensitivity", "SimulationError", "Studied", "Sweep", "Trial", "Wear", "compare",
    "equilibrium", "fit", "hold", "inverse", "kinematics", "knocks", "linearize", "load_scene", "models_dir", "modes", "optimise",
    "propose", "refine", "sensitivity", "simulate", "sweep", "wear",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'engine' has no attribute {name!r}")
