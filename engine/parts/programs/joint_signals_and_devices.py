"""Signals and devices of joints, as calls of primitives."""

from __future__ import annotations

from collections.abc import Iterable

from trunnion.parts.bytecode.body_and_joint_slots import Allocate
from trunnion.parts.bytecode.program import Program, Slot, Space
from trunnion.parts.layout.load_operands import acts
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.parts.primitives.primitive_cache import force_laws, joint_devices, signals_loads_energies
from trunnion.parts.primitives.primitive_keys import Primitive
from trunnion.scene.signals.time_formulas import computed
from trunnion.system.structure.bodies_and_joints import Device, Joint, Latch, Signal


class JointForces(SceneTables):
    """Adds signals and devices to the tables of a scene."""

    def motion(self, program: Program, s: Signal, allocate: Allocate) -> Slot:
        """Position, rate and acceleration that a drive prescribes."""
        return self._signal(program, s, allocate, True)

    def _signal(self, program: Program, s: Signal, allocate: Allocate, moves: bool) -> Slot:
        if s.kind == "table":
            return Slot(Space.X, self.system.external.table(s.index), 3)
        if s.kind == "value" and not moves:
            return self.numbers(s.leaves)
        if s.kind == "expression":
            return self.formula(program, s, allocate, 3 if moves else 1)
        out = allocate(3 if moves else 1)
        if s.of is not None:
            u = self._signal(program, s.of, program.scratch_slot, False)
            self.call(program, signals_loads_energies.limit(), numbers=self.numbers(s.leaves), u=u.slice(0, 1), out=out)
            return out
        given = {"u": Slot(Space.X, self.system.external.table(s.index), 1)} if s.kind == "through" else {}
        self.call(
            program,
            signals_loads_energies.signal(s.kind, moves),
            numbers=self.numbers(s.leaves),
            x=Slot(Space.X, 0, 2),
            out=out,
            **given,
        )
        return out

    def formula(self, program: Program, s: Signal, allocate: Allocate, order: int = 1, at: Slot | None = None) -> Slot:
        """Value of a formula of time, or of the position ``at`` (3); with order 3, also its first two derivatives by time."""

        def call(primitive: Primitive, **operands: Slot) -> Slot:
            out = program.scratch_slot(order)
            self.call(program, primitive, **operands, out=out)
            return out

        def number(i: int) -> Slot:
            return self.numbers([s.leaves[i], 0.0, 0.0][:order])

        def variable(*which: int) -> Slot:
            if at is not None:
                return at.slice(which[0], 1)
            x = Slot(Space.X, 0, 2)
            return x.slice(0, 1) if order == 1 else call(signals_loads_energies.time(), x=x)

        def operation(what: str, *given: Slot) -> Slot:
            return call(signals_loads_energies.operation(what, order), **dict(zip("ab", given, strict=False)))

        found, out = computed(s.formula, number, variable, operation), allocate(order)
        program.copy(found, out)
        return out

    def value(self, program: Program, s: Signal | None, allocate: Allocate) -> Slot:
        """Value of the signal of a load or effort; zero if the signal is None."""
        return self.zeros.slice(0, 1) if s is None else self._signal(program, s, allocate, False).slice(0, 1)

    def device(self, program: Program, d: Device, what: str, q: Slot, rate: Slot, out: Slot) -> None:
        """Add the force, power or potential energy of a freedom's springs, dampers, stops and latch."""
        for law in d.nonlinear or ():
            if acts(law, what):
                numbers = self.numbers(law.leaves)
                self.call(program, force_laws.along_freedom(law.law, what), numbers=numbers, q=q, rate=rate, out=out)
        if d.latch is not None:
            operands = self.latch(program, d.latch)
            self.call(program, joint_devices.latch(what), q=q, rate=rate, out=out, **operands)
        if d.spring is None and d.damping is None and d.stop is None:
            return
        stop, spring = d.stop, d.spring or (0.0, 0.0)
        ends = [0.0 if e is None else e for e in ((stop.lower, stop.upper) if stop else (None, None))]
        leaves = [*spring, d.damping or 0.0, *((stop.stiffness, stop.damping) if stop else (0.0, 0.0)), *ends]
        flags = self.zeros
        if stop:
            flags = program.scratch_slot(2)
            for k, bound in enumerate((stop.lower, stop.upper)):
                there = Slot(Space.X, self.system.external.stop(stop.flags[k]), 1) if bound is not None else self.zeros
                program.copy(there.slice(0, 1), flags.slice(k, 1))
        self.call(program, joint_devices.device(what), numbers=self.numbers(leaves), flags=flags, q=q, rate=rate, out=out)

    def latch(self, program: Program, x: Latch) -> dict[str, Slot]:
        """Numbers and flags of a latch."""
        flags = program.scratch_slot(2)
        for at, flag in enumerate((self.system.hook(x.hook), x.pressed)):
            program.copy(Slot(Space.X, self.system.external.stop(flag), 1), flags.slice(at, 1))
        return {"numbers": self.numbers([x.at, x.side, x.stiffness, x.damping, x.holds, x.pitch]), "flags": flags}

    def motor(self, program: Program, d: Device, rate: Slot, out: Slot) -> None:
        """Add the effort of a freedom's motor."""
        if d.motor is not None:
            numbers, signal = (
                self.numbers([d.motor.stall, d.motor.no_load]),
                self.value(program, d.motor.signal, program.scratch_slot),
            )
            self.call(program, joint_devices.motor(), numbers=numbers, signal=signal, rate=rate, out=out)

    def each_device(self, j: Joint, q: Slot, v: Slot) -> Iterable[tuple[int, Device, Slot, Slot]]:
        """Index, device, coordinate and rate of each freedom of a joint that has a device."""
        for k, d in enumerate(j.devices):
            i = j.kind.coordinate_of(k)
            yield k, d, q.slice(i, 1) if i >= 0 else self.zeros, v.slice(k, 1)

    @staticmethod
    def acts(j: Joint) -> bool:
        """Whether devices act along a joint's freedoms, apart from drives and friction."""
        return any(d.spring or d.damping is not None or d.stop or d.effort or d.motor or d.latch or d.nonlinear for d in j.devices)
