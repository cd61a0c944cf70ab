"""Two pendulums in other engines: friction should hold the first one and stop the second one. The script runs in environments
without Trunnion:

    PYTHON tests/benchmarks/other_programs/other_engines.py        # rows of the engines that this Python has, as JSON

The pendulum: 1 kg at 0.5 m on a hinge, 0.01 kg m² about the mass centre, 9.81 m/s². Held: friction 0.342 N m (twice the moment of
the weight), released at 2°. Stopped: friction 0.7 N m, released at 60°. Both run for 10 s."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

try:
    from tests.benchmarks.other_programs.other_readers import Row, rows
except ImportError:  # the script runs as a file in a Python without this package
    from other_readers import Row, rows

MASS, ARM, OWN, GRAVITY = 1.0, 0.5, 0.01, 9.81
CASES = ((2.0, 0.342), (60.0, 0.7))
"""(start, degrees; friction, N m) of the held and the stopped pendulum."""
UNTIL = 10.0
MJCF = (
    '<mujoco><compiler angle="degree"/><option gravity="0 0 -9.81"/><worldbody><body><joint name="j" axis="0 1 0" ref="0" '
    'frictionloss="{friction}"/><inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>'
)
URDF = (
    '<robot name="p"><link name="base"/><link name="a"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="revolute">'
    '<parent link="base"/><child link="a"/><axis xyz="0 1 0"/><limit lower="-9" upper="9" effort="0" velocity="0"/>'
    '<dynamics friction="{friction}"/></joint></robot>'
)


def rest_angle(start: float, friction: float) -> float:
    """Angle, degrees, at which friction stops the pendulum. In each half swing, friction takes the energy friction torque ×
    angle."""
    weight, at = MASS * GRAVITY * ARM, math.radians(start)
    while weight * abs(math.sin(at)) > friction:
        low, high = abs(at), abs(at) + math.pi / 2
        toward = -math.copysign(1.0, at)
        lost = lambda travel, at=at, toward=toward: weight * (math.cos(at + toward * travel) - math.cos(at)) - friction * travel  # noqa: E731
        while high - low > 1e-14:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if lost(middle) > 0.0 else (low, middle)
        at += toward * low
    return math.degrees(at)


def swung(run: Callable[[float, float], tuple[float, float]], settings: str) -> Row:
    """A row: final angles of the two pendulums, degrees, and final rate of the second pendulum, degrees/s."""
    (held, _), (stopped, rate) = (run(math.radians(start), friction) for start, friction in CASES)
    return {
        "settings": settings, "held": f"{math.degrees(held):.4f}", "stopped": f"{math.degrees(stopped):.4f}",
        "rate": f"{math.degrees(rate):.1e}",
    }  # fmt: skip


def mujoco() -> list[Row]:
    import mujoco as mj

    def run(start: float, friction: float, change: Callable[[Any], None]) -> tuple[float, float]:
        m = mj.MjModel.from_xml_string(MJCF.format(friction=friction))
        change(m)
        d = mj.MjData(m)
        d.qpos[0] = start
        while d.time < UNTIL - 1e-9:
            mj.mj_step(m, d)
        return float(d.qpos[0]), float(d.qvel[0])

    def half(m: Any) -> None:
        m.opt.timestep = 0.0005

    def noslip(m: Any) -> None:
        m.opt.noslip_iterations = 20

    def soft(m: Any) -> None:
        m.dof_solref[:, 0] = 0.004

    changes = {"default": lambda m: None, "timestep 0.5 ms": half, "solreffriction 0.004": soft, "noslip_iterations 20": noslip}
    return [swung(lambda a, f, c=change: run(a, f, c), name) for name, change in changes.items()]


def mjx() -> list[Row]:
    import jax
    import mujoco as mj
    from mujoco import mjx as mx

    jax.config.update("jax_enable_x64", True)

    def run(start: float, friction: float) -> tuple[float, float]:
        model = mx.put_model(mj.MjModel.from_xml_string(MJCF.format(friction=friction)))
        data = mx.make_data(model)
        data = data.replace(qpos=data.qpos.at[0].set(start))
        steps = round(UNTIL / float(model.opt.timestep))
        data = jax.jit(lambda d: jax.lax.fori_loop(0, steps, lambda _, x: mx.step(model, x), d))(data)
        return float(data.qpos[0]), float(data.qvel[0])

    return [swung(run, "default, 64 bits")]


def drake() -> list[Row]:
    from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, Parser, Simulator

    def run(start: float, friction: float) -> tuple[float, float]:
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
        Parser(plant).AddModelsFromString(URDF.format(friction=friction), "urdf")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
        plant.Finalize()
        simulator = Simulator(builder.Build())
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetPositions(context, [start])
        simulator.AdvanceTo(UNTIL)
        return float(plant.GetPositions(context)[0]), float(plant.GetVelocities(context)[0])

    return [swung(run, "URDF, discrete, 1 ms")]


def dartpy() -> list[Row]:
    import dartpy as dart

    def run(start: float, friction: float) -> tuple[float, float]:
        import tempfile
        from pathlib import Path

        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "p.urdf"
            file.write_text(
                URDF.format(friction=friction)
                .replace('<link name="base"/>', '<link name="world"/>')
                .replace('parent link="base"', 'parent link="world"')
            )
            skeleton = dart.utils.DartLoader().parseSkeleton(str(file))
        world = dart.simulation.World()
        world.setGravity([0, 0, -GRAVITY])
        world.addSkeleton(skeleton)
        j = skeleton.getJoint("j")
        j.setPosition(0, start)
        while world.getTime() < UNTIL - 1e-9:
            world.step()
        return float(j.getPosition(0)), float(j.getVelocity(0))

    return [swung(run, "URDF, 1 ms")]


def pymunk() -> list[Row]:
    import pymunk as pm

    def run(start: float, friction: float) -> tuple[float, float]:
        space = pm.Space()
        space.gravity = (0, -GRAVITY)
        space.iterations = 50
        body = pm.Body(MASS, OWN)
        body.position, body.angle = (ARM * math.sin(start), -ARM * math.cos(start)), start
        hold = pm.SimpleMotor(space.static_body, body, 0.0)
        hold.max_force = friction
        space.add(body, pm.PivotJoint(space.static_body, body, (0, 0)), hold)
        for _ in range(round(UNTIL * 1000)):
            space.step(0.001)
        return float(body.angle), float(body.angular_velocity)

    return [swung(run, "SimpleMotor of rate 0, 1 ms")]


def exudyn() -> list[Row]:
    import exudyn as exu

    def run(start: float, friction: float, more: dict[str, float]) -> tuple[float, float]:
        system = exu.SystemContainer().AddSystem()
        inertia = OWN + MASS * ARM**2
        node = system.AddNode({"nodeType": "1D", "referenceCoordinates": [0.0], "initialCoordinates": [start]})
        system.AddObject({"objectType": "Mass1D", "physicsMass": inertia, "nodeNumber": node})
        moving = system.AddMarker({"markerType": "NodeCoordinate", "nodeNumber": node, "coordinate": 0})
        ground = system.AddNode({"nodeType": "PointGround"})
        still = system.AddMarker({"markerType": "NodeCoordinate", "nodeNumber": ground, "coordinate": 0})
        weight = lambda mbs, t, load: -MASS * GRAVITY * ARM * math.sin(mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates))  # noqa: E731
        system.AddLoad({"loadType": "Coordinate", "markerNumber": moving, "load": 0.0, "loadUserFunction": weight})
        system.AddObject({"objectType": "ConnectorCoordinateSpringDamperExt", "markerNumbers": [still, moving],
                          "fDynamicFriction": friction, **more})  # fmt: skip
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = 10_000, UNTIL
        settings.solution.file.write = False
        settings.timeIntegration.verboseMode = 0
        system.SolveDynamic(settings)
        numbers = exu.OutputVariableType
        q, rate = (system.GetNodeOutput(node, what) for what in (numbers.Coordinates, numbers.Coordinates_t))
        return float(q), float(rate)

    return [swung(lambda a, f: run(a, f, {"frictionProportionalZone": 1e-3}), "frictionProportionalZone 1e-3, 1 ms")]


ENGINES = {
    "mujoco": ("MuJoCo", mujoco), "mujoco-mjx": ("MJX", mjx), "drake": ("Drake", drake), "dartpy": ("DART", dartpy),
    "pymunk": ("pymunk", pymunk), "exudyn": ("Exudyn", exudyn),
}  # fmt: skip
"""{package: (name of the program, function that gives its rows)}."""


def named(package: str) -> list[Row]:
    """The rows of an engine, with its name and version."""
    name, made = ENGINES[package]
    return [{"program": name, "version": version(package), **row} for row in made()]


if __name__ == "__main__":
    print(json.dumps(named(sys.argv[1]) if sys.argv[1:] else rows(__file__, ENGINES)))
