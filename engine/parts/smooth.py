"""Accelerations of a scene under given multipliers, and how they change along directions.

Accelerations are known once they are found by the recursion; what their derivatives are follows from the balance of each body: its
derivative at fixed accelerations is what drives the same recursion once more (METHOD, "Jacobians on parts")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from engine.kernel.records import HANDED, MOTION
from engine.parts.blocks import ALONG, Closed, Moving
from engine.parts.directions import Directions
from engine.parts.known import POSE, Carried
from engine.parts.scene import Scene
from engine.parts.store import inverse, tangents
from engine.parts.tables import BODY, Tables
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.elements import elements
from engine.system.structure import GROUND, Joint

COUNTERPARTS = ("outward", "moved", "carry")
"""Functions of a body that have one in ``inverse``."""


class Smooth(Scene):
    """A scene whose bodies are walked by functions that have tangents."""

    def work(self, i: int) -> int:
        return inverse.outward(self.still_part(i)).sizes["work"]

    def still_part(self, i: int) -> Carried:
        """Which part body i is one of, without rotors, which its motion and its balance do not know."""
        return replace(self.which[i], rotors=False)

    def body_call(self, tape: Tape, i: int, function: str, **places: Block) -> None:
        if function == "weigh":
            n = self.body_numbers[i]
            self.call(tape, inverse.weigh(1), numbers=n.part(n.size - BODY, BODY), **places)
        elif function in COUNTERPARTS:
            self.call(tape, getattr(inverse, function)(self.still_part(i)), numbers=self.body_numbers[i], **places)
        else:
            super().body_call(tape, i, function, **places)

    def reduced_call(self, tape: Tape, i: int, function: str, **places: Block) -> None:
        """Call a function of body i's part by which accelerations are found."""
        Tables.body_call(self, tape, i, function, **places)


class Moved:
    """Writes motions, q̈, Ż and N behind a tape, and follows ``directions`` through them.

    active: rows of cut joints that have a multiplier; redundant: what cut joints transmit is asked for, too."""

    def __init__(self, scene: Smooth, tape: Tape, active: Sequence[int], directions: Directions, redundant: bool):
        self.scene, self.system, self.tape, self.directions = scene, scene.system, tape, directions
        self.active, self.parts = tuple(active), elements(scene.system)
        self.rows = {row: i for i, row in enumerate(self.active)}
        scene.multipliers = len(self.active)
        scene.bare = not self.system.neta and not redundant
        self.moving = scene.outward(tape, tape.scratch_block)
        self.closed = scene.closed(tape, self.moving, tape.scratch_block)
        self._push()
        self.efforts = [self._effort(j, m) for j, m in zip(self.system.tree, self.moving, strict=True)]
        count = len(self.system.bodies)
        self.qdd = tape.scratch_block(self.system.nv)
        self.Z, self.N = ([tape.scratch_block(6) for _ in range(count)] for _ in range(2))
        self._accelerate()
        self._follow()

    def own(self, block: Block, j: Joint) -> Block:
        """A tree joint's part of numbers of all free rates."""
        return block.part(j.v0, len(j.free))

    # -- what acts ----------------------------------------------------------------------------------------------------------

    def _push(self) -> None:
        """Forces of multipliers of cut joints on their bodies."""
        for c in self.closed:
            for b, g in c.ends:
                if b != GROUND:
                    self.add_wrenches(c, g, self.scene.force_on(self.tape, b, self.moving, self.tape.scratch_block))

    def add_wrenches(self, c: Closed, g: str, out: Block) -> None:
        """Add the wrenches of a cut joint's multipliers and of its friction (opposite to η)."""
        for k in range(c.joint.kind.rows):
            if c.joint.rows + k in self.rows:
                z = Block(Space.Z, self.rows[c.joint.rows + k], 1)
                self.tape.call(Builtin.ALONG, [c.row(g, k), z, out], [6, 1])
        if c.joint.friction:
            self.tape.call(Builtin.ALONG, [c.blocks[ALONG[g]], self._against(c.joint), out], [6, c.joint.kind.nv])

    def _against(self, j: Joint) -> Block:
        """−η of a joint."""
        out = self.tape.scratch_block(j.kind.nv)
        self.tape.call(Builtin.SCALE, [self.scene.eta(j), self.scene.against, out], [j.kind.nv])
        return out

    def _effort(self, j: Joint, m: Moving) -> Block:
        """Forces along all freedoms of a tree joint, friction among them."""
        if not j.friction:
            return m.effort
        out = self._against(j)
        if self.scene.acts(j):
            self.tape.call(Builtin.ADD, [m.effort, out], [j.kind.nv])
        return out

    # -- accelerations ------------------------------------------------------------------------------------------------------

    def _accelerate(self) -> None:
        """q̈, Ż and N by the recursion."""
        tape, s, count = self.tape, self.scene, len(self.system.bodies)
        self.work = [tape.scratch_block(p.sizes["work"]) for p in s.parts]
        self.kept = [tape.scratch_block(p.sizes["kept"]) for p in s.parts]
        handed = [tape.scratch_block(HANDED) for _ in range(count + 1)]
        y, F = tape.scratch_block(self.system.nv), [tape.scratch_block(6) for _ in range(count)]
        again = [tape.scratch_block(size) for size in (MOTION, POSE, 6)]
        for h in handed:
            tape.zero(h)
        for i, m in enumerate(self.moving):
            carrier = s.ground if s.parent(i) == GROUND else self.moving[s.parent(i)].motion
            s.reduced_call(tape, i, "outward", q=m.q, v=m.v, known=m.known, carrier=carrier, work=self.work[i], motion=again[0],
                           pose=again[1], bias=again[2])  # fmt: skip
        for i in reversed(range(count)):
            m, j = self.moving[i], self.system.tree[i]
            s.reduced_call(tape, i, "inward", work=self.work[i], kept=self.kept[i], handed=handed[i], force=m.force,
                           effort=self.efforts[i], up=handed[s.parent(i)], y=self.own(y, j), F=F[i], known=m.known)  # fmt: skip
        for i, (j, m) in enumerate(zip(self.system.tree, self.moving, strict=True)):
            Z, known = self._carrier(i, self.Z), m.known
            s.reduced_call(tape, i, "accelerations", work=self.work[i], kept=self.kept[i], Z=Z, yc=self.own(y, j), fc=F[i],
                           qdd=self.own(self.qdd, j), Zo=self.Z[i], N=self.N[i], known=known)  # fmt: skip

    def _carrier(self, i: int, Z: list[Block]) -> Block:
        parent = self.scene.parent(i)
        return self.scene.base if parent == GROUND else Z[parent]

    def _follow(self) -> None:
        """What the balances of bodies (``less``) and joints (``along``) lack when a direction is followed at fixed
        accelerations, and how accelerations follow that."""
        tape, s, count = self.tape, self.scene, len(self.system.bodies)
        fixed, less = ([tape.scratch_block(6) for _ in range(count)] for _ in range(2))
        along, ground = tape.scratch_block(self.system.nv), tape.scratch_block(6)
        tape.zero(ground)
        for i, (j, m) in enumerate(zip(self.system.tree, self.moving, strict=True)):
            s.body_call(tape, i, "moved", work=m.work, Z=self._carrier(i, fixed), qdd=self.own(self.qdd, j), Zo=fixed[i])
            tape.zero(less[i])
            all_of, own = s.body_numbers[i], self.own(along, j)
            n = all_of.part(all_of.size - BODY, BODY)
            s.call(tape, inverse.weigh(-1), numbers=n, motion=m.motion, force=m.force, Z=fixed[i], N=less[i])
            if own.size:
                tape.call(Builtin.PICK, [self.efforts[i], own], [own.size, *j.free])
            for at, k in enumerate(j.free):
                rotor = j.devices[k].inertia
                if rotor is not None:
                    tape.call(Builtin.PRODUCT, [s.numbers([rotor]), self.own(self.qdd, j).part(at, 1), own.part(at, 1)], [1, -1])
        for i, (j, m) in enumerate(zip(self.system.tree, self.moving, strict=True)):
            up = less[s.parent(i)] if s.parent(i) != GROUND else ground
            s.call(tape, inverse.turned(s.still_part(i)), work=m.work, N=self.N[i], up=up, along=self.own(along, j))
        self.directions.follow(tape)
        self._solve(self.directions, fixed, less, along)

    def _solve(self, d: Directions, fixed: list[Block], less: list[Block], along: Block) -> None:
        """The vectors beside q̈, Ż and N: the recursion with what the balances lack as forces."""
        tape, s, count = self.tape, self.scene, len(self.system.bodies)
        y, fq = tape.scratch_block(self.system.nv), tape.scratch_block(self.system.nv)
        Z, nothing = [tape.scratch_block(6) for _ in range(count)], tape.scratch_block(6)
        for i in reversed(range(count)):
            j, up = self.system.tree[i], less[s.parent(i)] if s.parent(i) != GROUND else nothing
            spots = {"effort": self.own(along, j), "fc": less[i], "yc": self.own(y, j), "fq": self.own(fq, j), "up": up}
            self._linear(d, i, "column", spots, ("effort", "fc"), ("yc", "fq"), ("up",))
        for i in range(count):
            j, before = self.system.tree[i], Z[s.parent(i)] if s.parent(i) != GROUND else s.zeros.part(0, 6)
            spots = {"Z": before, "yc": self.own(y, j), "fc": less[i], "qdd": self.own(self.qdd, j), "Zo": Z[i], "N": self.N[i]}
            self._linear(d, i, "response", spots, ("Z", "yc", "fc"), ("qdd", "Zo", "N"), ())
        for i in range(count):
            d.linear(Builtin.COPY, [(Z[i], True), (self.Z[i], True)], [Z[i]], [self.Z[i]], numbers=[6])
            d.linear(Builtin.ADD, [(fixed[i], True), (self.Z[i], True)], [fixed[i]], [], [self.Z[i]], numbers=[6])

    def _linear(self, d: Directions, i: int, function: str, spots: dict[str, Block], ins: Sequence[str], outs: Sequence[str],
                added: Sequence[str]) -> None:  # fmt: skip
        part, kept = tangents.solving(self.scene.which[i]), {"work": self.work[i], "kept": self.kept[i]}
        name = f"v{self.scene.which[i].name}_{function}"
        places = [(kept[n], False) if n in kept else (spots[n], True) for n in part.places[name]]
        read, written, summed = ([spots[n] for n in of] for of in (ins, outs, added))
        d.linear(self.scene.function(part, name), places, read, written, summed)
