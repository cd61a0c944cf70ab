"""A primitive with a single function, built from symbolic expressions of its inputs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.c_code.code_generator import Input, Output, Stage, emit
from trunnion.parts.primitives.primitive_keys import Primitive
from trunnion.recursion.vector_algebra import SX

SIGNATURE = "double*const*a,const int*how"
"""Parameters of every primitive in C: its operands, and integers that builtin ops need."""


@dataclass(frozen=True)
class Expressions:
    """Inputs and outputs of a primitive. added: those outputs that are added to their slot."""

    name: str
    inputs: dict[str, SX]
    outputs: dict[str, SX]
    added: tuple[str, ...]


def expression_primitive(
    name: str, inputs: dict[str, SX], outputs: Mapping[str, SX | Sequence[SX]], added: Sequence[str] = ()
) -> Primitive:
    """The primitive ``name``. In C, the name has underscores in place of all characters except letters and digits. Its operands
    are the inputs, then the outputs; empty vectors are omitted. added: outputs that are added to their slot."""
    name = re.sub(r"\W", "_", name)
    ins = {k: v for k, v in inputs.items() if v.numel()}
    outs = {k: v if isinstance(v, SX) else ca.vertcat(SX(0, 1), *v) for k, v in outputs.items()}
    outs = {k: ca.vec(ca.densify(v)) for k, v in outs.items() if v.numel()}
    at = {k: f"a[{i}]" for i, k in enumerate([*ins, *outs])}
    code = emit(
        [Input(at[k], v, 0) for k, v in ins.items()], [Output(at[k], 0, v, 0, k in added) for k, v in outs.items()],
        [Stage(name, SIGNATURE, "")],
    )  # fmt: skip
    return Primitive({name: tuple(at)}, text=code.text, expressions=Expressions(name, ins, outs, tuple(added)))
