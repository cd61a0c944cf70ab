"""Forward-mode differentiation of a program. The program ``point`` computes values, and stores the values that tangents need. The
program ``along`` computes derivatives along four directions at once (theory, "Jacobians on parts").

A tangent is the vector of the four derivatives of a number that a direction may change. Tangents are grouped into *cells*:
contiguous numbers that every call uses together. A call whose input cells are all zero is skipped, and its outputs are set to
zero."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.parts.bytecode.program import BUILTINS, Builtin, Program, Slot, Space
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.parts.primitives.primitive_cache import primitive_derivatives
from trunnion.parts.primitives.primitive_keys import AROUND, KEPT, Primitive

BODIES = "p_"
"""Prefix of the names of body functions without tangents; ``acceleration_derivatives`` differentiates their results."""
LONGEST = 36
"""Largest size of an operand of a function with the prefix ``BODIES``."""
B = Builtin


@dataclass
class TangentCall:
    """A call in the program ``along``. operands: pairs of a slot and a flag. The flag is True if the call uses the slot's tangent,
    False if it uses the slot's value. None in place of the slot means a zero tangent. ins, outs, added: tangents that the call
    reads, writes, and adds to."""

    function: int
    operands: list[tuple[Slot | None, bool]]
    numbers: list[int]
    ins: list[Slot]
    outs: list[Slot]
    added: list[Slot]


@dataclass
class ValueCall:
    """A call in the differentiated program. outs: operands that the call changes. added: those outs to which the call adds instead
    of writing."""

    function: int
    names: tuple[str, ...]
    operands: dict[str, Slot]
    outs: set[str]
    added: set[str]
    numbers: list[int]
    read: list[Slot] = field(default_factory=list)
    """Slots whose values the tangents read."""


ADDING = {B.ADD, B.ADD_DOT, B.ADD_ROW_DOTS, B.ADD_COLUMNS, B.ADD_STRIDED_COLUMNS}
"""Builtin ops that add to their output."""


def _builtin_sizes(which: int, numbers: Sequence[int]) -> dict[str, int]:
    """Sizes of the operands of a builtin op; the output is last. Constants have size 0."""
    n, k = numbers[0], numbers[1] if len(numbers) > 1 else 0
    span = (k - 1) * numbers[2] if which in (B.ADD_ROW_DOTS, B.ADD_STRIDED_COLUMNS) and k else 0
    return {
        B.ZERO: {"out": n},
        B.COPY: {"a": n, "out": n},
        B.ADD: {"a": n, "out": n},
        B.GATHER: {"a": max([*numbers[1:], -1]) + 1, "constants": 0, "out": n},
        B.SELECT: {"a": max(numbers[1:], default=-1) + 1, "out": n},
        B.SCALE: {"a": n, "b": 1, "out": n},
        B.ADD_DOT: {"a": n, "b": n, "out": 1},
        B.ADD_ROW_DOTS: {"a": span + n, "b": n, "out": (k - 1) * numbers[3] + 1 if which == B.ADD_ROW_DOTS else 0},
        B.ADD_COLUMNS: {"a": n * k, "b": k, "out": n},
        B.CURVE_PIECE: {"a": 1, "b": 0, "out": 5},
        B.CURVE_FOOT: {"a": 2, "b": 0, "out": 11},
        B.ADD_STRIDED_COLUMNS: {"a": span + n, "b": k, "out": n},
    }[Builtin(which)]


class SlotSet:
    """A set of positions in the arrays."""

    def __init__(self) -> None:
        self.of: dict[Space, bytearray] = {}

    def add(self, b: Slot) -> None:
        """Add all positions of a slot."""
        own = self.of.setdefault(b.space, bytearray())
        if len(own) < b.at + b.size:
            own.extend(bytes(b.at + b.size - len(own)))
        own[b.at : b.at + b.size] = b"\1" * b.size

    def __contains__(self, b: Slot) -> bool:
        """Whether any position of the slot is in the set."""
        return 1 in self.of.get(b.space, b"")[b.at : b.at + b.size]


@dataclass
class Directions:
    """Differentiates programs. scene: the scene whose primitives are called. scratch: the program whose scratch array stores
    values. seeded: slots that directions change. numbers: whether directions also change parameters."""

    scene: SceneTables
    scratch: Program
    seeded: Sequence[Slot]
    numbers: bool = False
    values: list[ValueCall] = field(default_factory=list)
    kept: list[ValueCall] = field(default_factory=list)
    calls: list[TangentCall] = field(default_factory=list)
    active: SlotSet = field(default_factory=SlotSet)

    def __post_init__(self) -> None:
        self._prepared = 0
        self._names: list[str] = []
        self._tangents: dict[tuple[str, bool], Primitive] = {}
        for b in self.seeded:
            self.active.add(b)

    # -- calls --------------------------------------------------------------------------------------------------------------

    def follow(self, program: Program, first: int = 0) -> int:
        """Differentiate the calls of a program from index ``first`` on. Returns the index of the program's end. If directions
        change parameters, the function first differentiates the new calls of ``prepare``."""
        if self.numbers and program is not self.scene.prepare:
            self._prepared = self.follow(self.scene.prepare, self._prepared)
        code, at = program.code, first
        while at < len(code):
            function, count, more = code[at : at + 3]
            where = code[at + 3 : at + 3 + 2 * count].tolist()
            numbers = code[at + 3 + 2 * count : at + 3 + 2 * count + more].tolist()
            at += 3 + 2 * count + more
            g = self._given(function, where, numbers)
            if program is not self.scene.prepare:
                self.values.append(g)
            self._derive(g)
        return at

    def _name(self, function: int) -> str:
        """Name of a primitive's op."""
        while len(self._names) <= function - BUILTINS:
            self._names = list(self.scene.functions)
        return self._names[function - BUILTINS]

    def _tangent(self, name: str, numbers: bool = False) -> Primitive:
        asked = name, self.numbers or numbers
        if asked not in self._tangents:
            module, function, *arguments = self.scene.primitive_of[name].recipe
            self._tangents[asked] = primitive_derivatives.tangent(module, function, tuple(arguments), asked[1])
        return self._tangents[asked]

    def _given(self, function: int, where: list[int], numbers: list[int]) -> ValueCall:
        if function < BUILTINS:
            sizes = _builtin_sizes(function, numbers)
            outs, added, names = {"out"}, {"out"} if function in ADDING else set(), tuple(sizes)
        else:
            name = self._name(function)
            names = self.scene.primitive_of[name].operands[name]
            if name.startswith(BODIES):
                sizes, outs, added = dict.fromkeys(names, LONGEST), set(), set()
            else:
                sizes = dict(self._tangent(name).sizes)
                outs = {n for n in names if f"out {n}" in sizes}
                added = {n for n in names if f"added {n}" in sizes}
        operands = {n: Slot(Space(where[2 * i]), where[2 * i + 1], sizes[n]) for i, n in enumerate(names)}
        return ValueCall(function, names, operands, outs, added, numbers)

    def _derive(self, g: ValueCall) -> None:
        if g.function < BUILTINS:
            self._derive_builtin(g)
        elif g.outs:
            self._derive_part(g)

    def _derive_part(self, g: ValueCall) -> None:
        numbers = g.operands.get("numbers")
        primitive = self._tangent(self._name(g.function), numbers is not None and numbers in self.active)
        at, along = primitive.operands
        moving = [n for n in g.names if n not in g.outs and g.operands[n] in self.active]
        if not moving:
            return self._still(g)
        operands = dict(g.operands)
        if primitive.sizes[KEPT]:
            operands[KEPT] = self.scratch.scratch_slot(primitive.sizes[KEPT])
            function = self.scene.function(primitive, at)
            names = primitive.operands[at]
            self.kept.append(ValueCall(function, names, {n: operands[n] for n in names}, {KEPT}, set(), []))
        names = primitive.operands[along]
        g.read = [p for n, p in operands.items() if n not in g.outs and n in {*primitive.operands[at], *names}]
        spots: list[tuple[Slot | None, bool]] = []
        for n in names:
            name = n.removeprefix(AROUND)
            zero = name != n and name not in g.outs and name not in moving
            spots.append((None if zero else operands[name], name != n))
        outs = [n for n in g.outs if AROUND + n in names]
        ins = [n for n in moving if AROUND + n in names]
        if not ins:
            return self._still(g)
        self._call(self.scene.function(primitive, along), spots, [], [operands[n] for n in ins],
                   [operands[n] for n in outs if n not in g.added], [operands[n] for n in outs if n in g.added])  # fmt: skip
        return None

    def _still(self, g: ValueCall) -> None:
        """Record a call whose input tangents are zero; its output tangents are also zero."""
        outs = [g.operands[n] for n in g.outs if n not in g.added]
        if outs:
            self.calls.append(TangentCall(B.COPY, [], [], [], outs, []))

    def _call(self, function: int, spots: list[tuple[Slot | None, bool]], numbers: list[int], ins: list[Slot], outs: list[Slot],
              added: list[Slot]) -> None:  # fmt: skip
        self.calls.append(TangentCall(function, spots, numbers, ins, outs, added))
        for b in [*outs, *added]:
            self.active.add(b)

    def _derive_builtin(self, g: ValueCall) -> None:
        a, b, out = (g.operands.get(n) for n in ("a", "b", "out"))
        assert out is not None
        if not out.size:  # a joint without constraints has no rows, and the product is empty
            return None
        ins = [x for x in (a, b) if x is not None and x in self.active]
        if not ins or g.function in (B.CURVE_PIECE, B.CURVE_FOOT):  # the selected piece has no first-order effect
            return self._still(g)
        added = [out] if g.added else []
        outs = [] if added else [out]
        if g.function in (B.COPY, B.ADD):
            self._call(g.function, [(a, True), (out, True)], g.numbers, ins, outs, added)
            return None
        both = [(a, False), (b, False)] if b is not None else []
        g.read = [x for x, _ in both if x is not None]
        spots = [*both, *[(x if x in ins else None, True) for x in (a, b) if x], (out, True)]
        name = f"tr_tangent_{Builtin(g.function).name.lower()}"
        numbers = g.numbers
        if g.function == B.ADD_COLUMNS:
            name, numbers = "tr_tangent_add_strided_columns", [*g.numbers[:2], g.numbers[0]]
        self._call(self.scene.own_function(name), spots, numbers, ins, outs, added)
        return None

    def linear(self, function: int, operands: Sequence[tuple[Slot, bool]], ins: Iterable[Slot], outs: Iterable[Slot],
               added: Iterable[Slot] = (), numbers: Sequence[int] = ()) -> None:  # fmt: skip
        """Append a call to the program of tangents. The called function is linear in its tangents. operands: slots, each with a
        flag, which is True for tangents. The program of values gets no call."""
        outs, added = [b for b in outs if b.size], [b for b in added if b.size]
        ins = [b for b in ins if b.size and b in self.active]
        spots = [(b if not v or b in self.active or b in [*outs, *added] else None, v) for b, v in operands]
        if ins:
            self._call(function, spots, list(numbers), ins, outs, added)

    # -- the program of values -----------------------------------------------------------------------------------------------------

    def point(self, program: Program, outs: Iterable[Slot] = ()) -> None:
        """Write, in order, the calls whose values the tangents or ``outs`` need. Then write the calls that store values for
        tangents."""
        needed, later, live = SlotSet(), SlotSet(), []
        for b in outs:
            needed.add(b)
        for g in reversed(self.values):
            assert not any(b in later for b in g.read), "a value that a tangent reads is overwritten"
            for b in g.read:
                needed.add(b)
            body = g.function >= BUILTINS and not g.outs
            if body or any(g.operands[n] in needed for n in g.outs):
                live.append(g)
                for n, b in g.operands.items():
                    if n not in g.outs:
                        needed.add(b)
            for n in g.outs:
                later.add(g.operands[n])
        for g in [*reversed(live), *self.kept]:
            program.call(g.function, [g.operands[n] for n in g.names], g.numbers)
