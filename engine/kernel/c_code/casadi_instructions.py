"""Instructions of CasADi functions as single assignments, in Python lists. Each value is computed once.

A query of one instruction costs four microseconds. This module therefore parses the text in which CasADi prints all instructions at
once. One query for each form of a line gives the meaning of this form. This module merges equal operations, because CasADi's search
for them takes longer than all other work. """

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.basics.lazy_data_classes import dataclass

COMMUTES = {ca.OP_ADD, ca.OP_MUL, ca.OP_FMIN, ca.OP_FMAX, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR}
LEAVES = {ca.OP_CONST, ca.OP_INPUT}
RESULT = re.compile(r"@(\d+)")
OFTEN = 4096
"""Number of instructions between two checks for interrupts. These instructions take about ten milliseconds."""
WITHOUT_DIGITS = str.maketrans("", "", "0123456789")
Instruction = tuple[int, int, tuple[int, ...]]
"""(operation, index of its value, indices of its operands)."""


@dataclass
class Assignments:
    """Values by index, in the order of computation. operations: (operation, value, operands). constants: numerical value of each
    constant. inputs: (input, element) of each input value. outputs: (output, element, value)."""

    operations: list[Instruction] = field(default_factory=list)
    constants: dict[int, float] = field(default_factory=dict)
    inputs: dict[int, tuple[int, int]] = field(default_factory=dict)
    outputs: list[tuple[int, int, int]] = field(default_factory=list)
    count: int = 0


def assignments(f: ca.Function) -> Assignments:
    """The instructions of an SX function, with equal instructions merged. Requires the option ``live_variables`` to be off, so that
    each value has its own index."""
    out = Assignments(count=f.sz_w())
    same = list(range(out.count))
    first: dict[tuple, int] = {}
    for k, (op, value, operands) in enumerate(_listed(f)):
        if k % OFTEN == 0:
            heed()
        if op == ca.OP_OUTPUT:
            o, e = f.instruction_output(k)
            out.outputs.append((o, e, same[operands[0]]))
            continue
        if op in LEAVES:
            leaf = repr(f.instruction_constant(k)) if op == ca.OP_CONST else tuple(f.instruction_input(k))
            key: tuple = (op, leaf)
        elif len(operands) == 1:
            key = (op, same[operands[0]])
        else:
            a, b = same[operands[0]], same[operands[1]]
            key = (op, b, a) if b < a and op in COMMUTES else (op, a, b)
        known = first.setdefault(key, value)
        if known != value:
            same[value] = known
        elif op == ca.OP_CONST:
            out.constants[value] = f.instruction_constant(k)
        elif op == ca.OP_INPUT:
            out.inputs[value] = key[1]
        else:
            out.operations.append((op, value, key[1:]))
    return out


_known: dict[str, tuple[int, int]] = {}
"""Operation and number of operands, by the form of a printed line. The form is the line without digits."""


def _listed(f: ca.Function) -> Iterator[Instruction]:
    """All instructions of a function, in order. The operand of an output instruction is the value that the instruction returns."""
    heed()
    text = f.str(True).partition("Algorithm:\n")[2].rstrip("\n")
    heed()
    forms = text.translate(WITHOUT_DIGITS).split("\n")
    lines = text.split("\n")
    heed()
    if len(lines) != f.n_instructions():  # the format is unexpected, so query every instruction
        yield from (_asked(f, k) for k in range(f.n_instructions()))
        return
    numbers = map(int, RESULT.findall(text))
    for k, form in enumerate(forms):
        if form not in _known and not _learn(f, k, form, lines[k]):
            yield _asked(f, k)
            for _ in RESULT.findall(lines[k]):
                next(numbers)
            continue
        op, arity = _known[form]
        value = next(numbers)
        if arity == 2:
            yield op, value, (next(numbers), next(numbers))
        elif op == ca.OP_OUTPUT:
            yield op, 0, (value,)
        elif arity == 1:
            yield op, value, (next(numbers),)
        else:
            yield op, value, ()


def _asked(f: ca.Function, k: int) -> Instruction:
    """Instruction k, as CasADi answers a query."""
    op = f.instruction_id(k)
    if op == ca.OP_OUTPUT:
        return op, 0, tuple(f.instruction_input(k))
    return op, f.instruction_output(k)[0], () if op in LEAVES else tuple(f.instruction_input(k))


def _learn(f: ca.Function, k: int, form: str, line: str) -> bool:
    """Store the operation and operands of a form if CasADi's answer about instruction k agrees with the printed line. Returns
    whether answer and line agree."""
    op, value, operands = _asked(f, k)
    numbers = tuple(map(int, RESULT.findall(line)))
    if numbers != (operands if op == ca.OP_OUTPUT else (value, *operands)):
        return False
    _known[form] = op, len(operands)
    return True
