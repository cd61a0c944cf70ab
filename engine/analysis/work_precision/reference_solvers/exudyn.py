"""Exudyn: rigid bodies in redundant coordinates, with constraints for all joints and implicit solvers with fixed steps."""

from __future__ import annotations

import time
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import Link, Snapshot
from trunnion.analysis.work_precision.reference_solvers.solver_interface import ReferenceSolver, SceneNotSupported, Setting
from trunnion.system.structure.bodies_and_joints import GROUND

CONSTRAINED_AXES = {"cylindrical": [0, 1, 1, 0, 1, 1], "universal": [1, 1, 1, 0, 0, 1], "fixed": [1, 1, 1, 1, 1, 1]}
"""By joint type, the axes that Exudyn's generic joint constrains (1): three translations, then three rotations, in the joint's
frame."""
PADDING = 1e-9


class Exudyn(ReferenceSolver):
    """A scene in Exudyn: every joint is a constraint between two bodies."""

    name = "exudyn"
    package = "exudyn"
    methods = ("generalized-α", "trapezoidal, index 2")
    steps = (1, 3, 10, 30, 100, 300)

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        super().__init__(ready, scene)
        able = ("revolute", "prismatic", "spherical", "free", *CONSTRAINED_AXES)
        wrong = [*scene.missing, *(f"{k.kind} {k.name}" for k in scene.links if k.kind not in able)]
        if wrong:
            raise SceneNotSupported("not represented: " + ", ".join(wrong))

    def describe_omissions(self) -> str:
        """The parts of the scene that Exudyn omits, and its step control."""
        words = ["fixed steps, no error control"]
        words += ["joint friction"] if self.scene.rubs else []
        return "; ".join(words)

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Build the system, integrate with fixed steps and read the sensors (see ``ReferenceSolver.run``)."""
        import sys

        sys.exudynFast = True  # type: ignore[attr-defined]  # selects the module without range checks
        with redirect_stdout(StringIO()):  # hide the banner that Exudyn prints
            import exudyn as exu

        exu.config.printToConsole = False
        exu.config.suppressWarnings = True
        system, sensors = self._build(exu)
        settings: Any = exu.SimulationSettings()
        stepping = settings.timeIntegration
        stepping.numberOfSteps, stepping.endTime, stepping.verboseMode = round(self.ready.until / s.step), self.ready.until, 0
        stepping.newton.useModifiedNewton = True
        stepping.newton.relativeTolerance, stepping.newton.absoluteTolerance = 1e-8, 1e-10
        stepping.generalizedAlpha.computeInitialAccelerations = True
        stepping.generalizedAlpha.spectralRadius = 0.9
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = self.ready.every
        settings.linearSolverType = exu.LinearSolverType.EigenDense
        settings.linearSolverSettings.ignoreSingularJacobian = True
        kind = exu.DynamicSolverType.GeneralizedAlpha if s.method == self.methods[0] else exu.DynamicSolverType.TrapezoidalIndex2
        started = time.perf_counter()
        if not system.SolveDynamic(settings, solverType=kind):
            raise RuntimeError("Exudyn's solver failed")
        seconds = time.perf_counter() - started
        rows = [np.array(system.GetSensorStoredData(k)) for k in sensors]
        return self.by_position(np.stack([_rows_at(r, self.times) for r in rows], axis=1)), seconds

    def _build(self, exu):
        """(system, one sensor for the mass centre of each body)."""
        from exudyn.itemInterface import SensorBody
        from exudyn.utilities import RigidBodyInertia

        system = exu.SystemContainer().AddSystem()
        ground = system.CreateGround()
        bodies = []
        for p in self.scene.parts:
            inertia = RigidBodyInertia(p.mass, p.inertia + PADDING * p.inertia.trace() * np.eye(3))
            bodies.append(system.CreateRigidBody(
                referencePosition=p.center, referenceRotationMatrix=p.R, inertia=inertia, initialVelocity=p.velocity,
                initialAngularVelocity=p.omega, gravity=self.scene.gravity,
            ))  # fmt: skip
        of = {GROUND: ground} | dict(enumerate(bodies))
        for link in self.scene.links:
            _add_joint(system, link, [of[link.inboard], of[link.outboard]])
            for f, e in zip(link.freedoms, link.effort, strict=True):
                if e:
                    self._effort(system, of, link, f, e)
        for s in self.scene.springs:
            system.CreateSpringDamper(bodyNumbers=[of[b] for b in s.bodies], localPosition0=s.points[0], localPosition1=s.points[1],
                                      referenceLength=s.length, stiffness=s.stiffness, damping=s.damping)
        position = exu.OutputVariableType.Position
        sensors = [system.AddSensor(SensorBody(bodyNumber=b, outputVariableType=position, storeInternal=True, writeToFile=False))
                   for b in bodies]
        system.Assemble()
        return system, sensors

    def _effort(self, system, of: dict, link: Link, freedom, effort: float) -> None:
        """Apply the constant torque of a revolute joint. Raises SceneNotSupported if the joint's axis is not fixed in the world."""
        if not freedom.turns or link.kind != "revolute" or link.inboard != GROUND:
            raise SceneNotSupported(f"not represented: effort of {link.name}")
        system.CreateTorque(bodyNumber=of[link.outboard], loadVector=effort * freedom.axis)


def _add_joint(system, link: Link, bodies: list) -> None:
    at = {"bodyNumbers": bodies, "position": link.point, "useGlobalFrame": True}
    if link.kind == "revolute":
        system.CreateRevoluteJoint(axis=link.freedoms[0].axis, **at)
    elif link.kind == "prismatic":
        system.CreatePrismaticJoint(axis=link.freedoms[0].axis, **at)
    elif link.kind == "spherical":
        system.CreateSphericalJoint(**at)
    elif link.kind in CONSTRAINED_AXES:
        frame = link.frame
        if link.kind == "universal":
            first, second = link.freedoms[0].axis, link.freedoms[1].axis
            frame = np.column_stack([first, second, np.cross(first, second)])
        system.CreateGenericJoint(rotationMatrixAxes=frame, constrainedAxes=CONSTRAINED_AXES[link.kind], **at)


def _rows_at(rows: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The sensor rows that belong to the sample times. Exudyn writes a row at the end of the step that reaches its sample time."""
    nearest = np.abs(rows[:, 0][None, :] - times[:, None]).argmin(axis=1)
    if np.abs(rows[nearest, 0] - times).max() > 1e-6 * times[-1]:
        raise RuntimeError("its sensors were not written at the sample times")
    return rows[nearest, 1:4]
