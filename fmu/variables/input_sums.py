"""An input can be the sum of several sources. Each source is an input of the FMU, and the FMU adds the sources. Hosts cannot add:
SSP 1.0 has no sums, and not every host applies the factors and offsets of connections."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from trunnion.fmu.c_text.literals import number
from trunnion.fmu.variables.outputs_inputs_parameters import SOURCE, Variable


@dataclass(frozen=True)
class Source:
    """A source of an input, which is the sum of factor · value + offset over its sources. unit: unit of the value; "" for the unit
    of the input. base: attributes of the unit's base unit, if Trunnion does not know the unit."""

    factor: float = 1.0
    offset: float = 0.0
    unit: str = ""
    base: Mapping[str, str] = field(default_factory=dict)


Sums = Mapping[str, Sequence[Source]]
"""The sources of inputs, by name of the input."""


def source_name(name: str, index: int) -> str:
    """The name of the source with an index, from 0, of an input."""
    return f"{name if name.startswith('inputs.') else f'inputs.{name}'}.source[{index + 1}]"


def with_input_sources(listed: Sequence[Variable], sums: Sums, columns: int) -> list[Variable]:
    """The variables, with the sources of inputs inserted after the inputs. Inputs that are sums become local variables. columns:
    number of outputs at the beginning of the list."""
    inputs = [v for v in listed if v.causality == "input"]
    sources = [s for i, v in enumerate(inputs) for s in _sources(v, i, sums.get(v.name, ()))]
    shown = [replace(v, causality="local", initial="calculated", start=None) if v.name in sums else v for v in inputs]
    return [*listed[:columns], *shown, *sources, *listed[columns + len(inputs) :]]


def _sources(v: Variable, index: int, given: Sequence[Source]) -> Iterator[Variable]:
    """The sources of an input. The start value of the first source is chosen so that the sum equals the start value of the
    input."""
    rest = (v.start or 0.0) - sum(s.offset for s in given)
    for k, s in enumerate(given):
        text = f"source {k + 1} of {v.name}, which is the sum of its sources; this source adds {s.factor!r} × value + {s.offset!r}"
        start = rest / s.factor if k == 0 and s.factor != 0.0 else 0.0
        yield Variable(source_name(v.name, k), s.unit or v.unit, text, "input", "continuous", "", start, role=SOURCE, index=index)


def sources_of(listed: Sequence[Variable], place: int, columns: int) -> list[int]:
    """The indices, from 1, of the sources of the input with the index ``place``. For an input that is not a sum, the result is its
    own index. columns: number of outputs at the beginning of the list."""
    return [i + 1 for i, v in enumerate(listed) if v.role == SOURCE and columns + v.index == place - 1] or [place]


def source_table(listed: Sequence[Variable], sums: Sums) -> tuple[str, int]:
    """The C table of all sources, and their number."""
    sources = [v for v in listed if v.role == SOURCE]
    given = [s for v in listed for s in (sums.get(v.name, ()) if v.role != SOURCE else ())]
    pairs = zip(sources, given, strict=True)
    rows = (f"{{{v.index},{number(s.factor)},{number(s.offset)},{number(v.start or 0.0)}}}" for v, s in pairs)
    return f"static const fmu_source m_source[]={{{','.join(rows) or '{0}'}}};\n", len(sources)
