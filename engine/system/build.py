"""Scene → System (structure), parameter table (run-time numbers) and the numbers of one run (start values, tables, scales)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from engine.basics.problems import SceneError
from engine.contact.base import OVERLAP
from engine.joints import REGISTRY
from engine.scene import model as sm
from engine.scene.mass import mass_properties
from engine.scene.poses import sides_of
from engine.scene.refs import body_of, named_point
from engine.system.cams import profile
from engine.system.devices import Builder
from engine.system.frames import frame
from engine.system.friction import element
from engine.system.leaves import Leaves, Param, ParameterTable
from engine.system.loads import load
from engine.system.mimics import ties
from engine.system.numbers import Numbers, numbers_of
from engine.system.paths import curve
from engine.system.spanning import Spanning, span
from engine.system.structure import GROUND, Body, Fit, Joint, System, state_coordinates
from engine.system.wheels import misfits, stands, wheels

INERTIA_NAMES = ("xx", "yy", "zz", "xy", "xz", "yz")


@dataclass(frozen=True)
class Built:
    """What a scene becomes: structure, run-time parameters, numbers of the run."""

    scene: sm.Scene
    system: System
    parameters: ParameterTable
    numbers: Numbers


def fit(j: sm.Joint) -> Fit:
    """Which part of a joint is inside, and which has the ends."""
    out = j.pin == "outboard"
    if j.ends is None or REGISTRY[j.type].slides_along < 0:  # parts that do not slide have theirs at one point
        return Fit(out)
    if j.ends == OVERLAP:
        return Fit(out, OVERLAP if j.friction is not None else "pin")
    return Fit(out, "pin" if j.ends == j.pin else "bearing")


def build(scene: sm.Scene) -> Built:
    """Reduce a checked scene to the data of its system. No symbolic expression is made here."""
    table = ParameterTable(scene.tunable)
    spanning = span(scene)
    maker = _Maker(scene, table, spanning)
    system = maker.system()
    return Built(scene, system, table, numbers_of(scene, system, maker.devices))


class _Maker:
    """Builds the parts of a system in order, and holds what they share: indices of bodies, their reference origins, devices,
    and the parameter table."""

    def __init__(self, scene: sm.Scene, table: ParameterTable, spanning: Spanning):
        self.scene, self.table, self.spanning = scene, table, spanning
        self.index = {"ground": GROUND, **{child: i for i, (_, child, _) in enumerate(spanning.tree)}}
        self.devices = Builder(scene, table)
        rolls = any(REGISTRY[scene.joints[n].type].rolls for n in spanning.cut)
        self.stands = stands(scene, spanning) if rolls else {}
        wrong = misfits(scene, spanning, self.stands) if rolls else []
        if wrong:
            raise SceneError(wrong)
        self.origin = {"ground": (0.0, 0.0, 0.0)}
        for name, child, forward in spanning.tree:
            j = scene.joints[name]
            self.origin[child] = sides_of(scene, j)[1 if forward else 0].point

    def system(self) -> System:
        """The whole structure."""
        gravity = self.table.vector("gravity", self.scene.gravity, "m/s^2")
        bodies = tuple(self.body(i, name, child) for i, (name, child, _) in enumerate(self.spanning.tree))
        names = [name for name, _, _ in self.spanning.tree] + list(self.spanning.cut)
        joints = tuple(self.joint(name) for name in names)
        joints = self.place(joints)
        loads = tuple(load(self, name, f) for name, f in self.scene.forces.items())
        ground = tuple((n, self.relative("ground", self.named("ground", n), p)) for n, p in self.scene.ground.points.items())
        return System(
            bodies, joints, loads, gravity, tuple(self.scene.inputs), len(self.devices.tables),
            self.devices.stops + self.devices.hooks, tuple(self.scene.outputs), ground,
            ties(self.scene, self.table, joints), self.devices.hooks, self.scene.simulation.realtime is not None,
        )

    # -- points -------------------------------------------------------------------------------------------------------------

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

    # -- parts --------------------------------------------------------------------------------------------------------------

    def body(self, i: int, joint: str, name: str) -> Body:
        """Body ``name``, number i in the tree, carried by ``joint``: its mass, centre and inertia as leaves."""
        b = self.scene.bodies[name]
        m, center, inertia = mass_properties(b)
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
        """A joint, still without its offsets in the state and among the constraint rows."""
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
            profile=profile(j.profile, roller) if j.profile else None, curve=curve(j.curve) if j.curve else None,
        )

    def place(self, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
        """The joints with what depends on their order: children, and offsets of coordinates, rates, constraint rows and
        friction multipliers."""
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
