"""Variables of FMI 3.0. The components of a vector form an array. The array has the value reference of its first component. An
integer variable gets one of FMI 3.0's integer types."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from trunnion.fmu.c_text.literals import integers
from trunnion.fmu.variables.outputs_inputs_parameters import START_Q, START_QD, Variable
from trunnion.fmu.variables.variable_types import ENUMERATIONS, INTEGER

INT32, UINT64, BOOLEAN = "Int32", "UInt64", "Boolean"
FLOAT64, ENUMERATION = "Float64", "Enumeration"
CODES = {FLOAT64: "FMU_FLOAT64", ENUMERATION: "FMU_INT64", INT32: "FMU_INT32", UINT64: "FMU_UINT64", BOOLEAN: "FMU_BOOLEAN"}
"""Names in the C enumeration ``fmu_type`` (``model_and_instance.h``), by FMI type."""
SPACE = 3
"""Smallest number of components of an array of parameters. A vector with omitted components (which have the value 0) remains a set
of scalars."""
COUNTS = ("events.count", "solver.max_steps", "solver.events", "solver.evaluations", "solver.iterations", "realtime.overruns")
FLAGS = ("events.last.marginal",)
"""COUNTS: integers that are numbers of things. FLAGS: integers that mean true or false. Other integers are identifiers."""


@dataclass(frozen=True)
class Fmi3Variable:
    """A variable of FMI 3.0. reference: value reference of the first scalar. parts: the scalars."""

    name: str
    reference: int
    parts: tuple[Variable, ...]

    @property
    def first(self) -> Variable:
        """The first component. The components of an array differ only in name, start value and description."""
        return self.parts[0]

    @property
    def description(self) -> str:
        """A description of all components together."""
        texts, numbers = [p.description for p in self.parts], f"1 … {len(self.parts)}"
        if len(set(texts)) == 1:
            return texts[0]
        head, one, tail = texts[0].partition("1")
        if one and all(t == f"{head}{k + 1}{tail}" for k, t in enumerate(texts)):
            return f"{head}{numbers}{tail}"
        return f"{self.name.replace('_', ' ')}: {numbers}"

    @property
    def title(self) -> str:
        """The name, with the range of component numbers for an array."""
        return self.name if len(self.parts) == 1 else f"{self.name} [1 … {len(self.parts)}]"

    @property
    def type(self) -> str:
        kind = self.first.type
        if kind in ENUMERATIONS:
            return ENUMERATION
        if kind != INTEGER:
            return FLOAT64
        return UINT64 if self.name in COUNTS else BOOLEAN if self.name in FLAGS else INT32


def fmi3_variables(listed: Sequence[Variable], scalars: bool = False) -> list[Fmi3Variable]:
    """The variables of FMI 3.0, formed from the scalar variables of FMI 2.0, in order of their value references. scalars: whether
    all variables remain scalars."""
    out: list[Fmi3Variable] = []
    at = 0
    while at < len(listed):
        name, count = (listed[at].name, 1) if scalars else _array(listed, at)
        out.append(Fmi3Variable(name, at, tuple(listed[at : at + count])))
        at += count
    return out


def _array(listed: Sequence[Variable], at: int) -> tuple[str, int]:
    """The name and the number of scalars of the variable that begins at index ``at``."""
    first = listed[at]
    base = first.name.removesuffix("[1]")
    if base == first.name or first.causality == "input":
        return first.name, 1
    count = 1
    while at + count < len(listed) and _continues(first, listed[at + count], f"{base}[{count + 1}]"):
        count += 1
    vector = count >= SPACE or (count > 1 and (first.causality != "parameter" or first.role in (START_Q, START_QD)))
    return (base, count) if vector else (first.name, 1)


def _continues(first: Variable, other: Variable, name: str) -> bool:
    """Whether a scalar is the component ``name`` of the array that begins with ``first``."""
    if other.name != name:
        return False
    same = ("unit", "causality", "variability", "initial", "type", "minimum", "maximum", "nominal")
    return all(getattr(first, s) == getattr(other, s) for s in same)


def fmi3_variable_tables(made: Sequence[Fmi3Variable]) -> str:
    """Two C arrays with an element for each value reference: the number of values, and the type."""
    widths = [len(f.parts) if i == 0 else 0 for f in made for i in range(len(f.parts))]
    kinds = ",".join(CODES[f.type] for f in made for _ in f.parts)
    return integers("m_width", widths) + f"static const int m_type[]={{{kinds or '0'}}};\n"
