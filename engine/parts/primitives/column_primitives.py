"""Primitives of output columns, built from the definitions in ``trunnion.columns``."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca

from trunnion.columns.operands import Operand
from trunnion.columns.registry import REGISTRY
from trunnion.kernel.interface.runtime_tables import MOTION
from trunnion.kernel.units.motion_and_inertia_packing import unpack_motion
from trunnion.parts.primitives.friction import FrictionSymbols, element_of
from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import OUT, PIN_OUT, FrictionKey, Primitive
from trunnion.recursion.body_kinematics import Motion, Pose
from trunnion.recursion.complement_equation_terms import friction_terms
from trunnion.recursion.vector_algebra import SX, zeros
from trunnion.system.structure.friction_joint_indices import everything

Symbols = tuple[dict[str, SX], Any]
"""For an operand: symbols of its slots, by name, and the argument that the column's expression receives."""


@cache
def column(kind: str, structures: tuple[Hashable, ...]) -> Primitive:
    """The primitive that computes columns of one kind. Its operands are those of the kind's expression, then the outputs, whose
    names begin with ``OUT``. structures: for each operand, the data on which the code depends, such as a size or a friction key
    (``parts.programs.column_operand_slots``). ``sizes`` of the primitive are the sizes of its outputs."""
    declared = REGISTRY[kind]
    inputs: dict[str, SX] = {}
    arguments: dict[str, Any] = {}
    for (name, operand), structure in zip(declared.operands.items(), structures, strict=True):
        symbols, arguments[name] = FORMS.get(operand.name, _plain)(name, operand, structure)
        inputs |= symbols
    outputs = {n: v if isinstance(v, SX) else ca.vertcat(*v) for n, v in declared.expression(**arguments).items()}
    words = [x.name if isinstance(x, FrictionKey) else x for x in structures if isinstance(x, str | FrictionKey)]
    made = expression_primitive("_".join(["o", kind, *words]), inputs, {OUT + n: v for n, v in outputs.items()})
    return replace(made, sizes={n: int(v.numel()) for n, v in outputs.items()})


def _plain(name: str, operand: Operand, structure: Hashable) -> Symbols:
    """A vector. If a joint determines the size of the vector, ``structure`` is this size."""
    value = SX.sym(name, structure if isinstance(structure, int) else operand.size)
    return {name: value}, value


def _motion(name: str, *_: Any) -> Symbols:
    value = SX.sym(name, MOTION)
    return {name: value}, unpack_motion(ca.vertsplit(value))


def _ends(*_: Any) -> Symbols:
    both: list[tuple[dict[str, SX], Motion]] = [_motion("a"), _motion("b")]
    return both[0][0] | both[1][0], (both[0][1], both[1][1])


def _pose(name: str, operand: Operand, _: Hashable) -> Symbols:
    value = SX.sym(name, operand.size)
    return {name: value}, Pose(ca.reshape(value[:9], 3, 3), ca.reshape(value[9:18], 3, 3), value[18:])


def _arm(name: str, operand: Operand, structure: Hashable) -> Symbols:
    return ({}, zeros(3)) if structure == PIN_OUT else _plain(name, operand, structure)


def _friction(_: str, operand: Operand, structure: Hashable) -> Symbols:
    assert isinstance(structure, FrictionKey)
    sym = FrictionSymbols(structure)
    terms = friction_terms(sym, element_of(structure, everything(structure.joint)))
    return {"numbers": sym.p, "modes": sym.modes, "b": sym.b}, terms


FORMS: dict[str, Callable[..., Symbols]] = {
    "body_motion": _motion, "load_ends": _ends, "joint_pose": _pose, "reaction_arm": _arm, "friction": _friction,
}  # fmt: skip
"""Operands that are not plain vectors."""
