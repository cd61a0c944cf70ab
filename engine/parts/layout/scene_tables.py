"""Tables of a scene: its constants, the ops that it calls, its bodies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.bytecode.program import BUILTINS, Builtin, Program, Slot, Space
from trunnion.parts.primitives.primitive_cache import body_step
from trunnion.parts.primitives.primitive_keys import BodyKey, FrictionKey, Primitive, rubbing
from trunnion.system.structure.bodies_and_joints import GROUND, Joint, System
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.parameter_table import Leaf, Param

POINTER = 1
"""Number of doubles, at the start of the constants C, that contain the address of the scene."""
STILL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *[0.0] * 9)
"""Motion of the ground (``MOTION``)."""
BODY = 10
"""Number of a body's parameters: mass, mass centre (3), inertia (6). These are the last numbers of the body's primitive."""


@dataclass
class SceneTables:
    """Constants, ops and programs of a scene, under construction."""

    system: System
    constants: list[float] = field(default_factory=list)
    functions: dict[str, int] = field(default_factory=dict)
    primitive_of: dict[str, Primitive] = field(default_factory=dict)
    """The primitive that contains an op, by the op's name."""
    programs: dict[str, Program] = field(default_factory=dict)
    nc: int = POINTER
    rubbed: bool = False
    """Whether friction is solved along the recursion, in loops as well."""
    bare: bool = False
    """Whether cut joints without devices compute only the outputs that their constraints need."""
    keys: dict[str, FrictionKey] = field(default_factory=dict)
    """The keys of friction primitives, by joint; filled at the first request of a joint."""
    multipliers: int = 0
    """Number of multipliers of the rows of cut joints. These multipliers precede the friction multipliers."""

    def __post_init__(self) -> None:
        self.prepare = self.program("prepare")
        self.zeros, self.ground = self.constant([0.0] * 18), self.constant(STILL)
        self.gravity = self.numbers(self.system.gravity)
        self.base = self.constant_slot(6)
        self.one, self.against = self.constant([1.0]), self.constant([-1.0])
        self.prepare.zero(self.base)
        for k in range(3):
            self.prepare.call(Builtin.ADD_DOT, [self.one, self.gravity.slice(k, 1), self.base.slice(k, 1)], [1, -1])
        self.body_primitives: list[Primitive] = []
        self.which: list[BodyKey] = []
        self.body_constants: list[Slot] = []
        self.body_numbers: list[Slot] = []
        for j in self.system.tree:
            self._body(j)

    # -- numbers and functions ----------------------------------------------------------------------------------------------

    def program(self, name: str) -> Program:
        """The program of this name. The first request creates the program."""
        return self.programs.setdefault(name, Program())

    def constant_slot(self, size: int) -> Slot:
        """A slot for constants that ``prepare`` computes from parameters."""
        self.nc += size
        return Slot(Space.C, self.nc - size, size)

    def constant(self, values: Sequence[float]) -> Slot:
        """A slot of constants that no parameter changes."""
        self.constants += values
        return Slot(Space.K, len(self.constants) - len(values), len(values))

    def numbers(self, leaves: Iterable[Leaf]) -> Slot:
        """A slot with these values. If one of the values is a parameter, ``prepare`` writes all of them."""
        leaves = list(leaves)
        if not any(isinstance(x, Param) for x in leaves):
            return self.constant([float(x) for x in leaves])  # type: ignore[arg-type]
        out, how = self.constant_slot(len(leaves)), []
        for x in leaves:
            if isinstance(x, Param):
                how.append(x.index)
            else:
                self.constants.append(float(x))
                how.append(-len(self.constants))
        self.prepare.call(Builtin.GATHER, [Slot(Space.P, 0, 0), Slot(Space.K, 0, 0), out], [len(leaves), *how])
        return out

    def function(self, primitive: Primitive, name: str) -> int:
        """Number of an op that belongs to a primitive."""
        if name not in self.functions:
            for n in primitive.operands:
                self.functions[n], self.primitive_of[n] = BUILTINS + len(self.functions), primitive
        return self.functions[name]

    def own_function(self, name: str) -> int:
        """Number of an op that the interpreter provides outside the table of builtin ops."""
        return self.functions.setdefault(name, BUILTINS + len(self.functions))

    def call(self, program: Program, primitive: Primitive, name: str = "", /, **operands: Slot) -> None:
        """Append a call of a primitive's op (by default its first op). Keywords give the operands."""
        name = name or primitive.first
        program.call(self.function(primitive, name), [operands[p] for p in primitive.operands[name]])

    def key_of(self, e: Element) -> FrictionKey:
        """The key of an element's primitives."""
        name = e.joint.name
        if name not in self.keys:
            self.keys[name] = rubbing(e)
        return self.keys[name]

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _body(self, j: Joint) -> None:
        carried = self.system.bodies[j.child]
        rotors = any(d.turned is not None for d in j.devices)
        which = BodyKey(j.kind_name, j.forward, j.driven, self.rubbed, self.rubbed and bool(self.system.cuts), rotors)
        primitive = body_step.body_primitive(which)
        point = j.inb_point if j.forward else j.out_point
        pitch = [] if j.pitch is None else [j.pitch]
        spun = [d.turned or 0.0 for d in j.devices] if rotors else []
        own = self.numbers([*spun, *j.inb_frame, *j.out_frame, *point, *pitch, carried.mass, *carried.center, *carried.inertia])
        if carried.per_mass:
            moved = self.constant_slot(own.size)
            self.prepare.copy(own, moved)
            mass, inertia = own.slice(own.size - BODY, 1), own.size - 6
            self.prepare.call(Builtin.SCALE, [own.slice(inertia, 6), mass, moved.slice(inertia, 6)], [6])
            own = moved
        kept = self.constant_slot(primitive.sizes["constants"])
        self.call(self.prepare, primitive, f"{which.name}_prepare", numbers=own, constants=kept)
        self.which.append(which)
        self.body_primitives.append(primitive)
        self.body_constants.append(kept)
        self.body_numbers.append(own.slice(len(spun), own.size - len(spun)))

    def inertial_numbers(self, i: int) -> Slot:
        """Slot of the mass, mass centre (3) and inertia (6) of body i."""
        own = self.body_numbers[i]
        return own.slice(own.size - BODY, BODY)

    def work(self, i: int) -> int:
        """Number of motion values that body i's primitive stores."""
        return self.body_primitives[i].sizes["work"]

    def body_call(self, program: Program, i: int, function: str, **operands: Slot) -> None:
        """Call an op of body i's primitive."""
        self.call(
            program, self.body_primitives[i], f"{self.which[i].name}_{function}", constants=self.body_constants[i], **operands
        )

    def acceleration(self, Z: Sequence[Slot], b: int) -> Slot:
        """Ż of a body or of the ground. The acceleration of the ground is ``base``, which is minus gravity. This acceleration
        replaces the gravity forces on the bodies."""
        return self.base if b == GROUND else Z[b]

    def parent(self, i: int) -> int:
        """The inboard body of body i, or GROUND."""
        return self.system.bodies[i].parent
