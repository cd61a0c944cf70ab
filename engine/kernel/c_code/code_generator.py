"""Generation of C code from symbolic expressions, in stages. Each input has a stage (parameters 0, state 1, multipliers 2, …). An
operation belongs to the latest stage of its operands. A result that depends only on parameters is therefore computed once
(``prepare``). A result that depends only on the state is computed before the multipliers. Arrays pass values to later stages. Long
functions are split into pieces, so that the compile time grows linearly with the length. """

from __future__ import annotations

import re
from collections.abc import Sequence

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.c_code.casadi_instructions import Instruction, assignments

SX = ca.SX
PIECE = 2500
"""Number of operations per C function. Above a few thousand, compile time grows faster than linearly. Pieces of 300 or 600
operations would compile in four fifths of the time. Stepping units would then run 10 to 15 percent longer, and dense Jacobians 3
percent."""

SCRATCH = "s_"
"""Name of the array that passes values between the pieces of a stage, if the stage stores no values for later stages."""

BINARY = {
    ca.OP_ADD: "{0}+{1}", ca.OP_SUB: "{0}-{1}", ca.OP_MUL: "{0}*{1}", ca.OP_DIV: "{0}/{1}",
    ca.OP_POW: "pow({0},{1})", ca.OP_CONSTPOW: "pow({0},{1})", ca.OP_FMIN: "fmin({0},{1})", ca.OP_FMAX: "fmax({0},{1})",
    ca.OP_ATAN2: "atan2({0},{1})", ca.OP_COPYSIGN: "copysign({0},{1})", ca.OP_LT: "({0}<{1})", ca.OP_LE: "({0}<={1})",
    ca.OP_EQ: "({0}=={1})", ca.OP_NE: "({0}!={1})", ca.OP_AND: "(({0}!=0)&&({1}!=0))", ca.OP_OR: "(({0}!=0)||({1}!=0))",
    ca.OP_IF_ELSE_ZERO: "(({0}!=0)?{1}:0.0)", ca.OP_FMOD: "fmod({0},{1})", ca.OP_HYPOT: "hypot({0},{1})",
}
UNARY = {
    ca.OP_NEG: "-{0}", ca.OP_SQ: "{0}*{0}", ca.OP_TWICE: "2.0*{0}", ca.OP_INV: "1.0/{0}", ca.OP_SQRT: "sqrt({0})",
    ca.OP_SIN: "sin({0})", ca.OP_COS: "cos({0})", ca.OP_TAN: "tan({0})", ca.OP_ASIN: "asin({0})", ca.OP_ACOS: "acos({0})",
    ca.OP_ATAN: "atan({0})", ca.OP_EXP: "exp({0})", ca.OP_LOG: "log({0})", ca.OP_FABS: "fabs({0})", ca.OP_TANH: "tanh({0})",
    ca.OP_SIGN: "(({0}>0)-({0}<0))", ca.OP_NOT: "({0}==0)", ca.OP_ASSIGN: "{0}", ca.OP_FLOOR: "floor({0})",
}
CALL = re.compile(r"(\w{3,})\((.*)\)")
FUNCTIONS = {name: given.count("{") for form in (BINARY | UNARY).values() for name, given in CALL.findall(form)}
"""Numbers of arguments of the C functions that occur in the forms."""
MATH = "".join(f"double {name}({','.join(['double'] * count)});\n" for name, count in FUNCTIONS.items()) + (
    "#ifndef NAN\n#define NAN __builtin_nan(\"\")\n#define INFINITY __builtin_inf()\n#endif\n"
)
"""Declarations from <math.h> that generated code needs. To include <math.h> would take a sixth of the compile time of a small
unit."""
FORMS = {op: form.replace("{0}", "%s").replace("{1}", "%s") for op, form in (BINARY | UNARY).items()}
DOUBLED = {op for op, form in UNARY.items() if form.count("{0}") == 2}
"""Operations whose C text contains the operand twice."""
DEPTH = 20
"""Largest nesting of operations in an expression. Each operation adds up to three levels of brackets. Compilers accept at least 63
levels (C11, 5.2.4.1)."""
Place = tuple[int, int]


@dataclass(frozen=True)
class Input:
    """A symbolic input: C expression of its first element ("y", "y+3"), symbol, stage. transient: whether only this stage receives
    the input. Elements that later stages need are then stored."""

    name: str
    symbol: SX
    stage: int
    transient: bool = False

    def element(self, i: int) -> str:
        """C expression of element i of the input."""
        base, _, offset = self.name.partition("+")
        return f"{base}[{i + int(offset or 0)}]"


@dataclass(frozen=True)
class Output:
    """Values that a stage writes: C array, offset, expressions. ``accumulate``: the values are added to the array. ``optional``:
    the array may be a null pointer; in this case, the stage skips the operations that only these values need."""

    name: str
    offset: int
    values: Sequence[SX] | SX
    stage: int
    accumulate: bool = False
    optional: bool = False


@dataclass
class Stage:
    """One C function: its name, its parameter list, and the array of its values for later stages ("" for none)."""

    name: str
    arguments: str
    keep: str


@dataclass
class Code:
    """C text of the stages. kept, operations: for each stage, the number of values stored for later stages, and the number of
    operations."""

    text: str
    kept: list[int]
    operations: list[int]


def emit(inputs: list[Input], outputs: list[Output], stages: list[Stage]) -> Code:
    """C code of ``outputs`` as functions of ``inputs``."""
    return _Emitter(inputs, outputs, stages).run()


class _Emitter:
    """Writes the stages of one set of outputs. A pair (stage, piece), the place, names a piece of a stage.

    Lists by value: ``stage`` (−1 for constants), ``home`` (place that computes the value; None for constants and inputs), ``uses``
    (number of reads), ``text`` (C expression at the present place), ``slot`` (array element that passes the value to other places).
    """

    def __init__(self, inputs: list[Input], outputs: list[Output], stages: list[Stage]):
        self.inputs, self.outputs, self.stages = inputs, outputs, stages
        heed()
        values = [ca.densify(o.values if isinstance(o.values, SX) else ca.vertcat(*o.values)) for o in outputs]
        heed()
        self.code = assignments(
            ca.Function("f", [i.symbol for i in inputs], [ca.vec(v) for v in values], {"cse": False, "live_variables": False})
        )
        n = self.code.count
        self.stage, self.uses, self.text = [-1] * n, [0] * n, [""] * n
        self.home: list[Place | None] = [None] * n
        self.order: list[list[list[Instruction]]] = [[[]] for _ in stages]
        self.writes: dict[Place, list[tuple[str, int, str]]] = {}
        self.slot: dict[int, str] = {}
        self.kept = [0] * len(stages)

    def run(self) -> Code:
        self._leaves()
        outside = self._places()
        heed()
        self._assign_slots(outside)
        text = "\n".join(self._function(k) for k in range(len(self.stages)))
        return Code(text, self.kept, [sum(map(len, pieces)) for pieces in self.order])

    def _leaves(self) -> None:
        """Set text and stage of constants and inputs."""
        for v, number in self.code.constants.items():
            self.text[v] = literal(number)
        for v, (i, e) in self.code.inputs.items():
            self.text[v], self.stage[v] = self.inputs[i].element(e), self.inputs[i].stage

    def _places(self) -> set[int]:
        """Put every operation into the latest stage of its operands, split stages into pieces, and count uses. Returns the values
        that are read at places other than their ``home``."""
        stage, home, uses, outside = self.stage, self.home, self.uses, set()
        places: list[Place] = [(k, 0) for k in range(len(self.stages))]
        for op, v, operands in self.code.operations:
            if op in DOUBLED:
                operands *= 2
            k = stage[v] = max(0, *(stage[a] for a in operands))
            piece = self.order[k][-1]
            if len(piece) == PIECE:
                heed()
                places[k] = (k, places[k][1] + 1)
                self.order[k].append(piece := [])
            piece.append((op, v, operands))
            place = home[v] = places[k]
            for a in operands:
                uses[a] += 1
                if home[a] is not place and (home[a] or self._gone(a, k)):
                    outside.add(a)
        for o, i, v in self.code.outputs:
            out = self.outputs[o]
            found = home[v]
            place = found if found and found[0] == out.stage else (out.stage, 0)
            target = f"{out.name}[{out.offset + i}]" + ("+" if out.accumulate else "")
            self.writes.setdefault(place, []).append((target, v, out.name if out.optional else ""))
            uses[v] += 1
            if found != place and (found or self._gone(v, out.stage)):
                outside.add(v)
        return outside

    def _gone(self, v: int, k: int) -> bool:
        """Whether the function of stage k lacks the input v."""
        if v not in self.code.inputs or k <= self.stage[v]:
            return False
        return self.stage[v] == 0 or self.inputs[self.code.inputs[v][0]].transient

    def _assign_slots(self, outside: set[int]) -> None:
        """Assign an array element to each value that is read outside its place."""
        for v in sorted(outside):
            k = self.stage[v]
            self.slot[v] = f"{self.stages[k].keep or SCRATCH}[{self.kept[k]}]"
            self.kept[k] += 1

    def _piece(self, place: Place, members: list[Instruction]) -> list[str]:
        """Statements of a piece. Operations that only optional outputs need come last. Before these operations, the function
        returns if the array is absent."""
        heed()
        writes = self.writes.get(place, [])
        optional = {array for _, _, array in writes if array}
        needed = self._needed(members, {v for _, v, array in writes if not array}) if optional else {v for _, v, _ in members}
        deep: dict[int, int] = {}
        body = self._statements([m for m in members if m[1] in needed], deep)
        body += [f"{target}={self.text[v]};" for target, v, array in writes if not array]
        body += [f"if({array}==0)return;" for array in optional]
        body += self._statements([m for m in members if m[1] not in needed], deep)
        body += [f"{target}={self.text[v]};" for target, v, array in writes if array]
        for _, v, _ in members:
            if v in self.slot:
                self.text[v] = self.slot[v]
        return body

    def _needed(self, members: list[Instruction], wanted: set[int]) -> set[int]:
        """The results of a piece that the values ``wanted`` or other places need."""
        needed = wanted | self.slot.keys()
        for _, v, operands in reversed(members):
            if v in needed:
                needed |= set(operands)
        return needed

    def _statements(self, members: list[Instruction], deep: dict[int, int]) -> list[str]:
        """Statements of some operations of a piece. A value that is used once is written into the expression that uses it, up to
        the nesting ``DEPTH``. These nested expressions halve the text and the number of variables. deep: nesting of the written
        values."""
        text, body = self.text, []
        for op, v, operands in members:
            words = FORMS[op] % tuple([text[a] for a in operands])
            depth = 1 + max([deep.get(a, 0) for a in operands])
            if self.uses[v] == 1 and v not in self.slot and depth < DEPTH:
                text[v], deep[v] = f"({words})", depth
                continue
            text[v] = f"v{v}"
            body.append(f"double v{v}={words};")
            if v in self.slot:
                body.append(f"{self.slot[v]}=v{v};")
        return body

    def _function(self, k: int) -> str:
        """C text of a stage. The function of a long stage calls the functions of its pieces."""
        stage = self.stages[k]
        bodies = [self._piece((k, p), members) for p, members in enumerate(self.order[k])]
        for v in self.code.inputs:
            if v in self.slot and self.stage[v] == k:
                bodies[0].insert(0, f"{self.slot[v]}={self.text[v]};")
                self.text[v] = self.slot[v]
        if len(bodies) == 1:
            return f"void {stage.name}({stage.arguments}){{\n" + "\n".join(bodies[0]) + "\n}\n"
        own = not stage.keep
        arguments = stage.arguments + (f",double*restrict {SCRATCH}" if own else "")
        call = ",".join(a.split("*")[-1].split()[-1] for a in arguments.split(","))
        parts = [
            f"static __attribute__((noinline)) void {stage.name}_{p}({arguments}){{\n" + "\n".join(b) + "\n}\n"
            for p, b in enumerate(bodies)
        ]
        calls = "\n".join(f"{stage.name}_{p}({call});" for p in range(len(bodies)))
        if own:
            calls = f"double {SCRATCH}[{max(self.kept[k], 1)}];\n" + calls
        return "\n".join(parts) + f"void {stage.name}({stage.arguments}){{\n{calls}\n}}\n"


def literal(value: float) -> str:
    """C text that compilers read as exactly this double. Infinities and NaN have their C names."""
    if value != value:
        return "NAN"
    if value in (float("inf"), -float("inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    text = repr(float(value))
    return f"({text})" if value < 0 else text
