"""Wheels that roll on each other: their parameters, and checks of their poses (theory, "Rolling")."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from trunnion.basics.errors import Problem
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.declaration_checks import Numeric
from trunnion.elements.joints.wheel_pairs import Sizes, phase
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import JointSide, sides_of
from trunnion.scene.queries.body_references import GROUND, body_of
from trunnion.scene.queries.wheel_sizes import rolls_of, sizes
from trunnion.system.construction.joint_frames import frame, matrix
from trunnion.system.construction.spanning_tree import Spanning
from trunnion.system.structure.coupling_joint_data import Wheels
from trunnion.system.structure.parameter_table import Leaf, ParameterTable

ASKEW = 1e-9
"""Two directions count as parallel or perpendicular if the sine of their angular deviation is below this value."""
NEAR = 1e-6
"""Tolerance of the wheels' positions, relative to the larger wheel's radius."""


@dataclass(frozen=True)
class BodyPose:
    """Pose of a body's frame in the world: R (3×3), and r (3), m."""

    R: np.ndarray
    r: np.ndarray

    def side(self, s: JointSide) -> tuple[np.ndarray, np.ndarray]:
        """The joint frame (3×3, axes as columns) and the point (3), m, of one side of a joint, in the world."""
        return self.R @ matrix(frame(s.axis, s.reference)), self.R @ np.array(s.point, float) + self.r


def stands(scene: sm.Scene, spanning: Spanning) -> dict[str, BodyPose]:
    """Poses of all bodies when every coordinate of the tree is 0: the two frames of each tree joint coincide."""
    found = {GROUND: BodyPose(np.eye(3), np.zeros(3))}
    for name, child, forward in spanning.tree:
        a, b = sides_of(scene, scene.joints[name])
        near, far = (a, b) if forward else (b, a)
        (E, p), own = found[near.body].side(near), matrix(frame(far.axis, far.reference))
        R = E @ own.T
        found[child] = BodyPose(R, p - R @ np.array(far.point, float))
    return found


def misfits(scene: sm.Scene, spanning: Spanning, where: dict[str, BodyPose]) -> list[Problem]:
    """Problems with the relative poses of wheels. If a closed loop determines the relative pose of two wheels, this pose is not
    checked."""
    out: list[Problem] = []
    ways = {name: _way(scene, spanning, name) for name in spanning.cut}
    loops = {step for name, way in ways.items() if not REGISTRY[scene.joints[name].type].rolls for step in way}
    for name, way in ways.items():
        j = scene.joints[name]
        if REGISTRY[j.type].rolls and not way & loops:
            out += [Problem(f"joints.{name}", *wrong) for wrong in _misfit(scene, j, where)]
    return out


def _way(scene: sm.Scene, spanning: Spanning, name: str) -> set[str]:
    """Names of the tree joints on the path between the two bodies of a joint."""
    carried = {child: (joint, body_of(j.inboard if forward else j.outboard))
               for joint, child, forward in spanning.tree for j in (scene.joints[joint],)}  # fmt: skip
    ways: list[set[str]] = []
    for side in (scene.joints[name].inboard, scene.joints[name].outboard):
        body, way = body_of(side), set()
        while body != GROUND:
            joint, body = carried[body]
            way.add(joint)
        ways.append(way)
    return ways[0] ^ ways[1]


def _misfit(scene: sm.Scene, j: sm.Joint, where: dict[str, BodyPose]) -> Iterator[tuple[str, str]]:
    """A pair (problem, remedy) for each fault in the relative pose of two wheels."""
    (Ea, pa), (Eb, pb) = (where[s.body].side(s) for s in sides_of(scene, j))
    a, b, s, of = Ea[:, 0], Eb[:, 0], pb - pa, sizes(j)
    rolls = rolls_of(j)
    r1, r2 = of.radii(rolls.touch, Numeric)
    size = max(abs(r1), abs(r2))
    if rolls.touch == "skew":
        if abs(float(a @ b)) > ASKEW:
            yield "the axes of worm and wheel are not at a right angle", "give the two sides axes at a right angle"
        elif abs(abs(float(s @ np.cross(a, b))) - (r1 + r2)) > NEAR * size:
            apart = abs(float(s @ np.cross(a, b)))
            yield f"the axes of worm and wheel are {apart:.6g} m apart; teeth, module and lead angle require {r1 + r2:.6g} m", (
                "move the wheel, or change the lead angle")
        return
    if rolls.touch == "cones":
        if float(np.linalg.norm(np.cross(a, b))) < ASKEW:
            yield "the axes of the two wheels are parallel", "use type: gear, or give each side its own axis"
        if float(np.linalg.norm(s)) > NEAR * size:
            yield f"its two points are {np.linalg.norm(s):.3g} m apart", "put both points where the two axes meet"
        return
    if rolls.touch == "straight":
        if abs(float(a @ b)) > ASKEW:
            yield "the rack is not perpendicular to the wheel's axis", "the outboard axis is the direction of the rack"
            return
        gap = abs(float(s @ np.cross(a, b))) - r1
        if abs(gap) > NEAR * size:
            yield f"the rack is {abs(gap):.3g} m {'too far from' if gap > 0 else 'too near to'} the wheel's axis", (
                f"put the rack's point on its pitch line, {r1:.6g} m from the wheel's axis")
        return
    if float(np.linalg.norm(np.cross(a, b))) > ASKEW:
        yield "the axes of its two wheels are not parallel", "give both sides the same axis; bevel_gear is for axes that meet"
        return
    apart = float(np.linalg.norm(s - (s @ a) * a))
    wanted = abs(r1 + r2)
    if rolls.size != "module":
        if apart <= NEAR * size or apart < abs(r1 + r2) * (1 - NEAR):
            yield f"the axes of its pulleys are {apart:.3g} m apart, less than {wanted:.3g} m", "move the pulleys apart"
    elif abs(apart - wanted) > NEAR * size:
        yield f"the axes of its wheels are {apart:.6g} m apart; teeth and module require {wanted:.6g} m", (
            "change the module, or move the wheels")


def wheels(scene: sm.Scene, table: ParameterTable, where: dict[str, BodyPose], name: str) -> Wheels:
    """The parameters of a pair of wheels. where: poses of all bodies when every coordinate is 0 (``stands``); in these poses the
    wheels mesh."""
    j = scene.joints[name]
    of = sizes(j)
    (Ea, pa), (Eb, pb) = (where[s.body].side(s) for s in sides_of(scene, j))
    met = phase(rolls_of(j).touch, Ea.T.tolist(), Eb.T.tolist(), (pb - pa).tolist(), of, Numeric)
    derived = REGISTRY[j.type].slips and j.friction is not None and j.friction.wrap_angle is None
    second: Leaf = float(of.teeth[1])
    if REGISTRY[j.type].slips:
        second = table.scalar(f"joints.{name}.radius_ratio", float(of.teeth[1]), "1")
    return Wheels(  # the module is not ``own``, because a changed module moves the wheels and requires a new system
        table.scalar(f"joints.{name}.module", of.module, "m"), (float(of.teeth[0]), second),
        table.scalar(f"joints.{name}.phase", math.remainder(met, 2 * math.pi), "rad"),
        table.scalar(f"joints.{name}.lead_angle", of.lead, "rad") if rolls_of(j).touch == "skew" else None,
        table.scalar(f"joints.{name}.friction.wrap_angle", _wrap(Ea[:, 0], pb - pa, of), "rad") if derived else None,
    )  # fmt: skip


def _wrap(a: np.ndarray, s: np.ndarray, of: Sizes) -> float:
    """Angle of wrap about the smaller pulley, rad: π minus the angle between the strands; for a crossed belt, π plus this angle."""
    r1, r2 = of.radii("wheels", Numeric)
    return math.pi + 2 * math.asin((r1 + r2) / float(np.linalg.norm(s - (s @ a) * a)))
