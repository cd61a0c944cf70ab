"""C code that is generated from expressions computes the values of CasADi, with any number of stages and pieces."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from trunnion.kernel.c_code import casadi_instructions, code_generator
from trunnion.kernel.c_code.code_generator import Input, Output, Stage
from trunnion.kernel.compilation import c_compiler, library_cache

SX = ca.SX
NP, NX, NZ = 5, 6, 4
PIECES = (3, 40, 2500)
SEEDS = range(4)
HOLD = "const double*restrict "

UNARY = {
    "neg": lambda a: -a,
    "sq": lambda a: a * a,
    "twice": lambda a: 2 * a,
    "inv": lambda a: 1 / (2 + a * a),
    "sqrt": lambda a: ca.sqrt(ca.fabs(a)),
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": lambda a: ca.tan(ca.tanh(a)),
    "asin": lambda a: ca.asin(ca.tanh(a)),
    "acos": lambda a: ca.acos(ca.tanh(a)),
    "atan": ca.atan,
    "exp": lambda a: ca.exp(ca.tanh(a)),
    "log": lambda a: ca.log(1.5 + ca.tanh(a)),
    "fabs": ca.fabs,
    "tanh": ca.tanh,
    "sign": ca.sign,
    "not": ca.logic_not,
    "floor": ca.floor,
}
BINARY = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / (1 + b * b),
    "pow": lambda a, b: (1 + ca.fabs(ca.tanh(a))) ** ca.tanh(b),
    "constpow": lambda a, b: (1 + ca.fabs(a)) ** 0.3,
    "fmin": ca.fmin,
    "fmax": ca.fmax,
    "atan2": ca.atan2,
    "copysign": ca.copysign,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: ca.floor(a) == ca.floor(b),
    "ne": lambda a, b: ca.floor(a) != ca.floor(b),
    "and": lambda a, b: ca.logic_and(a > 0, b > 0),
    "or": lambda a, b: ca.logic_or(a > 0, b > 0),
    "if": lambda a, b: ca.if_else(a > b, a, b),
    "fmod": lambda a, b: ca.fmod(a, 1.5 + ca.fabs(b)),
    "hypot": lambda a, b: ca.hypot(a, b),
}


def random_outputs(seed: int, inputs: list[SX], length: int = 160) -> list[SX]:
    """Expressions over the inputs. In each round, each operation occurs once with random operands. Sizes of values stay near 1."""
    rng = np.random.default_rng([seed, sum(i.numel() for i in inputs)])
    values = [x[i] for x in inputs for i in range(x.numel())] + [SX(float(c)) for c in (0.3, -1.7, 0.0, -2.0)]
    operations = [*UNARY.values(), *BINARY.values()]
    for k in range(length):
        f = operations[k % len(operations)]
        a, b = (values[int(i)] for i in rng.integers(len(values), size=2))
        new = f(a) if k % len(operations) < len(UNARY) else f(a, b)
        values.append(ca.if_else(ca.fabs(new) < 50, new, ca.tanh(new)))
    picked = rng.permutation(len(values))[:25].tolist()
    return [*(values[i] for i in picked), *values[-15:], inputs[0][1], SX(2.5), inputs[-1][0]]


def staged(name: str, seed: int) -> tuple[str, ca.Function, list[int]]:
    """Three stages: parameters, then x, then z. The last two stages have outputs, some of which an earlier stage already
    determines."""
    p, x, z = SX.sym("p", NP), SX.sym("x", NX), SX.sym("z", NZ)
    early, late = random_outputs(seed, [p, x]), random_outputs(seed, [p, x, z])
    stages = [
        Stage(f"{name}_0", f"{HOLD}p,double*restrict c", "c"),
        Stage(f"{name}_1", f"{HOLD}x,{HOLD}c,double*restrict w,double*restrict a", "w"),
        Stage(f"{name}_2", f"{HOLD}x,{HOLD}c,{HOLD}w,{HOLD}z,double*restrict b", ""),
    ]
    ins = [Input("p", p, 0), Input("x", x[:2], 1), Input("x+2", x[2:], 1), Input("z", z, 2)]
    code = code_generator.emit(ins, [Output("a", 1, early, 1), Output("b", 0, late[:7], 2), Output("b", 7, late[7:], 2)], stages)
    return code.text, ca.Function("f", [p, x, z], [ca.vertcat(*early), ca.vertcat(*late)]), code.kept


@pytest.fixture(scope="module")
def cases() -> dict[tuple[int, int], tuple[str, ca.Function, list[int], str]]:
    """Cases by seed and size of the pieces. A case has a name, a function, the number of kept values a stage, and C code."""
    made = {}
    before = code_generator.PIECE
    try:
        for piece in PIECES:
            code_generator.PIECE = piece
            for seed in SEEDS:
                name = f"f{seed}_{piece}"
                code, function, kept = staged(name, seed)
                made[seed, piece] = (name, function, kept, code)
    finally:
        code_generator.PIECE = before
    return made


def library(folder: Path, code: str) -> ctypes.CDLL:
    """The code of a case, compiled with contraction off so that every operation rounds as CasADi's."""
    source, target = folder / "emit.c", folder / f"emit{c_compiler.library_suffix()}"
    source.write_text(f"#include <math.h>\n{code}")
    c_compiler.build_library([source], target, [folder], library_cache.cache_folder(), ["-ffp-contract=off"])
    return ctypes.CDLL(str(target))


def call(lib: ctypes.CDLL, name: str, kept: list[int], p, x, z, sizes) -> tuple[np.ndarray, np.ndarray]:
    """The outputs of a case after prepare, stage 1 and stage 2."""
    c, w = np.full(kept[0] + 1, np.nan), np.full(kept[1] + 1, np.nan)
    a, b = np.full(sizes[0] + 1, np.nan), np.full(sizes[1], np.nan)

    def run(stage: int, *arrays: np.ndarray) -> None:
        getattr(lib, f"{name}_{stage}")(*(ctypes.c_void_p(v.ctypes.data) for v in arrays))

    run(0, p, c)
    run(1, x, c, w, a)
    run(2, x, c, w, z, b)
    return a[1:], b


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("piece", PIECES)
@pytest.mark.parametrize("seed", SEEDS)
def test_c_code_is_casadis_value_bit_for_bit(cases, seed: int, piece: int, tmp_path: Path) -> None:
    name, function, kept, code = cases[seed, piece]
    lib = library(tmp_path, code)
    rng = np.random.default_rng(seed)
    for _ in range(20):
        p, x, z = (rng.normal(size=n) * 2 for n in (NP, NX, NZ))
        expected = [v.full().ravel() for v in function(p, x, z)]
        got = call(lib, name, kept, p, x, z, [v.size for v in expected])
        for one, other in zip(expected, got, strict=True):
            assert np.isfinite(one).all()
            assert np.array_equal(one, other)


def test_code_cut_into_small_pieces_has_many_functions(cases) -> None:
    assert all(code.count("noinline") > 20 for (_, piece), (*_, code) in cases.items() if piece == 3)
    assert all("noinline" not in code for (_, piece), (*_, code) in cases.items() if piece == 2500)


def test_every_operation_is_tried(cases) -> None:
    """The random outputs use every operation of both tables except assignment, which CasADi adds itself."""
    seen = {f.instruction_id(k) for _, f, *_ in cases.values() for k in range(f.n_instructions())}
    assert set(code_generator.UNARY) | set(code_generator.BINARY) <= seen | {ca.OP_ASSIGN}


def test_terms_of_parameters_alone_are_computed_in_the_first_stage() -> None:
    p, x = SX.sym("p", 2), SX.sym("x", 1)
    stages = [Stage("prepare", f"{HOLD}p,double*restrict c", "c"), Stage("rest", f"{HOLD}x,{HOLD}c,double*restrict out", "")]
    code = code_generator.emit([Input("p", p, 0), Input("x", x, 1)], [Output("out", 0, [ca.sin(p[0]) * p[1] + x], 1)], stages)
    prepare, rest = code.text.split("void rest")
    assert "sin(" in prepare
    assert "sin(" not in rest
    assert "p[" not in rest  # later stages have no access to the parameters
    assert code.operations == [2, 1]


@pytest.mark.parametrize("value", [0.1, -0.1, 1e-300, 5e-324, -1.7976931348623157e308, 3.0, 2.0**-1074 * 3])
def test_literals_read_back_exactly(value: float) -> None:
    assert float(code_generator.literal(value).strip("()")) == value
    # parentheses, because a minus sign before a negative literal would be a decrement
    assert code_generator.literal(value).startswith("(") == (value < 0)


def test_infinities_are_written_as_c_knows_them() -> None:
    assert code_generator.literal(float("inf")) == "INFINITY"


def test_the_compilers_own_flags_change_only_the_last_digits() -> None:
    """Contraction rounds once where CasADi rounds twice. The flags must change nothing else (without fast-math, NaN stays NaN)."""
    assert "-ffp-contract=fast" in c_compiler.FLAGS
    assert not any("fast-math" in f or "Ofast" in f or "finite-math" in f for f in c_compiler.FLAGS)


def alike(found: Iterable[casadi_instructions.Instruction]) -> list[casadi_instructions.Instruction]:
    """The instructions, in which powers with a constant exponent are written as general powers, because both are printed alike."""
    return [(ca.OP_POW if op == ca.OP_CONSTPOW else op, value, operands) for op, value, operands in found]


def asked(f: ca.Function) -> list[casadi_instructions.Instruction]:
    """All instructions, in a text that requests each instruction separately."""
    return alike(casadi_instructions._asked(f, k) for k in range(f.n_instructions()))


def random_function(seed: int) -> ca.Function:
    """A function of random expressions. Each value of the function has its own number."""
    x = SX.sym("x", NX)
    return ca.Function("f", [x], [ca.vertcat(*random_outputs(seed, [x]))], {"live_variables": False})


@pytest.mark.parametrize("seed", SEEDS)
def test_instructions_read_from_print_are_those_that_are_asked_for(seed: int) -> None:
    f = random_function(seed)
    assert alike(casadi_instructions._listed(f)) == asked(f)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("change", [("Algorithm:", "Steps:"), ("@", "%"), ("@", "@1"), (";\n", "; \n\n")])
def test_a_library_that_prints_otherwise_is_asked(monkeypatch: pytest.MonkeyPatch, change: tuple[str, str]) -> None:
    f = random_function(0)
    printed = f.str(True).replace(change[0], change[1])
    monkeypatch.setattr(casadi_instructions, "_known", {})
    monkeypatch.setattr(ca.Function, "str", lambda self, more: printed)
    assert alike(casadi_instructions._listed(f)) == asked(f)


def test_equal_operations_are_made_once_whichever_way_round() -> None:
    x = SX.sym("x", 2)
    twice = [ca.sin(x[0] * x[1]) + 0.5, ca.sin(x[1] * x[0]) + 0.5, x[0] - x[1], x[1] - x[0]]
    f = ca.Function("f", [x], [ca.vertcat(*twice)], {"live_variables": False, "cse": False})
    found = casadi_instructions.assignments(f)
    assert [op for op, _, _ in found.operations] == [ca.OP_MUL, ca.OP_SIN, ca.OP_ADD, ca.OP_SUB, ca.OP_SUB]
    (_, _, first), (_, _, second), *_ = found.outputs
    assert first == second
