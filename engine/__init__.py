"""Trunnion: motion and joint contact forces of mechanisms with joint friction.

Each name is imported at its first use, so that ``import trunnion`` is fast. Arguments may carry units ("20 ms"); results are in
SI units.

Load and run a scene:
    load_scene: read a scene from a file, or a bundled model by its name.
    scene_from_dict: read a scene from nested dicts and lists.
    models_dir: the folder of the bundled models.
    Scene: the data that describe a mechanism and its run.
    simulate: run a scene.
    kinematics: run the motion that a scene's drives prescribe, without masses or forces.
    inverse: find the efforts that a given motion needs.

Look at results:
    Result: columns over time, events and outcome of a run.
    Event: a change of mode at one instant, such as stick, slip or end stop.
    wear: find the wear of a run's contacts.
    Wear: wear of all contacts of a run.
    knocks: find where pins with clearance would hit their bearings.
    ClearanceImpact: one impact of a pin on its bearing.
    InverseDynamics: efforts and contact forces over a given motion.

Analyse a mechanism at rest:
    hold: test whether friction holds a scene, and by what margin.
    HoldReport: margins of one static state.
    HoldBounds: bounds over all admissible static states.
    equilibrium: find the pose in which a mechanism comes to rest.
    Equilibrium: the pose at rest, its stability and its friction bands.
    modes: find frequencies, damping and shapes of small vibrations.
    VibrationModes: all modes about a pose.

Derivatives and fits:
    linearize: find the state-space matrices at one instant of a run.
    Linearization: the state-space matrices, with the names of states, inputs and outputs.
    sensitivity: differentiate outputs with respect to parameters along a run.
    Sensitivity: outputs and their derivatives.
    fit: estimate parameters from measured curves.
    Fit: estimates, intervals and the fitted curves.
    Interval: the confidence interval of one parameter.
    MeasuredRun: curves measured in one run.
    compare: fit several models to the same curves and rank them.
    Candidate: a model to compare.
    ModelComparison: the ranked models.
    propose: rank possible experiments by the information that each would add about a fit's parameters.
    Experiment: a possible experiment.
    RankedExperiment: an experiment and its gain of information.

Many runs and searches:
    sweep: run a scene over a grid, a list or a sample of parameter values.
    Sweep: the table of all runs of a sweep.
    optimise: find the parameter values that minimise or maximise a result, or bring the result to a target.
    refine: find the parameter values at which results jump or outcomes change.
    StudyResult: the result of ``optimise`` or ``refine``, and all its runs.

Errors:
    SceneError: wrong input; the error lists all problems.
    Problem: place, cause and remedy of one mistake.
    SimulationError: a run cannot start or continue.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # the import of ``typing`` takes as long as the start of Python
if TYPE_CHECKING:
    from trunnion.analysis.fits.experiment_design import Experiment, RankedExperiment, propose
    from trunnion.analysis.fits.measurements import MeasuredRun
    from trunnion.analysis.fits.model_comparison import Candidate, ModelComparison, compare
    from trunnion.analysis.fits.parameter_estimation import Fit, fit
    from trunnion.analysis.fits.profile_likelihood import Interval
    from trunnion.analysis.mechanics.clearance_impacts import ClearanceImpact, knocks
    from trunnion.analysis.mechanics.equilibrium_pose import Equilibrium, equilibrium
    from trunnion.analysis.mechanics.inverse_dynamics import InverseDynamics, inverse
    from trunnion.analysis.mechanics.kinematics import kinematics
    from trunnion.analysis.mechanics.linearization import Linearization, linearize
    from trunnion.analysis.mechanics.vibration_modes import VibrationModes, modes
    from trunnion.analysis.mechanics.wear import Wear, wear
    from trunnion.analysis.sensitivities.sensitivity import Sensitivity, sensitivity
    from trunnion.analysis.static_bounds.bounds_results import HoldBounds
    from trunnion.analysis.static_bounds.hold_check import hold
    from trunnion.analysis.static_bounds.start_pose_statics import HoldReport
    from trunnion.analysis.studies.optimise_and_refine import StudyResult, optimise, refine
    from trunnion.basics.errors import Problem, SceneError, SimulationError
    from trunnion.batch.sweep import Sweep, sweep
    from trunnion.scene import Scene, load_scene, models_dir, scene_from_dict
    from trunnion.simulation.results.event import Event
    from trunnion.simulation.results.result import Result
    from trunnion.simulation.run import simulate

__all__ = [  # noqa: RUF022  # grouped by purpose
    # load and run a scene
    "load_scene", "scene_from_dict", "models_dir", "Scene", "simulate", "kinematics", "inverse",
    # look at results
    "Result", "Event", "wear", "Wear", "knocks", "ClearanceImpact", "InverseDynamics",
    # analyse a mechanism at rest
    "hold", "HoldReport", "HoldBounds", "equilibrium", "Equilibrium", "modes", "VibrationModes",
    # derivatives and fits
    "linearize", "Linearization", "sensitivity", "Sensitivity", "fit", "Fit", "Interval", "MeasuredRun", "compare",
    "Candidate", "ModelComparison", "propose", "Experiment", "RankedExperiment",
    # many runs and searches
    "sweep", "Sweep", "optimise", "refine", "StudyResult",
    # errors
    "SceneError", "Problem", "SimulationError",
]  # fmt: skip

_MODULES = {
    "analysis.fits.experiment_design": ("Experiment", "RankedExperiment", "propose"),
    "analysis.fits.measurements": ("MeasuredRun",),
    "analysis.fits.model_comparison": ("Candidate", "ModelComparison", "compare"),
    "analysis.fits.parameter_estimation": ("Fit", "fit"),
    "analysis.fits.profile_likelihood": ("Interval",),
    "analysis.mechanics.clearance_impacts": ("ClearanceImpact", "knocks"),
    "analysis.mechanics.equilibrium_pose": ("Equilibrium", "equilibrium"),
    "analysis.mechanics.inverse_dynamics": ("InverseDynamics", "inverse"),
    "analysis.mechanics.kinematics": ("kinematics",),
    "analysis.mechanics.linearization": ("Linearization", "linearize"),
    "analysis.mechanics.vibration_modes": ("VibrationModes", "modes"),
    "analysis.mechanics.wear": ("Wear", "wear"),
    "analysis.sensitivities.sensitivity": ("Sensitivity", "sensitivity"),
    "analysis.static_bounds.bounds_results": ("HoldBounds",),
    "analysis.static_bounds.hold_check": ("hold",),
    "analysis.static_bounds.start_pose_statics": ("HoldReport",),
    "analysis.studies.optimise_and_refine": ("StudyResult", "optimise", "refine"),
    "basics.errors": ("Problem", "SceneError", "SimulationError"),
    "batch.sweep": ("Sweep", "sweep"),
    "scene": ("Scene", "load_scene", "models_dir", "scene_from_dict"),
    "simulation.results.event": ("Event",),
    "simulation.results.result": ("Result",),
    "simulation.run": ("simulate",),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}

if not TYPE_CHECKING:  # hidden from type checkers: with __getattr__, a type checker would accept every name

    def __getattr__(name: str) -> object:
        """Load a public name from its module."""
        if name in _HOMES:
            return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
