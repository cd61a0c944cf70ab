"""Programs of bytecode: fewer calls with the same effect."""

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


def executed(code: list[int], arrays: dict[int, list[float]]) -> dict[int, list[float]]:
    """The arrays after the calls of a program have run."""
    out = {space: [*numbers] for space, numbers in arrays.items()}
    while code:
        operands, numbers = code[1], code[2]
        spots, size = code[3 : 3 + 2 * operands], code[3 + 2 * operands]
        space, at = spots[-2:]
        new = [0.0] * size if code[0] == Builtin.ZERO else out[spots[0]][spots[1] : spots[1] + size]
        out[space][at : at + size] = new
        code = code[3 + 2 * operands + numbers :]
    return out


@pytest.mark.parametrize("seed", range(30))
def test_merged_calls_write_the_same_numbers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    program = random_program(rng)
    arrays = {int(s): rng.random(30).tolist() for s in ARRAYS}
    merged = program.merged()
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
