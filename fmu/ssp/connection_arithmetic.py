"""For connections to inputs of a scene, the exported FMU computes factor, offset, unit conversion and sum. Hosts then only copy
values. SSP 1.0 has no sums, and not every host applies factors, offsets and units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import replace

from trunnion.fmu.ssp.system_yaml import Connection, System
from trunnion.fmu.variables.input_sums import Source, source_name

Units = Mapping[str, tuple[str, Mapping[str, str]]]
"""{output of a component: (unit, attributes of the unit's base unit)}."""


def computed_by_components(
    system: System, inputs: Mapping[str, Collection[str]], units: Mapping[str, Units]
) -> tuple[dict[str, dict[str, list[Source]]], list[Connection]]:
    """The sources of inputs by component and input, and the connections, which now end at these sources. inputs: names of the
    inputs of each scene. units: units of the outputs of each existing FMU."""
    sources: dict[str, dict[str, list[Source]]] = {}
    connections, count = [], Counter(c.end for c in system.connections)
    for c in system.connections:
        name, variable = c.end
        made = _source(c, *units.get(c.start[0], {}).get(c.start[1], ("", {})))
        plain = count[c.end] == 1 and (made.factor, made.offset) == (1.0, 0.0)
        if plain or not _is_input(variable, inputs.get(name, ())):
            connections.append(c)
            continue
        of = sources.setdefault(name, {}).setdefault(variable, [])
        connections.append(replace(c, end=(name, source_name(variable, len(of))), factor=1.0, offset=0.0))
        of.append(made)
    return sources, connections


def _source(c: Connection, unit: str, base: Mapping[str, str]) -> Source:
    """The source of a connection. The value of the source has the unit of the connected output. The input is in SI units."""
    factor, offset = float(base.get("factor", 1.0)), float(base.get("offset", 0.0))
    return Source(c.factor * factor, c.factor * offset + c.offset, unit, base)


def _is_input(variable: str, names: Collection[str]) -> bool:
    """Whether a variable is an input of a scene, or the rate or acceleration of an input."""
    parts = variable.removeprefix("inputs.").rpartition(".")
    return variable in names or (parts[0] in names and parts[2] in ("rate", "acceleration"))
