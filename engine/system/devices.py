"""Springs, dampers, stops, efforts and drives of joints, and signals, as leaves."""

from __future__ import annotations

from engine.joints import REGISTRY
from engine.scene import model as sm
from engine.system.leaves import Leaf, ParameterTable
from engine.system.structure import Device, Signal, Stop

LENGTH, ANGLE = "length", "angle"


class Builder:
    """Makes devices joint by joint; collects tables and counts stop flags."""

    def __init__(self, scene: sm.Scene, table: ParameterTable):
        self.scene, self.table = scene, table
        self.tables: list[tuple[str, sm.Table]] = []
        """("spline" or "linear", data) of every table signal."""
        self.stops = 0
        self.inputs = {n: i for i, n in enumerate(scene.inputs)}

    def joint(self, name: str, j: sm.Joint) -> tuple[Device, ...]:
        """One Device a freedom."""
        kind = REGISTRY[j.type]
        columns = {d: _per_freedom(getattr(j, d), kind.nv) for d in ("spring", "damping", "stops", "effort", "drive")}
        out = []
        for k in range(kind.nv):
            path = f"joints.{name}" if kind.nv == 1 else f"joints.{name}[{k + 1}]"
            slides = not kind.columns[k][0].rot
            out.append(self.device(path, slides, **{d: c[k] for d, c in columns.items()}))
        return tuple(out)

    def device(self, path, slides, spring, damping, stops, effort, drive) -> Device:
        """Leaves of one freedom's devices; ``slides`` chooses the units."""
        u, f = ("m", "N") if slides else ("rad", "N*m")
        s = self.table.scalar
        return Device(
            spring=None if spring is None else (
                s(f"{path}.spring.stiffness", spring.stiffness, f"{f}/{u}"), s(f"{path}.spring.rest", spring.rest, u)),
            damping=None if damping is None else s(f"{path}.damping", damping, f"{f}*s/{u}"),
            stop=None if stops is None else self.stop(path, stops, u, f),
            effort=None if effort is None else self.load(f"{path}.effort", effort, f),
            drive=None if drive is None else self.drive(f"{path}.drive", drive, u),
        )

    def stop(self, path: str, st: sm.Stops, u: str, f: str) -> Stop:
        """Stops with their engagement flags."""
        flags, bounds = [-1, -1], []
        for side, bound in enumerate((st.lower, st.upper)):
            if bound is None:
                bounds.append(None)
                continue
            flags[side] = self.stops
            self.stops += 1
            bounds.append(self.table.scalar(f"{path}.stops.{('lower', 'upper')[side]}", bound, u))
        return Stop(
            self.table.scalar(f"{path}.stops.stiffness", st.stiffness, f"{f}/{u}"),
            self.table.scalar(f"{path}.stops.damping", st.damping, f"s/{u}"),
            bounds[0], bounds[1], (flags[0], flags[1]),
        )

    def load(self, path: str, value: sm.Load, unit: str) -> Signal:
        """A load: number, input or signal."""
        if isinstance(value, sm.FromInput):
            return Signal("input", index=self.inputs[value.input])
        if isinstance(value, sm.Signal):
            return self.signal(path, value, unit, "linear")
        return Signal("value", (self.table.scalar(path, value, unit),))

    def component(self, path: str, value: sm.Load, unit: str) -> Signal | None:
        """A component of a load vector; exactly 0 is structural."""
        if isinstance(value, float | int):
            leaf: Leaf = self.table.component(path, float(value), unit)
            return None if leaf == 0.0 else Signal("value", (leaf,))
        return self.load(path, value, unit)

    def drive(self, path: str, d: sm.Drive, unit: str) -> Signal:
        """A prescribed motion."""
        if d.constant is not None:
            s = self.table.scalar
            return Signal("rate", (s(f"{path}.constant.start", d.constant.start, unit),
                                   s(f"{path}.constant.rate", d.constant.rate, f"{unit}/s")))
        return self.signal(path, d, unit, "spline")

    def signal(self, path: str, d: sm.Drive | sm.Signal, unit: str, interpolation: str) -> Signal:
        """Ramp, harmonic or table."""
        s = self.table.scalar
        if d.ramp is not None:
            r = d.ramp
            rate = f"{unit}/s" if interpolation == "spline" else unit
            return Signal("ramp", (
                s(f"{path}.ramp.start", r.start, rate), s(f"{path}.ramp.end", r.end, rate), s(f"{path}.ramp.begin", r.begin, "s"),
                s(f"{path}.ramp.duration", r.duration, "s"), s(f"{path}.ramp.origin", r.origin, unit)))
        if d.harmonic is not None:
            h = d.harmonic
            return Signal("harmonic", (
                s(f"{path}.harmonic.amplitude", h.amplitude, unit), s(f"{path}.harmonic.frequency", h.frequency, "Hz"),
                s(f"{path}.harmonic.phase", h.phase, "rad"), s(f"{path}.harmonic.offset", h.offset, unit)))
        assert d.table is not None, path
        self.tables.append((interpolation, d.table))
        return Signal("table", index=len(self.tables) - 1)


def _per_freedom(value, n: int) -> tuple:
    """A device field as a tuple with one entry a freedom."""
    if isinstance(value, tuple):
        return value
    return (value,) * n if n <= 1 else (None,) * n if value is None else (value,) * n
