"""The tables of a scene: where its numbers lie, which functions of parts it calls, and its bodies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from engine.parts.known import Carried, Part
from engine.parts.store import body
from engine.parts.tape import BUILTINS, Block, Builtin, Space, Tape
from engine.system.leaves import Leaf, Param
from engine.system.structure import Joint, System

POINTER = 1
"""Doubles at the head of the constants: by which the machine finds the scene."""
STILL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *[0.0] * 9)
"""Motion of the ground (``MOTION``)."""
BODY = 10
"""Numbers of a body, the last of its part: mass, mass centre (3), inertia (6)."""


@dataclass
class Tables:
    """Constants, functions and tapes, as they are being put together."""

    system: System
    constants: list[float] = field(default_factory=list)
    functions: dict[str, int] = field(default_factory=dict)
    part_of: dict[str, Part] = field(default_factory=dict)
    """The part that a function is one of."""
    tapes: dict[str, Tape] = field(default_factory=dict)
    nc: int = POINTER
    rubbed: bool = False
    """Friction is found along the recursion, loops and all."""
    bare: bool = False
    """Of cut joints only what closes them is found, where nothing acts along their freedoms."""
    multipliers: int = 0
    """Multipliers of rows of cut joints in front of those of friction."""

    def __post_init__(self) -> None:
        self.prepare = self.tape("prepare")
        self.zeros, self.ground = self.constant([0.0] * 18), self.constant(STILL)
        self.gravity = self.numbers(self.system.gravity)
        self.base = self.c_block(6)
        self.one, self.against = self.constant([1.0]), self.constant([-1.0])
        self.prepare.zero(self.base)
        for k in range(3):
            self.prepare.call(Builtin.PRODUCT, [self.one, self.gravity.part(k, 1), self.base.part(k, 1)], [1, -1])
        self.parts: list[Part] = []
        self.which: list[Carried] = []
        self.body_constants: list[Block] = []
        self.body_numbers: list[Block] = []
        for j in self.system.tree:
            self._body(j)

    # -- numbers and functions ----------------------------------------------------------------------------------------------

    def tape(self, name: str) -> Tape:
        """A new tape."""
        return self.tapes.setdefault(name, Tape())

    def c_block(self, size: int) -> Block:
        """Constants that follow from parameters."""
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
        out, how = self.c_block(len(leaves)), []
        for x in leaves:
            if isinstance(x, Param):
                how.append(x.index)
            else:
                self.constants.append(float(x))
                how.append(-len(self.constants))
        self.prepare.call(Builtin.GATHER, [Block(Space.P, 0, 0), Block(Space.K, 0, 0), out], [len(leaves), *how])
        return out

    def function(self, part: Part, name: str) -> int:
        """Number of a part's function."""
        if name not in self.functions:
            for n in part.places:
                self.functions[n], self.part_of[n] = BUILTINS + len(self.functions), part
        return self.functions[name]

    def own_function(self, name: str) -> int:
        """Number of a function of the machine that only some tapes call."""
        return self.functions.setdefault(name, BUILTINS + len(self.functions))

    def call(self, tape: Tape, part: Part, name: str = "", /, **places: Block) -> None:
        """Call a part's function (its only one) with its places by their names."""
        name = name or part.first
        tape.call(self.function(part, name), [places[p] for p in part.places[name]])

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _body(self, j: Joint) -> None:
        carried = self.system.bodies[j.child]
        rotors = any(d.inertia is not None for d in j.devices)
        which = Carried(j.kind_name, j.forward, j.driven, self.rubbed, self.rubbed and bool(self.system.cuts), rotors)
        part = body.body_part(which)
        point = j.inb_point if j.forward else j.out_point
        pitch = [] if j.pitch is None else [j.pitch]
        spun = [d.inertia or 0.0 for d in j.devices] if rotors else []
        own = self.numbers([*spun, *j.inb_frame, *j.out_frame, *point, *pitch, carried.mass, *carried.center, *carried.inertia])
        if carried.per_mass:
            moved = self.c_block(own.size)
            self.prepare.copy(own, moved)
            mass, inertia = own.part(own.size - BODY, 1), own.size - 6
            self.prepare.call(Builtin.SCALE, [own.part(inertia, 6), mass, moved.part(inertia, 6)], [6])
            own = moved
        kept = self.c_block(part.sizes["constants"])
        self.call(self.prepare, part, f"{which.name}_prepare", numbers=own, constants=kept)
        self.which.append(which)
        self.parts.append(part)
        self.body_constants.append(kept)
        self.body_numbers.append(own.part(len(spun), own.size - len(spun)))

    def work(self, i: int) -> int:
        """How many numbers the passes of body i's part keep of its motion."""
        return self.parts[i].sizes["work"]

    def body_call(self, tape: Tape, i: int, function: str, **places: Block) -> None:
        """Call a function of body i's part."""
        self.call(tape, self.parts[i], f"{self.which[i].name}_{function}", constants=self.body_constants[i], **places)

    def parent(self, i: int) -> int:
        """The body that carries body i, GROUND for the ground."""
        return self.system.bodies[i].parent
