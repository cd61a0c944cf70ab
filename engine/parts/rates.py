"""The tape of F = ẏ and of the residuals R of the multipliers, of which the Jacobian is made (METHOD, "Jacobians on parts")."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from engine.parts.blocks import Closed, Moving
from engine.parts.cells import Change, Found, found
from engine.parts.directions import Directions
from engine.parts.known import Part, Rubbing, rubbing
from engine.parts.places import coordinate_rates, element_places, lengths_of, write_span
from engine.parts.scene import Scene
from engine.parts.shares import Shares
from engine.parts.smooth import Moved, Smooth
from engine.parts.store import closing, friction
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.elements import Element
from engine.system.external import NOW, TABLE
from engine.system.loops import rubbing_on_loops
from engine.system.structure import GROUND, Joint, state_coordinates


class Rates(Moved):
    """Writes F, R, and in the redundant variant κ and what friction changes in it, into OUT. size: how many they are."""

    def __init__(self, scene: Smooth, tape: Tape, active: Sequence[int], directions: Directions, redundant: bool = False):
        super().__init__(scene, tape, active, directions, redundant)
        self.redundant, first = redundant, len(tape.code)
        self.write()
        directions.follow(tape, first)

    @property
    def between(self) -> int:
        """How many others stand between F and R."""
        return 0

    def write(self) -> None:
        """Everything behind the accelerations."""
        system, tape = self.system, self.tape
        nq, nv = system.nq, system.nv
        coordinate_rates(self.scene, tape, Block(Space.Y, nq, nv), Block(Space.OUT, 0, nq))
        tape.copy(self.qdd, Block(Space.OUT, nq, nv))
        bristles, residual = nq + nv, nq + nv + len(system.bristles) + self.between
        self._close(residual)
        residual += len(self.active)
        self.reactions = {e.joint.name: self._components(e) for e in self.parts}
        for e in self.parts:
            n, N = e.joint.kind.nv, self.reactions[e.joint.name]
            if e.friction.bristles:
                self.law(friction.drift, e, N, out=Block(Space.OUT, bristles, n))
                bristles += n
            acc = self._acceleration(e) if e.sets else self.scene.zeros
            self.law(friction.residual, e, N, eta=self.scene.eta(e.joint), acc=acc, out=Block(Space.OUT, residual + e.eta[0], n))
        self.size = residual + system.neta
        if self.redundant and self.parts:
            self._share(Shares(self.scene))

    def motion(self, j: Joint) -> Moving | Closed:
        return next(c for c in self.closed if c.joint.name == j.name) if j.cut else self.moving[j.child]

    def law(self, part: Callable[[Rubbing], Part], e: Element, N: Block, **places: Block) -> None:
        own = part(rubbing(e))
        rates = self.motion(e.joint).v
        self.scene.call(self.tape, own, **{**element_places(self.scene, self.tape, e), "N": N, "r": rates, **places})

    def _close(self, at: int) -> None:
        """Accelerations that the rows of cut joints forbid."""
        for c in self.closed:
            n = c.joint.kind.rows
            out = self.tape.scratch_block(n)
            self.tape.copy(c.blocks["xi"], out)
            self._add_accelerations(c.ends, c, out)
            for k in range(n):
                if c.joint.rows + k in self.rows:
                    self.tape.copy(out.part(k, 1), Block(Space.OUT, at + self.rows[c.joint.rows + k], 1))

    def _add_accelerations(self, ends: list[tuple[int, str]], c: Closed, out: Block) -> None:
        for b, which in ends:
            Z = self.Z[b] if b != GROUND else self.scene.base
            self.tape.call(Builtin.DOTS, [c.blocks[which], Z, out], [6, out.size, 6, 1])

    def _acceleration(self, e: Element) -> Block:
        """Accelerations of all freedoms of a joint."""
        j, tape = e.joint, self.tape
        out = tape.scratch_block(j.kind.nv)
        if j.cut:
            c = self.motion(j)
            assert isinstance(c, Closed)
            tape.copy(c.blocks["bias"], out)
            self._add_accelerations([(j.inb, "win"), (j.out, "wout")], c, out)
            return out
        for k in range(j.kind.nv):
            known = self.moving[j.child].known
            tape.copy(self.own(self.qdd, j).part(j.free.index(k), 1) if k in j.free else known.part(k, 1), out.part(k, 1))
        return out

    def _transmitted(self, j: Joint) -> Block:
        """Force and torque on a joint's outboard part (6)."""
        out = self.tape.scratch_block(6)
        if j.cut:
            c = self.motion(j)
            assert isinstance(c, Closed)
            self.tape.zero(out)
            self.tape.call(Builtin.ALONG, [c.blocks["wat"], c.effort, out], [6, j.kind.nv])
            self.add_wrenches(c, "gat", out)
        else:
            self.scene.call(self.tape, closing.outboard(j.forward), N=self.N[j.child], pose=self.moving[j.child].pose, out=out)
        return out

    def _components(self, e: Element) -> Block:
        """The needed components of f_c, m_c."""
        j, out = e.joint, self.tape.scratch_block(len(e.needs))
        if not e.needs:
            return out
        part, pose = closing.pin(j.kind_name, j.fit, e.needs), self.motion(j).pose
        self.scene.call(self.tape, part, ft=self._transmitted(j), pose=pose, out=out, **lengths_of(self.scene, j))
        write_span(self.scene, self.tape, j, e.needs, pose, out)
        return out

    def _share(self, shares: Shares) -> None:
        """Scaled reactions, and what friction changes in them."""
        tape, where = self.tape, {j.name: self.motion(j) for j in self.system.joints}
        transmitted = {j.name: self._transmitted(j) for j in shares.joints}
        shares.write(tape, where, self.moving, lambda j: transmitted[j.name], Block(Space.OUT, self.size, shares.size))
        self.size += shares.size
        for e, _, count in rubbing_on_loops(self.system):
            stiffness, n = e.joint.stiffness, len(e.needs)
            more, spare = tape.scratch_block(count), tape.scratch_block(count * n)
            places = element_places(self.scene, tape, e, *([] if stiffness is None else [stiffness]))
            part, rates = friction.pressed(rubbing(e), stiffness is not None), self.motion(e.joint).v
            self.scene.call(tape, part, more=more, dN=spare, N=self.reactions[e.joint.name], r=rates, **places)
            tape.copy(more, Block(Space.OUT, self.size, count))
            self.size += count


def jacobian(scene: Smooth, active: Sequence[int], redundant: bool) -> Found:
    """The tape of the values (``point``) and the directions of [F; R; κ; what friction changes in it] by [y, t, z]."""
    system = scene.system
    ny, nz = system.nq + system.nv + len(system.bristles), len(active) + system.neta
    changes = [*each(Space.Y, ny), time(scene), *each(Space.Z, nz)]
    point = scene.tape("point")
    d = Directions(scene, point, changed(changes))
    rates = Rates(scene, point, active, d, redundant)
    point.code.clear()
    d.point(point)
    return found(d, changes, [Block(Space.OUT, i, 1) for i in range(rates.size)], _order(scene))


def each(space: Space, count: int, first: int = 0) -> list[Change]:
    """Numbers that change one by one."""
    return [[(Block(space, first + i, 1), -1)] for i in range(count)]


def time(scene: Scene) -> Change:
    """What changes with time: it, and of each table's numbers all but the last, by the next."""
    at, tables = scene.system.external, range(scene.system.tables)
    numbers = [(NOW, -1), *[(at.table(k) + i, at.table(k) + i + 1) for k in tables for i in range(TABLE - 1)]]
    return [(Block(Space.X, i, 1), rate) for i, rate in numbers]


def changed(changes: Sequence[Change]) -> list[Block]:
    """All that may change."""
    return [b for change in changes for b, _ in change]


def _order(scene: Smooth) -> list[int]:
    """Columns of [y, t, z]: those of a joint's coordinates and rates behind each other, from the last body inward."""
    system = scene.system
    out: list[int] = []
    for j in system.tree:
        out += range(j.q0, j.q0 + len(state_coordinates(j)))
        out += range(system.nq + j.v0, system.nq + j.v0 + len(j.free))
    left = set(out)
    count = system.nq + system.nv + len(system.bristles) + 1 + scene.multipliers + system.neta
    return [*out, *[q for q in range(count) if q not in left]]
