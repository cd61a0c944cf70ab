"""Tapes of a row: the columns asked for, and the contact forces by which turns of contacts are watched. Only what a column needs
is computed."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from engine.abi.runs import EXTRA, LAST
from engine.friction import REGISTRY as LAWS
from engine.kernel.columns import Column
from engine.kernel.records import names_of_powers
from engine.parts.acting import DeviceRows
from engine.parts.blocks import Closed, Moving
from engine.parts.known import TOUCH, rubbing
from engine.parts.places import element_places, lengths_of, write_span
from engine.parts.scene import Scene
from engine.parts.store import closing, friction, small
from engine.parts.tables import BODY
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.system.elements import Element, elements, everything
from engine.system.structure import GROUND, Joint


class Rows(DeviceRows):
    """Blocks of columns by their key (``Column.key``): the first word of a key is the method below that finds it."""

    def __init__(self, scene: Scene, tape: Tape):
        self.scene, self.tape, self.system = scene, tape, scene.system
        self.joints = {j.name: j for j in self.system.joints}
        self.elements = {e.joint.name: e for e in elements(self.system)}
        self.powers = names_of_powers(self.system)
        self._made: dict[Hashable, Block] = {}
        self._moving: list[Moving] = []
        self._closed: dict[str, Closed] = {}
        self._every = {k: k for k in range(self.system.rows)}
        scene.multipliers = self.system.rows
        self._Z: list[Block] = []
        self._N: list[Block] = []

    def value(self, key: tuple) -> Block:
        """Where the column with this key is, once the tape has been walked."""
        return getattr(self, f"_{key[0]}")(*key[1:])

    def write(self, chosen: list[Column]) -> None:
        """Put all columns in their order."""
        for i, c in enumerate(chosen):
            self.tape.copy(self.value(c.key), Block(Space.OUT, i, 1))

    # -- passes -------------------------------------------------------------------------------------------------------------

    def moving(self) -> list[Moving]:
        """Motions of all bodies, and what acts on them."""
        if not self._moving:
            self._moving = self.scene.outward(self.tape, self.tape.scratch_block)
            self._closed = {c.joint.name: c for c in self.scene.closed(self.tape, self._moving, self.tape.scratch_block)}
        return self._moving

    def accelerations(self) -> list[Block]:
        """Ż of all bodies."""
        moving = self.moving()
        if not self._Z:
            for i, j in enumerate(self.system.tree):
                parent = self.scene.parent(i)
                base = self.scene.base if parent == GROUND else self._Z[parent]
                self._Z.append(self.tape.scratch_block(6))
                a = Block(Space.A, j.v0, len(j.free))
                self.scene.body_call(self.tape, i, "moved", work=moving[i].work, Z=base, qdd=a, Zo=self._Z[i])
        return self._Z

    def reactions(self) -> list[Block]:
        """N of all bodies."""
        if not self._N:
            Z = self.accelerations()
            self._N = self.scene.balance(self.tape, self.moving(), Z, list(self._closed.values()), self._every)
        return self._N

    def once(self, key: Hashable, size: int, make: Callable[[Block], None]) -> Block:
        """Numbers that several columns are among, made once."""
        if key not in self._made:
            self._made[key] = self.tape.scratch_block(size)
            make(self._made[key])
        return self._made[key]

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _center(self, i: int) -> Block:
        n = self.scene.body_numbers[i]
        return n.part(n.size - BODY + 1, 3)

    def _place(self, i: int, point: Block, name: str) -> Block:
        motion = self.moving()[i].motion
        make = lambda out: self.scene.call(self.tape, small.point(), motion=motion, p=point, out=out)  # noqa: E731
        return self.once(("place", i, name), 6, make)

    def _position(self, i: int, k: int) -> Block:
        return self._place(i, self._center(i), "").part(k, 1)

    def _velocity(self, i: int, k: int) -> Block:
        return self._place(i, self._center(i), "").part(3 + k, 1)

    def _point(self, i: int, name: str, k: int) -> Block:
        leaves = dict(self.system.bodies[i].points)[name]
        key = ("numbers", i, name)
        if key not in self._made:
            self._made[key] = self.scene.numbers(leaves)
        return self._place(i, self._made[key], name).part(k, 1)

    def _acceleration(self, i: int, k: int) -> Block:
        s, Z = self.scene, self.accelerations()[i]
        places = {"motion": self.moving()[i].motion, "p": self._center(i), "g": s.gravity, "Z": Z}
        return self.once(("acceleration", i), 3, lambda out: s.call(self.tape, small.acceleration(), out=out, **places)).part(k, 1)

    def _orientation(self, i: int, k: int) -> Block:
        motion = self.moving()[i].motion
        make = lambda out: self.scene.call(self.tape, small.orientation(), motion=motion, out=out)  # noqa: E731
        return self.once(("orientation", i), 4, make).part(k, 1)

    def _omega(self, i: int, k: int) -> Block:
        return self.moving()[i].motion.part(12 + k, 1)

    # -- joints -------------------------------------------------------------------------------------------------------------

    def joint(self, name: str) -> tuple[Joint, Moving | Closed]:
        """A joint, and its blocks."""
        j, moving = self.joints[name], self.moving()
        return j, self._closed[name] if j.cut else moving[j.child]

    def on_outboard(self, j: Joint) -> Block:
        """Force and torque that a joint transmits to its outboard part, at its point there (6)."""
        m = self.joint(j.name)[1]
        if isinstance(m, Moving):
            N = self.reactions()[j.child]
            make = lambda out: self.scene.call(self.tape, closing.outboard(j.forward), N=N, pose=m.pose, out=out)  # noqa: E731
            return self.once(("outboard", j.name), 6, make)

        def transmitted(out: Block) -> None:
            self.tape.zero(out)
            self.tape.call(Builtin.ALONG, [m.blocks["wat"], m.effort, out], [6, j.kind.nv])
            self.scene.add_wrenches(self.tape, m, "gat", self._every, out, 1)

        return self.once(("outboard", j.name), 6, transmitted)

    def _q(self, name: str, i: int) -> Block:
        return self.joint(name)[1].q.part(i, 1)

    def _qd(self, name: str, k: int) -> Block:
        return self.joint(name)[1].v.part(k, 1)

    def _qdd(self, name: str, k: int) -> Block:
        j, m = self.joint(name)
        if isinstance(m, Moving):
            return Block(Space.A, j.v0 + j.free.index(k), 1) if k in j.free else m.known.part(k, 1)
        Z = [self.accelerations()[b] if b != GROUND else self.scene.base for b in (j.inb, j.out)]

        def relative(out: Block) -> None:
            self.tape.copy(m.blocks["bias"], out)
            for which, z in zip(("win", "wout"), Z, strict=True):
                self.tape.call(Builtin.DOTS, [m.blocks[which], z, out], [6, j.kind.nv, 6, 1])

        return self.once(("qdd", name), j.kind.nv, relative).part(k, 1)

    def _reaction(self, name: str, which: str, k: int) -> Block:
        j, m = self.joint(name)
        ft, part = self.on_outboard(j), closing.reaction(j.fit.pin_out)
        whole = self.once(("reaction", name), 6, lambda out: self.scene.call(self.tape, part, ft=ft, pose=m.pose, out=out))
        return whole.part(k + (0 if which == "f" else 3), 1)

    def _friction(self, name: str, k: int) -> Block:
        return self.scene.eta(self.joints[name]).part(k, 1)

    def _bristle(self, name: str, k: int) -> Block:
        e, system = self.elements[name], self.system
        at = system.nq + system.nv + system.bristles.index([i for s in e.friction.sliders for i in s.eta][k])
        scale = self.scene.numbers([e.friction.number(LAWS[e.friction.law].state_scale)])
        places = {"a": Block(Space.Y, at, 1), "b": scale}
        return self.once(("bristle", name, k), 1, lambda out: self.scene.call(self.tape, small.over(), out=out, **places))

    def _state(self, flag: int) -> Block:
        return Block(Space.EXTRA, EXTRA.numbers + flag, 1)

    def touching(self, e: Element) -> tuple[Block, Block]:
        """Contacts of a joint: their columns (``TOUCH`` each), and a ``tr_contact`` each."""
        j, m = self.joint(e.joint.name)
        count = e.contact.count
        needs, ft = everything(j), self.on_outboard(j)

        def press(out: Block) -> None:
            part = closing.pin(j.kind_name, j.fit, needs)
            self.scene.call(self.tape, part, ft=ft, pose=m.pose, out=out, **lengths_of(self.scene, j))
            write_span(self.scene, self.tape, j, needs, m.pose, out)

        pressed = self.once(("pin", j.name), len(needs), press)
        four = self.once(("four", j.name), 4 * count, lambda _: None)
        eta = self.scene.eta(j)
        columns = self.once(("contacts", j.name), TOUCH * count, lambda out: self.scene.call(
            self.tape, friction.contacts(rubbing(e)), N=pressed, r=m.v, eta=eta, pose=m.pose, columns=out, four=four,
            **element_places(self.scene, self.tape, e)))  # fmt: skip
        return columns, four

    def _contact(self, name: str, i: int, what: str, k: int = 0) -> Block:
        at = {"force": 0, "angle": 1, "elevation": 2, "normal": 3 + k, "state": 6}[what]
        return self.touching(self.elements[name])[0].part(TOUCH * i + at, 1)

    # -- the whole ----------------------------------------------------------------------------------------------------------

    def _quad(self, name: str) -> Block:
        system = self.system
        return Block(Space.Y, system.nq + system.nv + len(system.bristles) + self.powers.index(name), 1)

    def _tie(self, row: int) -> Block:
        return Block(Space.Z, row, 1)

    def _energies(self) -> Block:
        moving = self.moving()
        closed = list(self._closed.values())
        return self.once("energies", 2, lambda out: self.scene.energies(self.tape, moving, closed, out))

    def _kinetic(self) -> Block:
        return self._energies().part(0, 1)

    def _potential(self) -> Block:
        return self._energies().part(1, 1)

    def _sum(self, key: str, terms: list[tuple[Block, int]], times: Block | None = None) -> Block:
        def make(out: Block) -> None:
            self.tape.zero(out)
            for block, sign in terms:
                self.tape.call(Builtin.PRODUCT, [times or self.scene.one, block, out], [1, sign])

        return self.once(key, 1, make)

    def _dissipated(self) -> Block:
        return self._sum("dissipated", [(self._quad(n), -1) for n in self.powers if n not in ("drive", "load")])

    def _residual(self) -> Block:
        given = [(self._quad("drive"), -1), (self._quad("load"), -1)]
        terms = [(self._kinetic(), 1), (self._potential(), 1), (self._extra("energy0"), -1), *given, (self._dissipated(), 1)]
        return self._sum("residual", terms)

    def _extra(self, name: str) -> Block:
        return Block(Space.EXTRA, EXTRA.at(name), 1)

    def _last(self, name: str) -> Block:
        return Block(Space.EXTRA, EXTRA.at("last") + LAST.at(name), 1)
