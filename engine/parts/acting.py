"""Columns of what acts along joints' freedoms and between points: drives, springs, dampers, stops, efforts."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING

from engine.parts.blocks import Closed, Moving
from engine.parts.joining import ends
from engine.parts.scene import Scene
from engine.parts.store import small
from engine.parts.tape import Block, Space, Tape
from engine.system.structure import Device, Joint, System

BUSHING = ("offset", "turn", "force", "torque", "power")
"""Columns of a bushing, three each but the last."""


class DeviceRows:
    """A part of ``Rows``, which has all that stands below as such."""

    if TYPE_CHECKING:
        scene: Scene
        system: System
        tape: Tape
        once: Callable[[Hashable, int, Callable[[Block], None]], Block]
        joint: Callable[[str], tuple[Joint, Moving | Closed]]
        moving: Callable[[], list[Moving]]
        reactions: Callable[[], list[Block]]
        _qd: Callable[[str, int], Block]
        _sum: Callable[..., Block]

    def _drive(self, name: str, k: int) -> Block:
        j, m = self.joint(name)
        assert isinstance(m, Moving)
        N = self.reactions()[j.child]
        return self.once(("drive", name, k), 1, lambda out: self.scene.drive_effort(self.tape, j, k, m, N, out))

    def _device(self, name: str, k: int, field: str) -> Block:
        j, m = self.joint(name)
        found = next((d, q, v) for i, d, q, v in self.scene.each_device(j, m.q, m.v) if i == k)

        def force(out: Block) -> None:
            d, q, rate = found
            if d.effort is not None and field == "effort":
                self.tape.copy(self.scene.value(self.tape, d.effort, self.tape.scratch_block), out)
                return
            self.tape.zero(out)
            if field == "motor":
                self.scene.motor(self.tape, d, rate, out)
                return
            self.scene.device(self.tape, Device(**{field: getattr(d, field)}), "force", q, rate, out)

        return self.once(("device", name, k, field), 1, force)

    def _latched(self, name: str, k: int) -> Block:
        latch = self.joint(name)[0].devices[k].latch
        assert latch is not None
        return Block(Space.X, self.system.external.stop(self.system.hook(latch.hook)), 1)

    def _power(self, name: str, k: int, field: str) -> Block:
        effort = self._drive(name, k) if field == "drive" else self._device(name, k, field)
        return self._sum(f"power of {field} {name} {k}", [(effort, 1)], self._qd(name, k))

    def _line(self, i: int, what: str) -> Block:
        load, moving = self.system.loads[i], self.moving()
        three = self.once(("line", i), 3, lambda out: self.scene.call(
            self.tape, small.spring("line"), out=out, **ends(self.scene, load, moving)))  # fmt: skip
        return three.part(("length", "force", "power").index(what), 1)

    def _bushing(self, i: int, what: str, k: int) -> Block:
        load, moving = self.system.loads[i], self.moving()
        size = 3 * len(BUSHING) - 2
        all_of = self.once(("bushing", i), size, lambda out: self.scene.call(
            self.tape, small.bushing("state"), out=out, **ends(self.scene, load, moving)))  # fmt: skip
        return all_of.part(3 * BUSHING.index(what) + k, 1)
