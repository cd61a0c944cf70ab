"""Points of bodies as parameters, measured from the reference origin of their body."""

from __future__ import annotations

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses import sides_of
from trunnion.scene.queries.body_references import body_of, named_point
from trunnion.system.construction.device_builder import Builder
from trunnion.system.construction.spanning_tree import Spanning
from trunnion.system.structure.bodies_and_joints import GROUND
from trunnion.system.structure.parameter_table import Leaves, ParameterTable


class Points:
    """The data that all parts of a system share: numbers of bodies in the tree, their reference origins (m), devices, and the
    parameter table."""

    def __init__(self, scene: sm.Scene, table: ParameterTable, spanning: Spanning):
        self.scene, self.table, self.spanning = scene, table, spanning
        self.devices = Builder(scene, table)
        self.index = {"ground": GROUND, **{child: i for i, (_, child, _) in enumerate(spanning.tree)}}
        self.origin = {"ground": (0.0, 0.0, 0.0)}
        for name, child, forward in spanning.tree:
            self.origin[child] = sides_of(scene, scene.joints[name])[1 if forward else 0].point

    def relative(self, body: str, label: str, p: tuple[float, ...]) -> Leaves:
        """Leaves of a body's point, measured from the body's reference origin, m; ``label`` is its path among the parameters."""
        o = self.origin[body]
        return self.table.vector(label, [p[k] - o[k] for k in range(3)], "m")

    def named(self, body: str, point: str) -> str:
        """Path of a body's named point in the scene."""
        return f"ground.points.{point}" if body == "ground" else f"bodies.{body}.points.{point}"

    def label(self, end: str, otherwise: str) -> str:
        """Path of the point that an end of a spring names, ``otherwise`` where it names none."""
        point = named_point(end)
        return self.named(body_of(end), point) if point else otherwise
