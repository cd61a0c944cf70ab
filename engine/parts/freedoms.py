"""Signals, and what acts along the freedoms of joints, as calls of parts."""

from __future__ import annotations

from collections.abc import Iterable

from engine.parts.blocks import Place
from engine.parts.store import devices, small
from engine.parts.tables import Tables
from engine.parts.tape import Block, Space, Tape
from engine.system.structure import Device, Joint, Latch, Signal


class Freedoms(Tables):
    """The tables of a scene, with what acts along freedoms."""

    def motion(self, tape: Tape, s: Signal, place: Place) -> Block:
        """Position, rate and acceleration that a drive prescribes."""
        return self._signal(tape, s, place, True)

    def _signal(self, tape: Tape, s: Signal, place: Place, moves: bool) -> Block:
        if s.kind == "table":
            return Block(Space.X, self.system.external.table(s.index), 3)
        if s.kind == "value" and not moves:
            return self.numbers(s.leaves)
        out = place(3 if moves else 1)
        given = {"u": Block(Space.X, self.system.external.table(s.index), 1)} if s.kind == "through" else {}
        self.call(tape, small.signal(s.kind, moves), numbers=self.numbers(s.leaves), x=Block(Space.X, 0, 2), out=out, **given)
        return out

    def value(self, tape: Tape, s: Signal | None, place: Place) -> Block:
        """Value of the signal of a load or effort; none: zero."""
        return self.zeros.part(0, 1) if s is None else self._signal(tape, s, place, False).part(0, 1)

    def device(self, tape: Tape, d: Device, what: str, q: Block, rate: Block, out: Block) -> None:
        """Add the force, power or potential energy of a freedom's spring, damper, stops and latch, if it has any."""
        if d.latch is not None:
            places = self.latch(tape, d.latch)
            self.call(tape, devices.latch(what), q=q, rate=rate, out=out, **places)
        if d.spring is None and d.damping is None and d.stop is None:
            return
        stop, spring = d.stop, d.spring or (0.0, 0.0)
        ends = [0.0 if e is None else e for e in ((stop.lower, stop.upper) if stop else (None, None))]
        leaves = [*spring, d.damping or 0.0, *((stop.stiffness, stop.damping) if stop else (0.0, 0.0)), *ends]
        flags = self.zeros
        if stop:
            flags = tape.scratch_block(2)
            for k, bound in enumerate((stop.lower, stop.upper)):
                there = Block(Space.X, self.system.external.stop(stop.flags[k]), 1) if bound is not None else self.zeros
                tape.copy(there.part(0, 1), flags.part(k, 1))
        self.call(tape, devices.device(what), numbers=self.numbers(leaves), flags=flags, q=q, rate=rate, out=out)

    def latch(self, tape: Tape, x: Latch) -> dict[str, Block]:
        """Numbers and flags of a latch."""
        flags = tape.scratch_block(2)
        for at, flag in enumerate((self.system.hook(x.hook), x.pressed)):
            tape.copy(Block(Space.X, self.system.external.stop(flag), 1), flags.part(at, 1))
        return {"numbers": self.numbers([x.at, x.side, x.stiffness, x.damping, x.holds, x.pitch]), "flags": flags}

    def motor(self, tape: Tape, d: Device, rate: Block, out: Block) -> None:
        """Add the effort of a freedom's motor, if it has one."""
        if d.motor is not None:
            numbers, signal = self.numbers([d.motor.stall, d.motor.no_load]), self.value(tape, d.motor.signal, tape.scratch_block)
            self.call(tape, devices.motor(), numbers=numbers, signal=signal, rate=rate, out=out)

    def each_device(self, j: Joint, q: Block, v: Block) -> Iterable[tuple[int, Device, Block, Block]]:
        """Number, device, coordinate and rate of each freedom of a joint."""
        for k, d in enumerate(j.devices):
            i = j.kind.coordinate_of(k)
            yield k, d, q.part(i, 1) if i >= 0 else self.zeros, v.part(k, 1)

    @staticmethod
    def acts(j: Joint) -> bool:
        """Whether anything but a drive and friction acts along a joint's freedoms."""
        return any(d.spring or d.damping is not None or d.stop or d.effort or d.motor or d.latch for d in j.devices)
