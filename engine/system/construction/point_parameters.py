"""Points of bodies as parameters, measured from the body's reference origin."""

from __future__ import annotations

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.body_references import body_of, named_point
from trunnion.system.construction.device_builder import Builder
from trunnion.system.construction.spanning_tree import Spanning
from trunnion.system.structure.bodies_and_joints import GROUND
from trunnion.system.structure.parameter_table import Leaves, ParameterTable


class Points:
    """Data that the builders of bodies, joints and loads share.

    table     the parameter table.
    devices   builder of the devices.
    index     index of each body in the tree, by name.
    origin    reference origin of each body, in the scene's body axes, m, by name."""

    def __init__(self, scene: sm.Scene, table: ParameterTable, spanning: Spanning):
        self.scene, self.table, self.spanning = scene, table, spanning
        self.devices = Builder(scene, table)
        self.index = {"ground": GROUND, **{child: i for i, (_, child, _) in enumerate(spanning.tree)}}
        self.origin = {"ground": (0.0, 0.0, 0.0)}
        for name, child, forward in spanning.tree:
            self.origin[child] = sides_of(scene, scene.joints[name])[1 if forward else 0].point

    def relative(self, body: str, label: str, p: tuple[float, ...]) -> Leaves:
        """Leaves of a body's point p, measured from the body's reference origin, m. label: path of the point in the table."""
        o = self.origin[body]
        return self.table.vector(label, [p[k] - o[k] for k in range(3)], "m")

    def named(self, body: str, point: str) -> str:
        """Path of a body's named point in the scene."""
        return f"ground.points.{point}" if body == "ground" else f"bodies.{body}.points.{point}"

    def label(self, end: str, otherwise: str) -> str:
        """Path of the point that an end of a spring names; ``otherwise`` if the end names no point."""
        point = named_point(end)
        return self.named(body_of(end), point) if point else otherwise
