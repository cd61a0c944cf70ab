"""A part of one function: expressions of some inputs, written or added to some outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from engine.kernel.emit import Input, Output, Stage, emit
from engine.parts.known import Part
from engine.recursion.vectors import SX

SIGNATURE = "double*const*a,const int*how"
"""How every part is called: its places, and numbers that it may need."""


@dataclass(frozen=True)
class Told:
    """The expressions of a part, and which outputs are added."""

    name: str
    inputs: dict[str, SX]
    outputs: dict[str, SX]
    added: tuple[str, ...]


def one(name: str, inputs: dict[str, SX], outputs: Mapping[str, SX | Sequence[SX]], added: Sequence[str] = ()) -> Part:
    """The part ``name``, whose places are those of its inputs and then those of its outputs; ``added``: outputs that are added to
    what is there. Inputs and outputs of no length have no place."""
    ins = {k: v for k, v in inputs.items() if v.numel()}
    outs = {k: v if isinstance(v, SX) else ca.vertcat(SX(0, 1), *v) for k, v in outputs.items()}
    outs = {k: ca.vec(ca.densify(v)) for k, v in outs.items() if v.numel()}
    at = {k: f"a[{i}]" for i, k in enumerate([*ins, *outs])}
    code = emit(
        [Input(at[k], v, 0) for k, v in ins.items()], [Output(at[k], 0, v, 0, k in added) for k, v in outs.items()],
        [Stage(name, SIGNATURE, "")],
    )  # fmt: skip
    return Part({name: tuple(at)}, text=code.text, told=Told(name, ins, outs, tuple(added)))
