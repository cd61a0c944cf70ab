"""Construction from a scene of the ``System`` (structure), the table of run-time parameters, and the ``Numbers`` of a run (start
values, tables, scales)."""

from __future__ import annotations

from dataclasses import replace

from trunnion.basics.errors import raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.body_references import body_of
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.scene.queries.rod_lengths import rod_length
from trunnion.scene.queries.shaft_joints import couples_shafts
from trunnion.scene.queries.unilateral_joints import refuse_unilateral
from trunnion.system.construction.cam_profile_spline import profile
from trunnion.system.construction.friction_builder import element
from trunnion.system.construction.joint_frames import frame
from trunnion.system.construction.light_freedoms import light_freedoms, light_rows, massless_and_free, with_inertias
from trunnion.system.construction.load_builder import load
from trunnion.system.construction.mimics_and_gearboxes import gearbox, ties
from trunnion.system.construction.point_curve_spline import curve
from trunnion.system.construction.point_parameters import Points
from trunnion.system.construction.spanning_tree import Spanning, span
from trunnion.system.construction.start_values_and_scales import Numbers, numbers_of
from trunnion.system.construction.wheel_pairs import misfits, stands, wheels
from trunnion.system.structure.bodies_and_joints import Body, Fit, Joint, System, state_coordinates
from trunnion.system.structure.parameter_table import Param, ParameterTable

MASSLESS = 1e-15
"""A body of mass 0 gets this fraction of the heaviest body's mass, whose effect is below round-off (theory, "Light bodies")."""
INERTIA_NAMES = ("xx", "yy", "zz", "xy", "xz", "yz")


@dataclass(frozen=True)
class Built:
    """A scene with its structure, its run-time parameters, and the start values, tables and scales of a run."""

    scene: sm.Scene
    system: System
    parameters: ParameterTable
    numbers: Numbers


def fit(j: sm.Joint) -> Fit:
    """Roles of a joint's parts: which part carries the pin, and which part has the contacts at its ends (``Fit``)."""
    out = j.pin == "outboard"
    if j.ends is None or REGISTRY[j.type].slides_along < 0:  # the part with the ends matters only for joints that slide
        return Fit(out)
    if j.ends == OVERLAP:
        return Fit(out, OVERLAP if j.friction is not None else "pin")
    return Fit(out, "pin" if j.ends == j.pin else "bearing")


def build(scene: sm.Scene) -> Built:
    """Reduce a checked scene to the data of its system, without symbolic expressions. Raises SceneError for three faults: poses of
    wheels that do not fit; a massless body whose motion nothing determines; joints that only push in a real-time scene."""
    table = ParameterTable(scene.tunable)
    spanning = span(scene)
    maker = _Maker(scene, table, spanning)
    system = maker.system()
    return Built(scene, system, table, numbers_of(scene, system, maker.devices))


class _Maker(Points):
    """Builds the parts of a system. The order of building determines the indices of the parameters."""

    def __init__(self, scene: sm.Scene, table: ParameterTable, spanning: Spanning):
        super().__init__(scene, table, spanning)
        self.heaviest = max((mass_properties(b)[0] for b in scene.bodies.values()), default=0.0)
        rolls = any(REGISTRY[scene.joints[n].type].rolls for n in spanning.cut)
        self.stands = stands(scene, spanning) if rolls else {}
        wrong = misfits(scene, spanning, self.stands) if rolls else []
        raise_problems(wrong)

    def system(self) -> System:
        """The structure of the whole mechanism."""
        if self.scene.simulation.realtime is not None:
            refuse_unilateral(self.scene, "fixed steps for real time: the number of impacts in a step has no bound")
        gravity = self.table.vector("gravity", self.scene.gravity, "m/s^2")
        bodies = tuple(self.body(i, name, child) for i, (name, child, _) in enumerate(self.spanning.tree))
        names = [name for name, _, _ in self.spanning.tree] + list(self.spanning.cut)
        made: list[Joint] = []
        for name in names:
            geared = couples_shafts(self.scene.joints[name])
            made.append(gearbox(self.scene, self.table, made[: len(bodies)], name) if geared else self.joint(name))
        joints = self.place(tuple(made))
        tied = ties(self.scene, self.table, joints)
        light = light_freedoms(self.scene, self.table, bodies, joints, tied)
        raise_problems(massless_and_free(self.scene, bodies, joints, light))
        added = light_rows(joints, light, sum(j.kind.rows for j in (*joints, *tied) if j.cut))
        joints = with_inertias(joints, light) if light else joints
        loads = tuple(load(self, name, f) for name, f in self.scene.forces.items())
        ground = tuple((n, self.relative("ground", self.named("ground", n), p)) for n, p in self.scene.ground.points.items())
        return System(
            bodies, joints, loads, gravity, tuple(self.scene.inputs), len(self.devices.tables),
            self.devices.stops + self.devices.hooks, tuple(self.scene.outputs), ground,
            (*tied, *added), self.devices.hooks, self.scene.simulation.realtime is not None,
        )

    def body(self, i: int, joint: str, name: str) -> Body:
        """Body ``name``, with mass, mass centre, inertia and points as leaves. Tree joint ``joint``, which has index i, carries the
        body."""
        b = self.scene.bodies[name]
        m, center, inertia = mass_properties(b)
        m = m or MASSLESS * self.heaviest
        shaped = b.inertia is None
        six = [inertia[0][0], inertia[1][1], inertia[2][2], inertia[0][1], inertia[0][2], inertia[1][2]]
        unit = "m^2" if shaped else "kg*m^2"
        label = "gyration" if shaped else "inertia"
        leaves = tuple(
            self.table.component(f"bodies.{name}.{label}.{n}", float(x) / m if shaped else float(x), unit)
            for n, x in zip(INERTIA_NAMES, six, strict=True)
        )
        points = tuple((n, self.relative(name, self.named(name, n), p)) for n, p in b.points.items())
        j = self.scene.joints[joint]
        parent = body_of(j.inboard if body_of(j.outboard) == name else j.outboard)
        mass = self.table.scalar(f"bodies.{name}.mass", m, "kg")
        middle = self.relative(name, f"bodies.{name}.center", tuple(float(c) for c in center))
        return Body(name, mass, middle, leaves, shaped, points, i, self.index[parent])

    def joint(self, name: str) -> Joint:
        """A joint, still without its friction element and without its offsets in the state and among the constraint rows. ``place``
        adds the friction element and the offsets."""
        j = self.scene.joints[name]
        kind = REGISTRY[j.type]
        a, b = sides_of(self.scene, j)
        frames = [frame(s.axis, s.reference) for s in (a, b)]
        pitch = self.table.own(f"joints.{name}.pitch", j.pitch or 0.0, "m") if kind.pitched else None
        stiffness = self.table.own(f"joints.{name}.stiffness", j.stiffness, "N/m") if j.stiffness is not None else None
        roller = self.table.own(f"joints.{name}.roller", j.roller, "m") if j.roller is not None else 0.0
        return Joint(
            name, j.type, self.index[a.body], self.index[b.body],
            self.relative(a.body, a.named or f"joints.{name}.inboard.point", a.point),
            self.relative(b.body, b.named or f"joints.{name}.outboard.point", b.point),
            frames[0], frames[1], fit(j), pitch, self.devices.joint(name, j), None, name in self.spanning.cut,
            stiffness=stiffness, wheels=wheels(self.scene, self.table, self.stands, name) if kind.rolls else None,
            length=self.length(name) if kind.keeps_distance else None,
            unilateral=self.devices.unilateral(name, j, j.unilateral) if j.unilateral else None,
            profile=profile(j.profile, roller, j.internal) if j.profile else None,
            curve=curve(j.curve, roller) if j.curve else None, slot=self.devices.slot(name, j.slot) if j.slot else None,
        )

    def length(self, name: str) -> Param:
        """The length of a rod. If the length follows from the poses of bodies, the length depends on every number of these
        poses."""
        j = self.scene.joints[name]
        made = self.table.own if j.length is not None else self.table.scalar
        return made(f"joints.{name}.length", rod_length(self.scene, j) or 0.0, "m")

    def place(self, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
        """The joints with the data that depend on their order: children, friction elements, and offsets of coordinates, rates and
        constraint rows."""
        q = v = rows = eta = flag = 0
        out = []
        for n, j in enumerate(joints):
            new = replace(j, q0=q, v0=v, rows=rows)
            if j.cut:
                rows += j.kind.rows
            else:
                _, child, forward = self.spanning.tree[n]
                new = replace(new, child=self.index[child], forward=forward)
                q += len(state_coordinates(new))
                v += len(new.free)
            if self.scene.joints[j.name].friction is not None:
                e = element(self.scene, self.devices, new, eta, flag)
                new = replace(new, friction=e)
                eta += j.kind.nv
                flag += len(e.sliders)
            out.append(new)
        return tuple(out)


__all__ = ["Built", "Param", "build"]
