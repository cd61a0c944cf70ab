"""Springs, dampers, end stops, efforts, motors, latches and drives of joints, and signals, as leaves of the parameter table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.monotone_curves import filled
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.data_classes.joint_couplings import Slot as SlotKeys
from trunnion.scene.data_classes.unilateral_contact import Unilateral as UnilateralKeys
from trunnion.scene.force_laws import registry as force_laws
from trunnion.scene.signals.registry import given
from trunnion.scene.signals.table import Table
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.numbers_with_units import Quantity
from trunnion.system.construction.point_curve_spline import curve
from trunnion.system.structure.bodies_and_joints import Device, Latch, LawForce, Motor, Signal, Stop
from trunnion.system.structure.coupling_joint_data import Slot, Unilateral
from trunnion.system.structure.parameter_table import Leaf, Leaves, ParameterTable

FIELDS = ("spring", "damping", "rotor_inertia", "end_stops", "effort", "drive", "motor", "latch", "nonlinear")

ENDLESS = 1e300
"""Replaces infinity for the largest force of a latch, and for the limit of a signal, if the scene gives none."""


class Builder:
    """Makes the devices of all joints, collects the tables of signals, and counts the flags of end stops and the hooks of
    latches."""

    def __init__(self, scene: sm.Scene, table: ParameterTable):
        self.scene, self.table = scene, table
        self.tables: list[tuple[str, sm.Table | sm.Input]] = [("input", i) for i in scene.inputs.values()]
        """Pairs of a word and data: "input" or "tracked" for every external input, then "drive" or "load" for every table signal.
        An input that prescribes a motion is "tracked": the motion follows the input smoothly."""
        self.stops = self.hooks = 0
        self.inputs = {n: i for i, n in enumerate(scene.inputs)}

    def joint(self, name: str, j: sm.Joint) -> tuple[Device, ...]:
        """The devices of a joint: a ``Device`` for each freedom."""
        kind = REGISTRY[j.type]
        return tuple(self.device(name, j, k, not kind.turns(k)) for k in range(kind.nv))

    def device(self, name: str, j: sm.Joint, k: int, slides: bool) -> Device:
        """The devices along freedom k of a joint, as leaves with the paths of the scene. slides: whether the freedom is a
        translation; the units depend on this flag."""
        u, f = ("m", "N") if slides else ("rad", "N*m")
        s = self.table.own

        def mine(field: str) -> tuple[str, Any]:
            value = getattr(j, field)
            if isinstance(value, tuple):
                return f"joints.{name}.{field}[{k + 1}]", value[k]
            return f"joints.{name}.{field}", value

        (ps, spring), (pd, damping), (pi, inertia), (pt, stops) = map(mine, FIELDS[:4])
        (pe, effort), (pv, drive), (pm, motor), (pl, latch), (pn, nonlinear) = map(mine, FIELDS[4:])
        return Device(
            spring=None if spring is None else (
                s(f"{ps}.stiffness", spring.stiffness, f"{f}/{u}"), s(f"{ps}.rest", spring.rest, u)),
            damping=None if damping is None else s(pd, damping, f"{f}*s/{u}"),
            inertia=None if inertia is None else s(pi, inertia, "kg" if slides else "kg*m^2"),
            stop=None if stops is None else self.stop(pt, at_ends(j, stops), u, f),
            effort=None if effort is None else self.load(pe, effort, f),
            drive=None if drive is None else self.drive(pv, drive, u),
            motor=None if motor is None else Motor(
                s(f"{pm}.stall", motor.stall, f), s(f"{pm}.no_load", motor.no_load, f"{u}/s"),
                self.load(f"{pm}.signal", motor.signal, "1")),
            latch=None if latch is None else self.latch(pl, latch, u, f),
            nonlinear=None if nonlinear is None else self.nonlinear(pn, nonlinear, u, f),
        )

    def nonlinear(self, path: str, group: sm.Nonlinear, x: str, f: str) -> tuple[LawForce, ...]:
        """The nonlinear springs and dampers of a freedom or of the line between two points. x, f: units of the coordinate and of
        the force."""
        out = []
        for law, data in force_laws.given(group):
            named = [(f"{path}.{law.key}{own}", value) for own, value in law.numbers(data)]
            leaves = (self.table.own(name, value, law.unit(word_of(name), x, f)) for name, value in named)
            out.append(LawForce(law.key, tuple(leaves)))
        return tuple(out)

    def constants(self, path: str, numbers: Sequence[float]) -> Leaves:
        """The constant parts of a formula. path: path of the formula's group."""
        units = [(unit_of(n.dimension) if isinstance(n, Quantity) else "") or "1" for n in numbers]
        return tuple(self.table.own(f"{path}.numbers[{i + 1}]", n, u) for i, (n, u) in enumerate(zip(numbers, units, strict=True)))

    def stop(self, path: str, st: sm.EndStops, u: str, f: str) -> Stop:
        """The end stops of a freedom, with the indices of their flags (1 while engaged)."""
        flags = [-1, -1]
        bounds: list[Leaf | None] = []
        for side, bound in enumerate((st.lower, st.upper)):
            if bound is None:
                bounds.append(None)
                continue
            flags[side] = self.stops
            self.stops += 1
            bounds.append(self.table.own(f"{path}.{('lower', 'upper')[side]}", bound, u))
        return Stop(
            self.table.own(f"{path}.stiffness", st.stiffness, f"{f}/{u}"),
            self.table.own(f"{path}.damping", st.damping, f"s/{u}"),
            bounds[0], bounds[1], (flags[0], flags[1]),
        )

    def unilateral(self, name: str, j: sm.Joint, x: UnilateralKeys) -> Unilateral:
        """The contact of a joint that only pushes, with the indices of its flags."""
        free = x.thickness is not None or (j.slot is not None and j.slot.mouth is not None)
        flag, self.stops = self.stops, self.stops + 1 + free
        path, own = f"joints.{name}.unilateral", self.table.own
        thick = ENDLESS if x.thickness is None else own(f"{path}.thickness", x.thickness, "m")
        restitution, inside = own(f"{path}.restitution", x.restitution, "1"), flag + 1 if free else -1
        return Unilateral(restitution, flag, x.impact_law == "poisson", x.starts == "open", inside, thick)

    def slot(self, name: str, x: SlotKeys) -> Slot:
        """The walls of a slot."""
        start, end = (float(x.mouth in (end, "both")) for end in ("start", "end"))
        return Slot(self.table.own(f"joints.{name}.slot.play", x.play, "m"), (start, end), float(x.repeated))

    def latch(self, path: str, x: sm.Latch, u: str, f: str) -> Latch:
        """The latch of a freedom, with the indices of its flag and hook."""
        s, self.stops, self.hooks = self.table.own, self.stops + 1, self.hooks + 1
        holds: Leaf = ENDLESS if x.holds is None else s(f"{path}.holds", x.holds, f)
        return Latch(
            s(f"{path}.at", x.at, u), 1.0 if x.keeps == "above" else -1.0, s(f"{path}.stiffness", x.stiffness, f"{f}/{u}"),
            s(f"{path}.damping", x.damping, f"s/{u}"), holds, self.load(f"{path}.release", x.release, "1"),
            self.stops - 1, self.hooks - 1, int(x.down), 0.0 if x.pitch is None else s(f"{path}.pitch", x.pitch, u),
        )  # fmt: skip

    def load(self, path: str, value: sm.Load, unit: str) -> Signal:
        """A load as a function of time: a number, an input or a signal."""
        if isinstance(value, sm.FromInput):
            index = self.inputs[value.input]
            return Signal("table", index=index) if value.curve is None else self.through(f"{path}.curve", value.curve, unit, index)
        if isinstance(value, sm.Signal):
            return self.signal(path, value, unit)
        return Signal("value", (self.table.own(path, value, unit),))

    def through(self, path: str, c: sm.InputCurve, unit: str, index: int) -> Signal:
        """A signal that is a function of an input: the value of a curve at the input's current value. index: table of the input."""
        at = [self.table.own(f"{path}.at[{i + 1}]", x, "1") for i, x in enumerate(c.at)]
        value = [self.table.own(f"{path}.value[{i + 1}]", x, unit) for i, x in enumerate(c.value)]
        return Signal("through", (*filled(at), *filled(value)), index)

    def component(self, path: str, value: sm.Load, unit: str) -> Signal | None:
        """A component of a load vector. None if the scene gives exactly 0; the generated code then has no terms for this
        component."""
        if isinstance(value, float | int):
            leaf: Leaf = self.table.component(path, float(value), unit)
            return None if leaf == 0.0 else Signal("value", (leaf,))
        return self.load(path, value, unit)

    def drive(self, path: str, d: sm.Drive, unit: str) -> Signal:
        """A prescribed motion as a function of time."""
        if d.input is not None:
            index = self.inputs[d.input]
            self.tables[index] = ("tracked", self.tables[index][1])
            return Signal("table", index=index)
        kind, data = given(d)
        made: Signal = kind.signal(data, SignalLeaves(self, f"{path}.{kind.key}", unit, f"{unit}/s", "drive"))
        return made

    def signal(self, path: str, s: sm.Signal, unit: str) -> Signal:
        """A load's signal as a function of time."""
        kind, data = given(s)
        made: Signal = kind.signal(data, SignalLeaves(self, f"{path}.{kind.key}", unit, unit, "load", s.limit is not None))
        if s.limit is None:
            return made
        ends = (("lower", s.limit.lower, -ENDLESS), ("upper", s.limit.upper, ENDLESS))
        leaves = (other if x is None else self.table.kink(f"{path}.limit.{key}", x, unit) for key, x, other in ends)
        return Signal("limit", tuple(leaves), of=made)


@dataclass(frozen=True)
class SignalLeaves:
    """Makes the leaves of one signal. path: path of the signal's keys. unit: unit of the values. rate: unit of the rates, for
    drives. use: "drive" or "load". limited: whether the signal has limits; the times at which the signal passes a limit then depend
    on each number of the signal."""

    builder: Builder
    path: str
    unit: str
    rate: str
    use: str
    limited: bool = False

    def own(self, key: str, value: float, unit: str = "") -> Leaf:
        """The leaf of a number. unit: by default, the unit of the signal."""
        table = self.builder.table
        return (table.kink if self.limited else table.own)(f"{self.path}.{key}", value, unit or self.unit)

    def kink(self, key: str, value: float, unit: str) -> Leaf:
        """The leaf of a number that moves times at which steps must end."""
        return self.builder.table.kink(f"{self.path}.{key}", value, unit)

    def signal(self, label: str, *leaves: Leaf, formula: tuple[Any, ...] = ()) -> Signal:
        """A signal with a label of its kind."""
        return Signal(label, leaves, formula=formula)

    def curve(self, table: Table) -> Signal:
        """The signal of a table."""
        self.builder.tables.append((self.use, table))
        return Signal("table", index=len(self.builder.tables) - 1)


def word_of(path: str) -> str:
    """The last word of a path, without an index."""
    return path.split(".")[-1].split("[")[0]


def at_ends(j: sm.Joint, stops: sm.EndStops) -> sm.EndStops:
    """The end stops of a joint. If a joint with a curve has stops without bounds, the stops are at both ends of the curve."""
    given = stops.lower is not None or stops.upper is not None
    if j.curve is None or given:
        return stops
    length = curve(j.curve).length
    assert isinstance(length, float)
    return replace(stops, lower=0.0, upper=length)
