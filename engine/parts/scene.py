"""The tables of a scene: where its numbers lie, and the passes over its bodies that several functions begin with."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from engine.kernel.classes import MOTION
from engine.parts import small
from engine.parts.body import POSE, BodyPart, Carried, body_part
from engine.parts.one import Part
from engine.parts.tape import BUILTINS, Block, Builtin, Space, Tape
from engine.system.leaves import Leaf, Param
from engine.system.structure import GROUND, Device, Joint, Load, Signal, System, state_coordinates

POINTER = 1
"""Doubles at the head of the constants: by which the machine finds the scene."""
STILL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *[0.0] * 9)
"""Motion of the ground (``MOTION``)."""
Place = Callable[[int], Block]
"""Where a pass puts so many numbers."""


@dataclass
class Moving:
    """Blocks of a body in a pass: coordinates and rates of its joint (all), accelerations of what is prescribed, its motion, the
    joint's pose, what the part keeps; what acts on it and along its joint's freedoms."""

    q: Block
    v: Block
    known: Block
    motion: Block
    pose: Block
    work: Block
    force: Block
    effort: Block


@dataclass
class Scene:
    """Constants, functions and tapes, as they are being put together."""

    system: System
    constants: list[float] = field(default_factory=list)
    functions: dict[str, int] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    """Text of each part, by the first of its functions."""
    tapes: dict[str, Tape] = field(default_factory=dict)
    nc: int = POINTER
    whole_z: bool = False
    """Whether multipliers of all rows are handed, not of the active ones alone: those of a row are."""

    def __post_init__(self) -> None:
        self.prepare = self.tape("prepare")
        self.zeros, self.ground = self.constant([0.0] * 18), self.constant(STILL)
        self.gravity = self.numbers(self.system.gravity)
        self.base = self._c(6)
        self.prepare.zero(self.base)
        self.prepare.call(Builtin.PRODUCT, [self.constant([1.0]), self.gravity.part(0, 1), self.base.part(0, 1)], [1, -1])
        self.prepare.call(Builtin.PRODUCT, [self.constant([1.0]), self.gravity.part(1, 1), self.base.part(1, 1)], [1, -1])
        self.prepare.call(Builtin.PRODUCT, [self.constant([1.0]), self.gravity.part(2, 1), self.base.part(2, 1)], [1, -1])
        self.parts: list[BodyPart] = []
        self.which: list[Carried] = []
        self.body_constants: list[Block] = []
        self.body_numbers: list[Block] = []
        for j in self.system.tree:
            self._body(j)

    # -- numbers and functions ----------------------------------------------------------------------------------------------

    def tape(self, name: str) -> Tape:
        """A new tape."""
        return self.tapes.setdefault(name, Tape())

    def _c(self, size: int) -> Block:
        self.nc += size
        return Block(Space.C, self.nc - size, size)

    def constant(self, values: Sequence[float]) -> Block:
        """Numbers that are what they are."""
        self.constants += values
        return Block(Space.K, len(self.constants) - len(values), len(values))

    def numbers(self, leaves: Iterable[Leaf]) -> Block:
        """Numbers of the scene behind each other."""
        leaves = list(leaves)
        if not any(isinstance(x, Param) for x in leaves):
            return self.constant([float(x) for x in leaves])  # type: ignore[arg-type]
        out, how = self._c(len(leaves)), []
        for x in leaves:
            if isinstance(x, Param):
                how.append(x.index)
            else:
                self.constants.append(float(x))
                how.append(-len(self.constants))
        self.prepare.call(Builtin.GATHER, [Block(Space.P, 0, 0), Block(Space.K, 0, 0), out], [len(leaves), *how])
        return out

    def function(self, part: Part | BodyPart, name: str) -> int:
        """Number of a part's function."""
        if name not in self.functions:
            self.texts.setdefault(next(iter(part.places)), part.text)
            for n in part.places:
                self.functions[n] = BUILTINS + len(self.functions)
        return self.functions[name]

    def call(self, tape: Tape, part: Part | BodyPart, name: str = "", **places: Block) -> None:
        """Call a part's function (its only one) with its places by their names."""
        name = name or next(iter(part.places))
        tape.call(self.function(part, name), [places[p] for p in part.places[name]])

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _body(self, j: Joint) -> None:
        body = self.system.bodies[j.child]
        which = Carried(j.kind_name, j.forward, j.driven)
        part = body_part(which)
        point = j.inb_point if j.forward else j.out_point
        leaves = [*j.inb_frame, *j.out_frame, *point, *([j.pitch] if j.pitch is not None else []), body.mass, *body.center, *body.inertia]
        own = self.numbers(leaves)
        if body.per_mass:
            moved = self._c(own.size)
            self.prepare.copy(own, moved)
            self.prepare.call(Builtin.SCALE, [own.part(own.size - 6, 6), own.part(own.size - 10, 1), moved.part(own.size - 6, 6)], [6])
            own = moved
        kept = self._c(part.constants)
        self.call(self.prepare, part, f"{which.name}_prepare", numbers=own, constants=kept)
        self.which.append(which), self.parts.append(part), self.body_constants.append(kept), self.body_numbers.append(own)

    def body_call(self, tape: Tape, i: int, function: str, **places: Block) -> None:
        """Call a function of body i's part."""
        self.call(tape, self.parts[i], f"{self.which[i].name}_{function}", constants=self.body_constants[i], **places)

    def parent(self, i: int) -> int:
        """The body that carries body i, GROUND for the ground."""
        return self.system.bodies[i].parent

    # -- the pass outward ---------------------------------------------------------------------------------------------------

    def outward(self, tape: Tape, place: Place, forces: bool = True) -> list[Moving]:
        """Motions of all bodies, outward; with what acts on them and along their joints, if ``forces``."""
        out: list[Moving] = []
        for i, j in enumerate(self.system.tree):
            q, v, known = self.rates_of(tape, j, place)
            m = Moving(q, v, known, place(MOTION), place(POSE), place(self.parts[i].work), self.zeros, self.zeros)
            carrier = self.ground if self.parent(i) == GROUND else out[self.parent(i)].motion
            self.body_call(tape, i, "outward", q=q, v=v, known=known, carrier=carrier, work=m.work, motion=m.motion, pose=m.pose)
            out.append(m)
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

    def motion(self, tape: Tape, s: Signal, place: Place) -> Block:
        """Position, rate and acceleration that a drive prescribes."""
        return self._signal(tape, s, place, True)

    def _signal(self, tape: Tape, s: Signal, place: Place, moves: bool) -> Block:
        if s.kind == "table":
            return Block(Space.X, self.system.external.table(s.index), 3)
        if s.kind == "value" and not moves:
            return self.numbers(s.leaves)
        out = place(3 if moves else 1)
        self.call(tape, small.signal(s.kind, moves), numbers=self.numbers(s.leaves), x=Block(Space.X, 0, 2), out=out)
        return out

    def value(self, tape: Tape, s: Signal | None, place: Place) -> Block:
        """Value of the signal of a load or effort; none: zero."""
        return self.zeros.part(0, 1) if s is None else self._signal(tape, s, place, False).part(0, 1)

    # -- what acts ----------------------------------------------------------------------------------------------------------

    def device(self, tape: Tape, d: Device, what: str, q: Block, rate: Block, out: Block) -> None:
        """Add the force, power or potential energy of a freedom's spring, damper and stops, if it has any."""
        if d.spring is None and d.damping is None and d.stop is None:
            return
        stop, spring = d.stop, d.spring or (0.0, 0.0)
        ends = [0.0 if stop is None or e is None else e for e in (stop and stop.lower, stop and stop.upper)]
        leaves = [*spring, d.damping or 0.0, *((stop.stiffness, stop.damping) if stop else (0.0, 0.0)), *ends]
        flags = self.zeros
        if stop:
            flags = tape.scratch_block(2)
            for k, bound in enumerate((stop.lower, stop.upper)):
                there = Block(Space.X, self.system.external.stop(stop.flags[k]), 1) if bound is not None else self.zeros
                tape.copy(there.part(0, 1), flags.part(k, 1))
        self.call(tape, small.device(what), numbers=self.numbers(leaves), flags=flags, q=q, rate=rate, out=out)

    def each_device(self, j: Joint, m: Moving) -> Iterable[tuple[int, Device, Block, Block]]:
        """Number, device, coordinate and rate of each freedom of a tree joint."""
        for k, d in enumerate(j.devices):
            i = j.kind.coordinate_of(k)
            yield k, d, m.q.part(i, 1) if i >= 0 else self.zeros, m.v.part(k, 1)

    def _efforts(self, tape: Tape, j: Joint, m: Moving, place: Place) -> None:
        if not any(d.spring or d.damping is not None or d.stop or d.effort for d in j.devices):
            return
        m.effort = place(j.kind.nv)
        tape.zero(m.effort)
        for k, d, q, rate in self.each_device(j, m):
            self.device(tape, d, "force", q, rate, m.effort.part(k, 1))
            if d.effort:
                tape.call(Builtin.ADD, [self.value(tape, d.effort, place), m.effort.part(k, 1)], [1])

    def _load(self, tape: Tape, load: Load, moving: list[Moving], place: Place) -> None:
        for b in load.bodies:
            if b != GROUND and moving[b].force is self.zeros:
                moving[b].force = place(6)
                tape.zero(moving[b].force)
        if load.kind == "spring_damper":
            sink = tape.scratch_block(6)
            forces = [moving[b].force if b != GROUND else sink for b in load.bodies]
            self.call(tape, small.spring("wrench"), on_a=forces[0], on_b=forces[1], **self.ends(load, moving))
            return
        m = moving[load.bodies[0]]
        self.call(tape, small.load(load.kind, load.body_frame, "wrench"), out=m.force, **self.applied(tape, load, m, place))

    def balance(self, tape: Tape, moving: list[Moving], Z: list[Block]) -> list[Block]:
        """N of every body by the balance of each (``accelerations.given``)."""
        N = [tape.scratch_block(6) for _ in Z]
        for i, out in enumerate(N):
            tape.zero(out)
            self.body_call(tape, i, "weigh", work=moving[i].work, force=moving[i].force, Z=Z[i], N=out)
        for i in reversed(range(len(N))):
            if self.parent(i) != GROUND:
                self.body_call(tape, i, "carry", work=moving[i].work, up=N[self.parent(i)], N=N[i])
        return N

    def drive_effort(self, tape: Tape, j: Joint, k: int, m: Moving, N: Block, out: Block) -> None:
        """What the joint transmits along a driven freedom, less its devices, friction added."""
        one, devices = self.constant([1.0]), tape.scratch_block(1)
        pitch = self.numbers([j.pitch if j.pitch is not None else 0.0])
        self.call(tape, small.along(j.kind_name, j.forward, k), N=N, pose=m.pose, pitch=pitch, out=out)
        tape.zero(devices)
        i, d = j.kind.coordinate_of(k), j.devices[k]
        self.device(tape, d, "force", m.q.part(i, 1) if i >= 0 else self.zeros, m.v.part(k, 1), devices)
        if d.effort:
            tape.call(Builtin.ADD, [self.value(tape, d.effort, tape.scratch_block), devices], [1])
        tape.call(Builtin.PRODUCT, [devices, one, out], [1, -1])
        if j.friction:
            first = self.system.rows * self.whole_z + min(e for sl in j.friction.sliders for e in sl.eta)
            tape.call(Builtin.PRODUCT, [Block(Space.Z, first + k, 1), one, out], [1, 1])

    def energies(self, tape: Tape, moving: list[Moving], out: Block) -> None:
        """Kinetic and potential energy."""
        tape.zero(out)
        for m, numbers in zip(moving, self.body_numbers, strict=True):
            own = numbers.part(numbers.size - 10, 10)
            self.call(tape, small.energies(), numbers=own, g=self.gravity, motion=m.motion, out=out)
        potential = out.part(1, 1)
        for j in self.system.tree:
            for _, d, q, rate in self.each_device(j, moving[j.child]):
                self.device(tape, d, "potential", q, rate, potential)
        for load in self.system.loads:
            if load.kind == "spring_damper":
                self.call(tape, small.spring("potential"), out=potential, **self.ends(load, moving))

    def ends(self, load: Load, moving: list[Moving]) -> dict[str, Block]:
        """What the parts of a spring-damper between two points are handed."""
        motions = [self.ground if b == GROUND else moving[b].motion for b in load.bodies]
        return {"numbers": self.numbers([*load.numbers, *load.points[0], *load.points[1]]), "a": motions[0], "b": motions[1]}

    def applied(self, tape: Tape, load: Load, m: Moving, place: Place) -> dict[str, Block]:
        """What the parts of a force or torque are handed."""
        value = place(3)
        for k, s in enumerate(load.vector):
            tape.copy(self.value(tape, s, place), value.part(k, 1))
        point = load.points[0] if load.points else (0.0, 0.0, 0.0)
        return {"numbers": self.numbers(point), "motion": m.motion, "value": value}
