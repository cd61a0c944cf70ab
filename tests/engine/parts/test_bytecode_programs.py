"""Optimised programs of bytecode have fewer calls and the same effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.scalable_mechanisms import revolute_chain
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.scene.data_classes.joints import Friction
from trunnion.system.construction.system_builder import build

ARRAYS = (Space.T, Space.OUT, Space.A)


def random_program(rng: np.random.Generator) -> Program:
    """Zeros and copies of short slots, many of them adjacent, also within one array."""
    program, at = Program(), dict.fromkeys(ARRAYS, 0)
    for _ in range(40):
        size = int(rng.integers(1, 4))
        places = [ARRAYS[i] for i in rng.integers(0, len(ARRAYS), 2)]
        source, out = (Slot(p, (at[p] + int(rng.integers(-1, 2)) * size) % 20, size) for p in places)
        program.zero(out) if rng.random() < 0.5 else program.copy(source, out)
        at |= {places[0]: source.at, places[1]: out.at + size}
    return program


def random_products(rng: np.random.Generator) -> Program:
    """Dot products and sums of single columns. Many of them have equidistant rows, numbers and results."""
    program = Program()
    for _ in range(12):
        spaces, first = rng.integers(0, 3, 3), rng.integers(0, 8, 3)
        rows, numbers, out = (Slot(ARRAYS[i], int(a), 2) for i, a in zip(spaces, first, strict=True))
        dot, sign, steps = bool(rng.random() < 0.5), int(rng.choice([1, 1, 1, -1])), rng.integers(-1, 4, 2)
        for k in range(int(rng.integers(1, 5))):
            row = rows._replace(at=abs(rows.at + k * int(steps[0])))
            if dot:
                program.call(Builtin.ADD_DOT, [row, numbers, out._replace(at=abs(out.at + k * int(steps[1])), size=1)], [2, sign])
            else:
                program.call(Builtin.ADD_COLUMNS, [row, numbers._replace(at=numbers.at + k, size=1), out], [2, 1])
    return program


def added(out: dict[int, list[float]], call: list[int]) -> None:
    """Execute a call that adds products, number by number."""
    (a, i), (b, j), (to, at), n, count = call[3:5], call[5:7], call[7:9], call[9], call[10]
    if call[0] in (Builtin.ADD_DOT, Builtin.ADD_ROW_DOTS):
        count, sign, stride, step = (1, count, 0, 0) if call[0] == Builtin.ADD_DOT else (count, 1, *call[11:])
        for k in range(count):
            out[to][at + k * step] += sign * sum(out[a][i + k * stride + q] * out[b][j + q] for q in range(n))
        return
    stride = n if call[0] == Builtin.ADD_COLUMNS else call[11]
    for k in range(count):
        for q in range(n):
            out[to][at + q] += out[a][i + k * stride + q] * out[b][j + k]


def executed(code: list[int], arrays: dict[int, list[float]]) -> dict[int, list[float]]:
    """The arrays after the calls of a program have run."""
    out = {space: [*numbers] for space, numbers in arrays.items()}
    while code:
        operands, numbers = code[1], code[2]
        spots, size = code[3 : 3 + 2 * operands], code[3 + 2 * operands]
        space, at = spots[-2:]
        if code[0] in (Builtin.ZERO, Builtin.COPY):
            new = [0.0] * size if code[0] == Builtin.ZERO else out[spots[0]][spots[1] : spots[1] + size]
            out[space][at : at + size] = new
        else:
            added(out, list(code[: 3 + 2 * operands + numbers]))
        code = code[3 + 2 * operands + numbers :]
    return out


@pytest.mark.parametrize("seed", range(30))
def test_merged_calls_write_the_same_numbers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    program = random_program(rng)
    arrays = {int(s): rng.random(30).tolist() for s in ARRAYS}
    merged = program.merged()
    assert executed(merged, arrays) == executed(program.code, arrays)


@pytest.mark.parametrize("seed", range(30))
def test_products_with_equidistant_rows_are_one_call_with_the_same_sums(seed: int) -> None:
    rng = np.random.default_rng(seed)
    program = random_products(rng)
    arrays = {int(s): rng.random(60).tolist() for s in ARRAYS}
    merged = program.merged()
    assert len(merged) < len(program.code)
    assert executed(merged, arrays) == executed(program.code, arrays)


def test_adjacent_zeros_and_copies_are_one_call() -> None:
    program = Program()
    for at in (3, 0, 6):
        program.zero(Slot(Space.T, at, 3))
    for at in (0, 1):
        program.copy(Slot(Space.T, at, 1), Slot(Space.OUT, at + 5, 1))
    assert program.merged() == [Builtin.ZERO, 1, 1, Space.T, 0, 9, Builtin.COPY, 2, 1, Space.T, 0, Space.OUT, 5, 2]


def code_length(bodies: int) -> int:
    """Number of integers in all programs of a chain with friction in each joint."""
    chain = revolute_chain(bodies)
    rough = Friction(mu=0.3, radius=0.02, half_length=0.05)
    built = build(replace(chain, joints={name: replace(j, friction=rough) for name, j in chain.joints.items()}))
    unit = parts_kernel(built.system, len(built.parameters.values), [], False).units["kernel"]
    return sum(len(program.merged()) for program in unit.scene.scene.programs.values())


def test_the_code_of_a_chain_with_friction_grows_linearly_with_its_length() -> None:
    short, middle, long = (code_length(bodies) for bodies in (4, 8, 12))
    assert long - middle == middle - short
