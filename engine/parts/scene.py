"""The passes over the bodies of a scene that several functions begin with, and what acts on bodies and along freedoms."""

from __future__ import annotations

from engine.kernel.records import MOTION
from engine.parts.blocks import ALONG, Closed, Moving, Place
from engine.parts.freedoms import Freedoms
from engine.parts.joining import ends, joining
from engine.parts.known import BARE, PIECE, POSE
from engine.parts.store import closing, small
from engine.parts.tables import BODY
from engine.parts.tape import Block, Builtin, Space, Tape
from engine.parts.tying import foot, piece, tied
from engine.system.structure import GROUND, Joint, Load, state_coordinates


class Scene(Freedoms):
    """The tables of a scene and the passes over it."""

    # -- the pass outward ---------------------------------------------------------------------------------------------------

    def outward(self, tape: Tape, place: Place, forces: bool = True) -> list[Moving]:
        """Motions of all bodies, outward; with what acts on them and along their joints, if ``forces``."""
        out: list[Moving] = []
        bias = place(6 * (len(self.system.bodies) + 1))
        for i, j in enumerate(self.system.tree):
            q, v, known = self.rates_of(tape, j, place)
            motion, pose, work = place(MOTION), place(POSE), place(self.work(i))
            m = Moving(q, v, known, motion, pose, work, self.zeros, self.zeros, bias.part(6 * i, 6))
            carrier = self.ground if self.parent(i) == GROUND else out[self.parent(i)].motion
            self.body_call(tape, i, "outward", q=q, v=v, known=known, carrier=carrier, work=m.work, motion=m.motion, pose=m.pose,
                           bias=m.bias)  # fmt: skip
            out.append(m)
        tape.copy(self.base, bias.part(bias.size - 6, 6))
        self.all_bias = bias
        if forces:
            for j in self.system.tree:
                self._efforts(tape, j, out[j.child], place)
            for load in self.system.loads:
                self._load(tape, load, out, place)
        return out

    def rates_of(self, tape: Tape, j: Joint, place: Place) -> tuple[Block, Block, Block]:
        """Coordinates and rates of all freedoms of a tree joint, and the accelerations of those that are prescribed."""
        states = state_coordinates(j)
        own_q, own_v = Block(Space.Y, j.q0, len(states)), Block(Space.Y, self.system.nq + j.v0, len(j.free))
        if not j.driven:
            return own_q, own_v, self.zeros
        q, v, known = place(j.kind.nq), place(j.kind.nv), place(j.kind.nv)
        tape.zero(known)
        for at, i in enumerate(states):
            tape.copy(own_q.part(at, 1), q.part(i, 1))
        for at, k in enumerate(j.free):
            tape.copy(own_v.part(at, 1), v.part(k, 1))
        for k in j.driven:
            drive = j.devices[k].drive
            assert drive is not None
            moved = self.motion(tape, drive, place)
            for source, target in ((0, q.part(j.kind.coordinate_of(k), 1)), (1, v.part(k, 1)), (2, known.part(k, 1))):
                tape.copy(moved.part(source, 1), target)
        return q, v, known

    # -- what acts ----------------------------------------------------------------------------------------------------------

    def _efforts(self, tape: Tape, j: Joint, m: Moving, place: Place) -> None:
        if self.acts(j):
            m.effort = place(j.kind.nv)
            tape.zero(m.effort)
            self.add_efforts(tape, j, m.q, m.v, m.effort, place)

    def add_efforts(self, tape: Tape, j: Joint, q: Block, v: Block, out: Block, place: Place) -> None:
        """Add what the devices of a joint do along each of its freedoms."""
        for k, d, own, rate in self.each_device(j, q, v):
            self.device(tape, d, "force", own, rate, out.part(k, 1))
            if d.effort:
                tape.call(Builtin.ADD, [self.value(tape, d.effort, place), out.part(k, 1)], [1])
            self.motor(tape, d, rate, out.part(k, 1))

    def closed(self, tape: Tape, moving: list[Moving], place: Place, forces: bool = True) -> list[Closed]:
        """The cut joints, once all bodies' motions are known; what their devices do to the bodies, if ``forces``."""
        tie = lambda j: tied(self, tape, j, moving, place)  # noqa: E731
        return [tie(j) if j.mimic else self._closed(tape, j, moving, place, forces) for j in self.system.cuts]

    def _closed(self, tape: Tape, j: Joint, moving: list[Moving], place: Place, forces: bool) -> Closed:
        ground = "inb" if j.inb == GROUND else "out" if j.out == GROUND else ""
        bare = ("moving" if forces else "closed") if self.bare and not self.acts(j) and not j.friction else ""
        part, nv, n = closing.cut(j.kind_name, ground, bare), j.kind.nv, j.kind.rows
        sizes = {"phi": n, "rate": n, "xi": n, "gin": 6 * n, "gout": 6 * n, "gat": 6 * n, "q": j.kind.nq, "v": nv, "bias": nv,
                 "win": 6 * nv, "wout": 6 * nv, "wat": 6 * nv, "pose": POSE, "point": 3}  # fmt: skip
        asked = BARE[bare] or tuple(sizes)
        blocks = {name: place(size) if name in asked else self.zeros for name, size in sizes.items()}
        ends = {name: moving[b].motion for name, b in (("inb", j.inb), ("out", j.out)) if b != GROUND}
        wheels = [j.wheels.module, *j.wheels.teeth, j.wheels.phase] if j.wheels else []
        middle = [*j.profile.middle, j.profile.roller] if j.profile else []
        numbers = self.numbers([*j.inb_frame, *j.out_frame, *j.inb_point, *j.out_point, *wheels, *middle])
        if j.curve:
            ends[PIECE] = foot(self, tape, j.curve, closing.bearing(j.kind_name, ground), numbers=numbers, **ends)
        if j.profile:
            ends[PIECE] = piece(self, tape, j.profile, closing.bearing(j.kind_name, ground), numbers=numbers, **ends)
        self.call(tape, part, numbers=numbers, **ends, **blocks)
        made = Closed(j, blocks["q"], blocks["v"], blocks["pose"], blocks, self.zeros)
        if forces and self.acts(j):
            made.effort = place(nv)
            tape.zero(made.effort)
            self.add_efforts(tape, j, made.q, made.v, made.effort, place)
            for b, which in ((j.inb, "win"), (j.out, "wout")):
                if b != GROUND:
                    tape.call(Builtin.ALONG, [blocks[which], made.effort, self.force_on(tape, b, moving, place)], [6, nv])
        return made

    def force_on(self, tape: Tape, b: int, moving: list[Moving], place: Place) -> Block:
        """What acts on a body besides its weight, to be added to."""
        if moving[b].force is self.zeros:
            moving[b].force = place(6)
            tape.zero(moving[b].force)
        return moving[b].force

    def _load(self, tape: Tape, load: Load, moving: list[Moving], place: Place) -> None:
        for b in load.bodies:
            if b != GROUND:
                self.force_on(tape, b, moving, place)
        if load.joins:
            sink = tape.scratch_block(6)
            forces = [moving[b].force if b != GROUND else sink for b in load.bodies]
            self.call(tape, joining(load, "wrench"), on_a=forces[0], on_b=forces[1], **ends(self, load, moving))
            return
        m = moving[load.bodies[0]]
        self.call(tape, small.load(load.kind, load.body_frame, "wrench"), out=m.force, **self.applied(tape, load, m, place))

    def balance(self, tape: Tape, moving: list[Moving], Z: list[Block], closed: list[Closed], rows: dict[int, int]) -> list[Block]:
        """N of every body by the balance of each (``accelerations.given``). rows: where the multiplier of each row of a cut joint
        that has one is in z."""
        N = [tape.scratch_block(6) for _ in Z]
        for i, out in enumerate(N):
            tape.zero(out)
            self.body_call(tape, i, "weigh", work=moving[i].work, motion=moving[i].motion, force=moving[i].force, Z=Z[i], N=out)
        for c in closed:
            for b, g in c.ends:
                if b != GROUND:
                    self.add_wrenches(tape, c, g, rows, N[b], -1)
        for i in reversed(range(len(N))):
            if self.parent(i) != GROUND:
                self.body_call(tape, i, "carry", work=moving[i].work, up=N[self.parent(i)], N=N[i])
        return N

    def drive_effort(self, tape: Tape, j: Joint, k: int, m: Moving, N: Block, out: Block) -> None:
        """What the joint transmits along a driven freedom, less its devices, friction and what its rotor takes added."""
        devices = tape.scratch_block(1)
        pitch = self.numbers([j.pitch if j.pitch is not None else 0.0])
        self.call(tape, small.along(j.kind_name, j.forward, k), N=N, pose=m.pose, pitch=pitch, out=out)
        tape.zero(devices)
        i, d = j.kind.coordinate_of(k), j.devices[k]
        self.device(tape, d, "force", m.q.part(i, 1) if i >= 0 else self.zeros, m.v.part(k, 1), devices)
        if d.effort:
            tape.call(Builtin.ADD, [self.value(tape, d.effort, tape.scratch_block), devices], [1])
        self.motor(tape, d, m.v.part(k, 1), devices)
        tape.call(Builtin.PRODUCT, [devices, self.one, out], [1, -1])
        if j.friction:
            tape.call(Builtin.PRODUCT, [self.eta(j).part(k, 1), self.one, out], [1, 1])
        if d.inertia is not None:
            tape.call(Builtin.PRODUCT, [self.numbers([d.inertia]), m.known.part(k, 1), out], [1, 1])

    def eta(self, j: Joint) -> Block:
        """Multipliers of a joint's friction."""
        assert j.friction is not None
        return Block(Space.Z, self.multipliers + j.friction.eta[0], j.kind.nv)

    def add_wrenches(self, tape: Tape, c: Closed, g: str, rows: dict[int, int], out: Block, sign: int) -> None:
        """Add the wrenches of a cut joint's multipliers and its friction (opposite to η), times sign."""
        j = c.joint
        for k in range(j.kind.rows):
            if j.rows + k in rows:
                z = Block(Space.Z, rows[j.rows + k], 1)
                for i in range(6):
                    tape.call(Builtin.PRODUCT, [c.row(g, k).part(i, 1), z, out.part(i, 1)], [1, sign])
        for k in range(j.kind.nv if j.friction else 0):
            for i in range(6):
                tape.call(Builtin.PRODUCT, [c.row(ALONG[g], k).part(i, 1), self.eta(j).part(k, 1), out.part(i, 1)], [1, -sign])

    def energies(self, tape: Tape, moving: list[Moving], closed: list[Closed], out: Block) -> None:
        """Kinetic and potential energy."""
        tape.zero(out)
        for m, numbers in zip(moving, self.body_numbers, strict=True):
            own = numbers.part(numbers.size - BODY, BODY)
            self.call(tape, small.energies(), numbers=own, g=self.gravity, motion=m.motion, out=out)
        potential = out.part(1, 1)
        for j, m in zip(self.system.tree, moving, strict=True):
            self._spun(tape, j, m, out.part(0, 1))
        joints = [(j, m.q, m.v) for j, m in zip(self.system.tree, moving, strict=True)] + [(c.joint, c.q, c.v) for c in closed]
        for j, q, v in joints:
            for _, d, own, rate in self.each_device(j, q, v):
                self.device(tape, d, "potential", own, rate, potential)
        for load in self.system.loads:
            if load.joins:
                self.call(tape, joining(load, "potential"), out=potential, **ends(self, load, moving))

    def _spun(self, tape: Tape, j: Joint, m: Moving, kinetic: Block) -> None:
        """Add the kinetic energy of a joint's rotors."""
        for k, d in enumerate(j.devices):
            if d.inertia is None:
                continue
            half, rate = tape.scratch_block(1), m.v.part(k, 1)
            tape.call(Builtin.SCALE, [rate, self.constant([0.5]), half], [1])
            momentum = tape.scratch_block(1)
            tape.call(Builtin.SCALE, [rate, self.numbers([d.inertia]), momentum], [1])
            tape.call(Builtin.PRODUCT, [half, momentum, kinetic], [1, 1])

    def applied(self, tape: Tape, load: Load, m: Moving, place: Place) -> dict[str, Block]:
        """What the parts of a force or torque are handed."""
        value = place(3)
        for k, s in enumerate(load.vector):
            tape.copy(self.value(tape, s, place), value.part(k, 1))
        point = load.points[0] if load.points else (0.0, 0.0, 0.0)
        return {"numbers": self.numbers(point), "motion": m.motion, "value": value}
