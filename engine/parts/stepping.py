"""Tapes of the functions by which a scene is stepped: the maps of the multipliers, and the accelerations once they are known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from engine.kernel.records import HANDED
from engine.parts.apart import Apart
from engine.parts.blocks import Closed, Moving, Place
from engine.parts.columns import Columns
from engine.parts.known import rubbing
from engine.parts.maps import Maps
from engine.parts.places import coordinate_rates, element_places, lengths_of, write_span
from engine.parts.powers import write_powers
from engine.parts.scene import Scene
from engine.parts.shares import Shares
from engine.parts.store import closing, friction, small
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.coupling import fill
from engine.system.elements import Element, any_sets, elements
from engine.system.structure import GROUND, Joint


class Stepping:
    """Writes stage 1 and stage 2. active: rows of cut joints that have a multiplier; redundant: with the scaled reactions."""

    def __init__(self, scene: Scene, active: Sequence[int] = (), redundant: bool = False):
        self.scene, self.system = scene, scene.system
        self.parts, self.active = elements(self.system), tuple(active)
        s = self.system
        states = len(s.bristles)
        nrates = sum(e.joint.kind.nv for e in self.parts) + (states if self.parts else 0)
        self.shares = Shares(scene) if redundant else None
        shared = self.shares.size if self.shares else 0
        self.maps = Maps(len(self.active), s.neta, sum(len(e.needs) for e in self.parts), nrates, any_sets(s), shared)
        scene.multipliers = len(self.active)
        scene.bare = not s.neta and bool(fill(s, self.active).below)
        self.nw = 0
        tape = scene.tape("stage1")
        self.moving = scene.outward(tape, self._w)
        self.closed = scene.closed(tape, self.moving, self._w)
        self._closing = {c.joint.name: c for c in self.closed}
        self.begun = Tape([*tape.code], tape.scratch)
        self.kept = [self._w(p.sizes["kept"]) for p in scene.parts]
        self.y, self.F = self.write_inward(tape, [m.effort for m in self.moving], self._w)
        solved = self.maps.columns > 0
        if solved:
            self.asked = bool(self.parts or self.shares)
            if self.asked:
                self._known(tape)
            self._columns(tape)
        second = scene.tape("stage2") if solved else tape
        if not solved:
            scene.tape("stage2")
        self._derivative(second)

    def motion_of(self, j: Joint) -> tuple[Block, Block]:
        """Coordinates and rates of a joint, of the tree or a cut one."""
        found = self.closing(j) if j.cut else self.moving[j.child]
        return found.q, found.v

    def closing(self, j: Joint) -> Closed:
        """The blocks of a cut joint."""
        return self._closing[j.name]

    def _w(self, size: int) -> Block:
        self.nw += size
        return Block(Space.W, self.nw - size, size)

    def own(self, block: Block, j: Joint) -> Block:
        """A tree joint's part of numbers of all free rates."""
        return block.part(j.v0, len(j.free))

    def w_block(self, size: int) -> Block:
        """Numbers that other functions of the kernel are handed, too."""
        return self._w(size)

    def write_inward(
        self, tape: Tape, efforts: Sequence[Block], place: Place | None = None, forces: Sequence[Block] | None = None
    ) -> tuple[Block, list[Block]]:
        """The pass inward with these forces along the joints' freedoms (and on bodies): y (nv) and all forces on each body (6)."""
        s, n = self.scene, len(self.system.bodies)
        y, F = (place or tape.scratch_block)(self.system.nv), [(place or tape.scratch_block)(6) for _ in range(n)]
        handed = [tape.scratch_block(HANDED) for _ in range(n + 1)]
        for h in handed:
            tape.zero(h)
        for i in reversed(range(n)):
            m, j = self.moving[i], self.system.tree[i]
            s.body_call(tape, i, "inward", work=m.work, kept=self.kept[i], handed=handed[i], force=forces[i] if forces else m.force,
                        effort=efforts[i], up=handed[s.parent(i)], y=self.own(y, j), F=F[i], known=m.known)  # fmt: skip
        return y, F

    def accelerate(
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

    def _columns(self, tape: Tape) -> None:
        """Columns of all multipliers: those of loops that share few bodies by their structure."""
        if self.scene.bare:
            self.apart: Apart | None = Apart(self, tape)
            return
        self.apart, self.columns = None, self._w(self.system.nv * self.maps.columns)
        Columns(self, tape, self.columns)

    # -- maps ---------------------------------------------------------------------------------------------------------------

    def _known(self, tape: Tape) -> None:
        """N0, rates and Q0."""
        bodies = range(len(self.system.bodies))
        qdd, Z, N = self.accelerate(tape, self.y, self.F, "accelerations", bodies, self.scene.base)
        m = self.maps
        self.write_rates(tape)
        for e in self.parts:
            j, nv, own = e.joint, e.joint.kind.nv, m.N(-1).part(e.n0, len(e.needs))
            held = m.Q(-1).part(e.eta[0], nv) if m.held else self.scene.zeros
            if j.cut:
                self._known_of_cut(tape, e, Z, own, held)
                continue
            self.pin(tape, e, N[j.child], own)
            for k in range(nv if m.held else 0):
                known = self.moving[j.child].known
                tape.copy(self.own(qdd, j).part(j.free.index(k), 1) if k in j.free else known.part(k, 1), held.part(k, 1))
        if self.shares:
            ft = {j.name: self.transmitted(tape, j, N) for j in self.shares.joints}
            self.shares.write(tape, self.where(), self.moving, lambda j: ft[j.name], m.kappa(-1))

    def write_rates(self, tape: Tape) -> None:
        """Rates of the freedoms of frictional joints and states of their laws."""
        m, states = self.maps, len(self.system.bristles)
        for e in self.parts:
            nv = e.joint.kind.nv
            tape.copy(self.motion_of(e.joint)[1].part(0, nv), Block(Space.MAPS, m.at("rates") + e.rate0, nv))
        at = m.at("rates") + m.nrates - states
        tape.copy(Block(Space.Y, self.system.nq + self.system.nv, states), Block(Space.MAPS, at, states))

    def where(self) -> dict[str, Moving | Closed]:
        """Blocks of every joint."""
        return {j.name: m for j, m in zip(self.system.tree, self.moving, strict=True)} | {c.joint.name: c for c in self.closed}

    def transmitted(self, tape: Tape, j: Joint, N: Sequence[Block]) -> Block:
        """What a joint transmits to its outboard part without multipliers (6), from N of the tree's."""
        ft = tape.scratch_block(6)
        if j.cut:
            tape.zero(ft)
            tape.call(Builtin.ALONG, [self.closing(j).blocks["wat"], self.closing(j).effort, ft], [6, j.kind.nv])
        else:
            self.scene.call(tape, closing.outboard(j.forward), N=N[j.child], pose=self.moving[j.child].pose, out=ft)
        return ft

    def _known_of_cut(self, tape: Tape, e: Element, Z: list[Block], out: Block, held: Block) -> None:
        """What a cut joint's devices press, and the accelerations of its freedoms."""
        j, c = e.joint, self.closing(e.joint)
        self.pin_of_cut(tape, e, self.transmitted(tape, j, []), out)
        if self.maps.held:
            tape.copy(c.blocks["bias"], held)
            self.along_cut(tape, c, [Z[b] if b != GROUND else self.scene.base for b in (j.inb, j.out)], held)

    def along_cut(self, tape: Tape, c: Closed, Z: Sequence[Block], out: Block) -> None:
        """Add to the accelerations of a cut joint's freedoms what those of its two bodies cause."""
        for which, z in zip(("win", "wout"), Z, strict=True):
            tape.call(Builtin.DOTS, [c.blocks[which], z, out], [6, c.joint.kind.nv, 6, 1])

    def pin_of_cut(self, tape: Tape, e: Element, ft: Block, out: Block, whole: bool = True) -> None:
        """The needed components of f_c, m_c of a cut joint from the wrench on its outboard part (``whole``: not that of a
        multiplier alone)."""
        j, pose = e.joint, self.closing(e.joint).pose
        if e.needs:
            part = closing.pin(j.kind_name, j.fit, e.needs)
            self.scene.call(tape, part, ft=ft, pose=pose, out=out, **lengths_of(self.scene, j))
        if whole:
            write_span(self.scene, tape, j, e.needs, pose, out)

    def pin(self, tape: Tape, e: Element, N: Block, out: Block, whole: bool = True) -> None:
        """The needed components of f_c, m_c of a joint from N on its child."""
        j, pose = e.joint, self.moving[e.joint.child].pose
        if e.needs:
            part = small.pin(j.kind_name, j.forward, j.fit, e.needs)
            self.scene.call(tape, part, N=N, pose=pose, out=out, **lengths_of(self.scene, j))
        if whole:
            write_span(self.scene, tape, j, e.needs, pose, out)

    # -- accelerations ------------------------------------------------------------------------------------------------------

    def _derivative(self, tape: Tape) -> None:
        system, s = self.system, self.scene
        nq, nv = system.nq, system.nv
        coordinate_rates(s, tape, Block(Space.Y, nq, nv), Block(Space.DY, 0, nq))
        y, count = self.y, self.maps.columns
        if count:
            y = tape.scratch_block(nv)
        if count and self.apart:
            tape.copy(self.y, y)
            self.apart.add(tape, y)
        elif count:
            tape.call(Builtin.COMBINE, [self.y, self.columns, Block(Space.Z, 0, count), y], [nv, count, nv])
        every = range(len(system.bodies))
        function = "onward" if s.bare else "accelerations"
        qdd, Z, _ = self.accelerate(tape, y, [s.zeros for _ in every], function, every, s.base)
        self.write_derivative(tape, qdd, Z)

    def write_derivative(self, tape: Tape, qdd: Block, Z: list[Block]) -> None:
        """ẏ behind the coordinate rates, from accelerations."""
        system, s = self.system, self.scene
        nq, nv, nb = system.nq, system.nv, len(system.bristles)
        tape.copy(qdd, Block(Space.DY, nq, nv))
        rows = {row: i for i, row in enumerate(self.active)}
        N = s.balance(tape, self.moving, Z, self.closed, rows) if nb or any(j.driven for j in system.tree) else []
        at = nq + nv
        for e in self.parts:
            if e.friction.bristles:
                self._drift(tape, e, N, Block(Space.DY, at, e.joint.kind.nv))
                at += e.joint.kind.nv
        write_powers(self.scene, tape, self.motion_of, self.moving, N, Space.POWER)

    def _drift(self, tape: Tape, e: Element, N: list[Block], out: Block) -> None:
        rows = tape.scratch_block(len(e.needs))
        if e.joint.cut:
            c, ft = self.closing(e.joint), self.transmitted(tape, e.joint, [])
            self.scene.add_wrenches(tape, c, "gat", {row: i for i, row in enumerate(self.active)}, ft, 1)
            self.pin_of_cut(tape, e, ft, rows)
        else:
            self.pin(tape, e, N[e.joint.child], rows)
        part, v = friction.drift(rubbing(e)), self.motion_of(e.joint)[1]
        self.scene.call(tape, part, N=rows, r=v, out=out, **element_places(self.scene, tape, e))
