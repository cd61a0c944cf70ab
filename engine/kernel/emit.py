"""Symbolic expressions → C, in stages.

Inputs have a stage (parameters 0, state 1, multipliers 2, …). An operation belongs to the latest stage of what it depends on, so
everything that depends on parameters alone is computed once (``prepare``), everything that depends on the state alone before the
multipliers are known, and so on; values needed later are kept in an array. Long functions are cut into pieces, which makes
compile time linear in their length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca

SX = ca.SX
PIECE = 2500
"""Statements per C function: compile time grows faster than linearly beyond a few thousand, run time does not suffer here."""

SCRATCH = "s_"
"""Array that carries values between the pieces of a stage that keeps nothing for later ones."""

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


@dataclass(frozen=True)
class Input:
    """A symbolic input: C expression of its first element ("y", "y+3"), symbol, stage. ``transient``: later stages are not handed
    it, so what they need of it is kept."""

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
    """Values to be written (or added, ``accumulate``) by a stage: C array name, offset there, expressions."""

    name: str
    offset: int
    values: Sequence[SX] | SX
    stage: int
    accumulate: bool = False


@dataclass
class Stage:
    """One C function: its name, its parameter list, and where values for later stages go ("" = nowhere)."""

    name: str
    arguments: str
    keep: str
    statements: list[tuple[int, str]] = field(default_factory=list)


@dataclass
class Code:
    """C text of the stages, and the sizes of the arrays that carry values between them."""

    text: str
    kept: list[int]
    operations: list[int]


def emit(inputs: list[Input], outputs: list[Output], stages: list[Stage]) -> Code:
    """C code of ``outputs`` as functions of ``inputs``."""
    return _Emitter(inputs, outputs, stages).run()


class _Emitter:
    def __init__(self, inputs: list[Input], outputs: list[Output], stages: list[Stage]):
        self.inputs, self.outputs, self.stages = inputs, outputs, stages
        values = [ca.densify(o.values if isinstance(o.values, SX) else ca.vertcat(*o.values)) for o in outputs]
        options = {"cse": True, "live_variables": False}
        self.f = ca.Function("f", [i.symbol for i in inputs], [ca.vec(v) for v in values], options)
        self.text: dict[int, str] = {}
        self.stage: dict[int, int] = {}
        self.slot: dict[int, str] = {}
        self.kept = [0] * len(stages)
        self.counts = [0] * len(stages)
        self.home: dict[int, tuple[int, int]] = {}
        self.transient: set[int] = set()
        self.op: dict[int, tuple[str, tuple[int, ...]]] = {}
        self.writes: list[tuple[int, str, int]] = []

    def run(self) -> Code:
        self._read()
        order = self._order()
        users = self._users(order)
        self._assign_slots(users)
        for k, stage in enumerate(self.stages):
            stage.statements = []
            self._statements(k, order[k])
        text = "\n".join(self._function(k, s) for k, s in enumerate(self.stages))
        return Code(text, self.kept, self.counts)

    def _read(self) -> None:
        """Read the expression graph as single assignments, and note the stage of every value."""
        f, stage, operations = self.f, self.stage, self.op
        kind, taken, made = f.instruction_id, f.instruction_input, f.instruction_output
        for k in range(f.n_instructions()):
            op = kind(k)
            if op in UNARY:
                v, a = made(k)[0], taken(k)[0]
                operations[v] = (UNARY[op], (a,))
                stage[v] = max(0, stage[a])
            elif op in BINARY:
                v, pair = made(k)[0], tuple(taken(k))
                operations[v] = (BINARY[op], pair)
                stage[v] = max(0, stage[pair[0]], stage[pair[1]])
            elif op == ca.OP_OUTPUT:
                o, i = made(k)
                out = self.outputs[o]
                target = f"{out.name}[{out.offset + i}]" + ("+" if out.accumulate else "")
                self.writes.append((out.stage, target, taken(k)[0]))
            elif op == ca.OP_CONST:
                v = made(k)[0]
                self.text[v], stage[v] = literal(f.instruction_constant(k)), -1
            elif op == ca.OP_INPUT:
                v, (i, e) = made(k)[0], taken(k)
                stage[v] = self.inputs[i].stage
                self.text[v] = self.inputs[i].element(e)
                if self.inputs[i].transient or self.inputs[i].stage == 0:
                    self.transient.add(v)
            else:
                raise KeyError(f"no C text for operation {op}")

    def _order(self) -> list[list[int]]:
        """Operations of every stage in order of computation, cut into pieces; ``home`` notes the stage and piece of each value."""
        order: list[list[int]] = [[] for _ in self.stages]
        places = [(k, 0) for k in range(len(order))]
        for v in self.op:
            k = self.stage[v]
            members = order[k]
            if members and len(members) % PIECE == 0:
                places[k] = (k, len(members) // PIECE)
            self.home[v] = places[k]
            members.append(v)
        self.counts = [len(o) for o in order]
        return order

    def _users(self, order: list[list[int]]) -> dict[int, set[tuple[int, int]]]:
        """For each value the places (stage, piece) that use it."""
        users: dict[int, set[tuple[int, int]]] = {}
        for members in order:
            for v in members:
                place = self.home[v]
                for a in self.op[v][1]:
                    found = users.get(a)
                    if found is None:
                        users[a] = {place}
                    else:
                        found.add(place)
        for stage, _, v in self.writes:
            place = self.home.get(v, (stage, 0))
            users.setdefault(v, set()).add(place if place[0] == stage else (stage, 0))
        return users

    def _assign_slots(self, users: dict[int, set[tuple[int, int]]]) -> None:
        """Give each value that is used outside its own piece an element of the array that carries it there. Transient inputs that
        later stages read are copied too."""
        for v, places in users.items():
            source = self.stage[v]
            if source < 0:
                continue
            home = self.home.get(v)
            outside = home is not None and (len(places) > 1 or home not in places)
            if outside or (v in self.transient and any(p[0] > source for p in places)):
                keep = self.stages[source].keep or SCRATCH
                self.slot[v] = f"{keep}[{self.kept[source]}]"
                self.kept[source] += 1

    def _ref(self, v: int, place: tuple[int, int]) -> str:
        if v in self.op:
            return f"v{v}" if self.home[v] == place else self.slot[v]
        if v in self.transient and place[0] > self.stage[v]:
            return self.slot[v]
        return self.text[v]

    def _statements(self, k: int, members: list[int]) -> None:
        """The statements of a stage, with the piece that each is in."""
        home, add = self.home, self.stages[k].statements.append
        for v in members:
            form, args = self.op[v]
            place = home[v]
            words = [f"v{a}" if home.get(a) == place else self._ref(a, place) for a in args]
            add((place[1], f"double v{v}={form.format(*words)};"))
            if v in self.slot:
                add((place[1], f"{self.slot[v]}=v{v};"))

    def _function(self, k: int, stage: Stage) -> str:
        """C text of a stage's function; a long one calls its pieces one after the other."""
        pieces = max((p for p, _ in stage.statements), default=0) + 1
        bodies: list[list[str]] = [[] for _ in range(pieces)]
        for v, slot in self.slot.items():
            if v not in self.op and self.stage[v] == k:
                bodies[0].append(f"{slot}={self.text[v]};")
        for p, s in stage.statements:
            bodies[p].append(s)
        for where, target, v in self.writes:
            if where == k:
                p = self.home[v][1] if v in self.op and self.home[v][0] == k else 0
                bodies[p].append(f"{target}={self._ref(v, (k, p))};")
        if pieces == 1:
            return f"void {stage.name}({stage.arguments}){{\n" + "\n".join(bodies[0]) + "\n}\n"
        own = not stage.keep
        arguments = stage.arguments + (f",double*restrict {SCRATCH}" if own else "")
        call = ",".join(a.split("*")[-1].split()[-1] for a in arguments.split(","))
        parts = [
            f"static __attribute__((noinline)) void {stage.name}_{p}({arguments}){{\n" + "\n".join(b) + "\n}\n"
            for p, b in enumerate(bodies)
        ]
        calls = "\n".join(f"{stage.name}_{p}({call});" for p in range(pieces))
        if own:
            calls = f"double {SCRATCH}[{max(self.kept[k], 1)}];\n" + calls
        return "\n".join(parts) + f"void {stage.name}({stage.arguments}){{\n{calls}\n}}\n"


def literal(value: float) -> str:
    """C text of a number, such that a C compiler reads exactly this double; infinities and NaN by their names in C."""
    if value != value:
        return "NAN"
    if value in (float("inf"), -float("inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    text = repr(float(value))
    return f"({text})" if value < 0 else text
