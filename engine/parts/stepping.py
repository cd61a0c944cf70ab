"""Tapes of the functions by which a scene is stepped: the maps of the multipliers, and the accelerations once they are known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from engine.kernel.classes import HANDED
from engine.kernel.powers import GIVING
from engine.parts import friction, small
from engine.parts.columns import Columns
from engine.parts.scene import Scene
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.recursion.elements import Element, any_sets, elements
from engine.system.structure import GROUND, Joint, state_coordinates


@dataclass
class Maps:
    """Where the parts of the maps block of a tree begin (``kernel.main_unit``), and how long it is."""

    nn: int
    ne: int
    nrates: int
    held: bool

    @property
    def rates(self) -> int:
        """Rates of the freedoms of frictional joints."""
        return self.nn * (1 + self.ne)

    @property
    def size(self) -> int:
        """All."""
        return self.rates + self.nrates + (self.ne * (1 + self.ne) if self.held else 0)


class Stepping:
    """Writes stage 1 and stage 2 of a tree. quadratures: whether each power is integrated, or the sums for the audit."""

    def __init__(self, scene: Scene, quadratures: bool):
        self.scene, self.system, self.quadratures = scene, scene.system, quadratures
        self.parts = elements(self.system)
        s = self.system
        states = len(s.bristles)
        nrates = sum(e.joint.kind.nv for e in self.parts) + (states if self.parts else 0)
        self.maps = Maps(sum(len(e.needs) for e in self.parts), s.neta, nrates, any_sets(s))
        self.nw = 0
        n = len(s.bodies)
        tape = scene.tape("stage1")
        self.moving = scene.outward(tape, self._w)
        self.kept = [self._w(p.kept) for p in scene.parts]
        self.y, self.F = self._w(s.nv), [self._w(6) for _ in range(n)]
        self._inward(tape)
        if self.parts:
            self.columns = self._w(s.nv * s.neta)
            self._known(tape)
            Columns(self, tape, self.columns)
        second = scene.tape("stage2") if self.parts else tape
        if not self.parts:
            scene.tape("stage2")
        self._derivative(second)

    def _w(self, size: int) -> Block:
        self.nw += size
        return Block(Space.W, self.nw - size, size)

    def own(self, block: Block, j: Joint) -> Block:
        """A tree joint's part of numbers of all free rates."""
        return block.part(j.v0, len(j.free))

    def _inward(self, tape: Tape) -> None:
        s, n = self.scene, len(self.system.bodies)
        handed = [tape.scratch_block(HANDED) for _ in range(n + 1)]
        for h in handed:
            tape.zero(h)
        for i in reversed(range(n)):
            m, j = self.moving[i], self.system.tree[i]
            s.body_call(tape, i, "inward", work=m.work, kept=self.kept[i], handed=handed[i], force=m.force, effort=m.effort,
                        up=handed[s.parent(i)], y=self.own(self.y, j), F=self.F[i], known=m.known)  # fmt: skip

    def _accelerate(
        self, tape: Tape, y: Block, F: list[Block], function: str, bodies: Iterable[int], base: Block
    ) -> tuple[Block, list[Block], list[Block]]:
        """The pass outward from accelerations y: q̈ (nv), Ż and N of each body."""
        s, n = self.scene, len(self.system.bodies)
        qdd = tape.scratch_block(self.system.nv)
        Z, N = ([tape.scratch_block(6) for _ in range(n)] for _ in range(2))
        for i in bodies:
            m, j, parent = self.moving[i], self.system.tree[i], s.parent(i)
            s.body_call(tape, i, function, work=m.work, kept=self.kept[i], Z=base if parent == GROUND else Z[parent],
                        yc=self.own(y, j), fc=F[i], qdd=self.own(qdd, j), Zo=Z[i], N=N[i], known=m.known)  # fmt: skip
        return qdd, Z, N

    # -- maps ---------------------------------------------------------------------------------------------------------------

    def _known(self, tape: Tape) -> None:
        """N0, rates and Q0."""
        qdd, _, N = self._accelerate(tape, self.y, self.F, "accelerations", range(len(self.system.bodies)), self.scene.base)
        m = self.maps
        for e in self.parts:
            j, moving = e.joint, self.moving[e.joint.child]
            self.pin(tape, e, N[j.child], Block(Space.MAPS, e.n0, len(e.needs)))
            tape.copy(moving.v.part(0, j.kind.nv), Block(Space.MAPS, m.rates + e.rate0, j.kind.nv))
            if m.held:
                at = m.rates + m.nrates + e.eta[0]
                for k in range(j.kind.nv):
                    source = self.own(qdd, j).part(j.free.index(k), 1) if k in j.free else moving.known.part(k, 1)
                    tape.copy(source, Block(Space.MAPS, at + k, 1))
        states = len(self.system.bristles)
        at = m.rates + m.nrates - states
        tape.copy(Block(Space.Y, self.system.nq + self.system.nv, states), Block(Space.MAPS, at, states))

    def pin(self, tape: Tape, e: Element, N: Block, out: Block) -> None:
        """The needed components of f_c, m_c of a joint from N on its child."""
        j = e.joint
        part = small.pin(j.kind_name, j.forward, j.pin_out, e.needs)
        self.scene.call(tape, part, N=N, pose=self.moving[j.child].pose, out=out)

    # -- accelerations ------------------------------------------------------------------------------------------------------

    def _derivative(self, tape: Tape) -> None:
        system, s = self.system, self.scene
        nq, nv, nb = system.nq, system.nv, len(system.bristles)
        coordinate_rates(s, tape, Block(Space.Y, nq, nv), Block(Space.DY, 0, nq))
        y = self.y
        if self.parts:
            y = tape.scratch_block(nv)
            tape.call(Builtin.COMBINE, [self.y, self.columns, Block(Space.Z, 0, system.neta), y], [nv, system.neta, nv])
        every = range(len(system.bodies))
        qdd, Z, _ = self._accelerate(tape, y, [s.zeros for _ in every], "accelerations", every, s.base)
        tape.copy(qdd, Block(Space.DY, nq, nv))
        N = s.balance(tape, self.moving, Z) if nb or any(j.driven for j in system.tree) else []
        at = nq + nv
        for e in self.parts:
            if e.friction.bristles:
                self._drift(tape, e, N, Block(Space.DY, at, e.joint.kind.nv))
                at += e.joint.kind.nv
        self._powers(tape, N, at)

    def _drift(self, tape: Tape, e: Element, N: list[Block], out: Block) -> None:
        rows = tape.scratch_block(len(e.needs))
        self.pin(tape, e, N[e.joint.child], rows)
        part, v = friction.drift(friction.rubbing(e)), self.moving[e.joint.child].v
        self.scene.call(tape, part, N=rows, r=v, out=out, **element_places(self.scene, e))

    def _powers(self, tape: Tape, N: list[Block], at: int) -> None:
        """Powers behind the derivative, from place ``at`` on."""
        s, system = self.scene, self.system
        count = len(system.frictional) + 1 + GIVING
        each = [tape.scratch_block(1) for _ in range(count)]
        for out in each:
            tape.zero(out)
        for e, out in zip(self.parts, each, strict=False):
            v, nv = self.moving[e.joint.child].v, e.joint.kind.nv
            tape.call(Builtin.PRODUCT, [Block(Space.Z, e.eta[0], nv), v, out], [nv, -1])
        damping, drive, loads = each[-3:]
        for j in system.tree:
            m = self.moving[j.child]
            for k, d, q, rate in s.each_device(j, m):
                s.device(tape, d, "power", q, rate, damping)
                if d.effort:
                    tape.call(Builtin.PRODUCT, [s.value(tape, d.effort, tape.scratch_block), rate, loads], [1, 1])
                if d.drive:
                    effort = tape.scratch_block(1)
                    s.drive_effort(tape, j, k, m, N[j.child], effort)
                    tape.call(Builtin.PRODUCT, [effort, rate, drive], [1, 1])
        for load in system.loads:
            if load.kind == "spring_damper":
                s.call(tape, small.spring("power"), out=damping, **s.ends(load, self.moving))
            else:
                places = s.applied(tape, load, self.moving[load.bodies[0]], tape.scratch_block)
                s.call(tape, small.load(load.kind, load.body_frame, "power"), out=loads, **places)
        groups = [[x] for x in each] if self.quadratures else [each[:-GIVING], each[-GIVING:]]
        for i, group in enumerate(groups):
            out = Block(Space.DY, at + i, 1)
            tape.copy(group[0], out)
            for x in group[1:]:
                tape.call(Builtin.ADD, [x, out], [1])


def element_places(s: Scene, e: Element) -> dict[str, Block]:
    """Numbers, modes and (of a law with bristles) states of an element, as its parts are handed them while stepping."""
    f, system = e.friction, s.system
    modes = Block(Space.X, system.external.mode(f.sliders[0].flag), 0)
    out = {"numbers": s.numbers([x for _, x in f.numbers]), "modes": modes}
    if f.bristles:
        out["b"] = Block(Space.Y, system.nq + system.nv + system.bristles.index(e.eta[0]), 0)
    return out


def coordinate_rates(s: Scene, tape: Tape, v: Block, out: Block) -> None:
    """q̇ of all coordinates that are states."""
    for j in s.system.tree:
        states, own = state_coordinates(j), v.part(j.v0, len(j.free))
        quaternion = j.kind.quaternion
        plain = [i for i in states if quaternion < 0 or i < quaternion]
        if plain:
            rates = [next(k for k in range(j.kind.nv) if j.kind.coordinate_of(k) == i) for i in plain]
            tape.call(Builtin.PICK, [own, out.part(j.q0, len(plain))], [len(plain), *[j.free.index(k) for k in rates]])
        if quaternion >= 0:
            at = j.q0 + states.index(quaternion)
            spin = own.part(j.free.index(j.kind.nv - 3), 3)
            s.call(tape, small.quaternion(), q=Block(Space.Y, at, 4), spin=spin, out=out.part(at, 4))
