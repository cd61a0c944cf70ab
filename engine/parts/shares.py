"""The scaled reactions of joints on loops, which decide what redundant loops leave open (``recursion.redundancy``), as calls of
parts."""

from __future__ import annotations

from collections.abc import Callable

from engine.contact import REGISTRY as CONTACTS
from engine.parts.blocks import Closed, Moving
from engine.parts.known import sized
from engine.parts.scene import Scene
from engine.parts.store import closing
from engine.parts.tables import BODY
from engine.parts.tape import Block, Builtin, Tape
from engine.system.loops import NO_SIZE, loop_joints, rows_of, rubs
from engine.system.structure import GROUND, Joint


class Shares:
    """Writes them behind tapes. size: how many they are."""

    def __init__(self, scene: Scene):
        self.scene, self.system = scene, scene.system
        self.joints, self.rubs = loop_joints(scene.system), rubs(scene.system)
        self.rows = dict(rows_of(scene.system))
        self.size = sum(self.rows.values())
        self._spins: dict[int, Block] = {}
        self._numbers: dict[str, Block] = {}
        self._arms = {j.name: self._arm(j) for j in self.joints} if self.rubs else {}

    def at(self, name: str) -> int:
        """Where those of a joint begin."""
        names = list(self.rows)
        return sum(self.rows[n] for n in names[: names.index(name)])

    def write(
        self, tape: Tape, where: dict[str, Moving | Closed], moving: list[Moving], ft: Callable[[Joint], Block | None], out: Block
    ) -> None:
        """All of them, from what each joint transmits to its outboard part (None: nothing)."""
        at = 0
        for j in self.joints:
            own = out.part(at, self.rows[j.name])
            at += own.size
            transmitted = ft(j)
            if transmitted is None:
                tape.zero(own)
            elif self.rubs:
                self._sprung(tape, j, where[j.name].pose, transmitted, own)
            else:
                self._weighed(tape, j, where[j.name], moving, transmitted, own)

    def _sprung(self, tape: Tape, j: Joint, pose: Block, ft: Block, out: Block) -> None:
        f = j.friction
        own = sized(f.contact) if f and CONTACTS[f.contact].count else ()
        found = [(name, f.number(name)) for name, _ in (f.numbers if f else ()) if f and name in own]
        sizes, leaves, soft = tuple(name for name, _ in found), [x for _, x in found], j.stiffness is not None
        part = closing.sprung(j.kind_name, j.fit, sizes, soft, j.driven)
        if j.name not in self._numbers:
            self._numbers[j.name] = self.scene.numbers([*leaves, *([j.stiffness] if j.stiffness is not None else [])])
        self.scene.call(tape, part, ft=ft, pose=pose, numbers=self._numbers[j.name], arm=self._arms[j.name], out=out)

    def _weighed(self, tape: Tape, j: Joint, here: Moving | Closed, moving: list[Moving], ft: Block, out: Block) -> None:
        point = self._point(tape, j, here)
        at = 0
        for body, sign in ((j.out, 1), (j.inb, -1)):
            if body == GROUND:
                continue
            n = self.scene.body_numbers[body]
            self.scene.call(
                tape, closing.weighed(sign), ft=ft, point=point, motion=moving[body].motion, numbers=n.part(n.size - BODY, BODY),
                spin=self.spin(body), out=out.part(at, 6),
            )  # fmt: skip
            at += 6

    def _point(self, tape: Tape, j: Joint, here: Moving | Closed) -> Block:
        """A joint's point on its outboard part, world (3)."""
        if isinstance(here, Closed):
            return here.blocks["point"]
        origin = here.motion.part(9, 3)
        if j.forward:
            return origin
        point = tape.scratch_block(3)
        tape.copy(origin, point)
        tape.call(Builtin.ADD, [here.pose.part(18, 3), point], [3])
        return point

    def spin(self, i: int) -> Block:
        """Half the trace of a body's inertia, kg m² (``springs.spin``)."""
        if i not in self._spins:
            self._spins[i] = self._spin(i)
        return self._spins[i]

    def _spin(self, i: int) -> Block:
        s, prepare, body = self.scene, self.scene.prepare, self.system.bodies[i]
        own, out = s.body_numbers[i], s.c_block(1)
        n = own.part(own.size - BODY, BODY)
        prepare.zero(out)
        if any(x != 0.0 for x in body.inertia[:3]):
            prepare.call(Builtin.PRODUCT, [n.part(4, 3), s.constant([0.5, 0.5, 0.5]), out], [3, 1])
            return out
        prepare.copy(s.constant([NO_SIZE]), out)
        if any(x != 0.0 for x in body.center):
            prepare.call(Builtin.PRODUCT, [n.part(1, 3), n.part(1, 3), out], [3, 1])
        else:
            for j in self.system.joints:
                for point, of in ((j.inb_point, j.inb), (j.out_point, j.out)):
                    if of == i:
                        p = s.numbers(point)
                        prepare.call(Builtin.PRODUCT, [p, p, out], [3, 1])
        prepare.call(Builtin.SCALE, [out, n.part(0, 1), out], [1])
        return out

    def _arm(self, j: Joint) -> Block:
        """Half length of the contacts of a joint without friction, m."""
        s, bodies = self.scene, [b for b in (j.out, j.inb) if b != GROUND]
        spins, masses, out = s.c_block(len(bodies)), s.c_block(len(bodies)), s.c_block(1)
        for k, b in enumerate(bodies):
            n = s.body_numbers[b]
            s.prepare.copy(self.spin(b), spins.part(k, 1))
            s.prepare.copy(n.part(n.size - BODY, 1), masses.part(k, 1))
        s.call(s.prepare, closing.arm(len(bodies)), spin=spins, mass=masses, out=out)
        return out

