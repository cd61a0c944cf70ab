"""The sizes of a mechanism, written as C macros for the exported sources."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Mapping
from dataclasses import dataclass

from trunnion.fmu.c_source.model_tables import events_kept
from trunnion.kernel.shared_libraries import runtime
from trunnion.runtime.abi.kernel_records import JACOBIAN, KERNEL, LINEAR, OUTPUTS
from trunnion.runtime.abi.record_definition import Record
from trunnion.simulation.run import Model
from trunnion.system.signals.signal_tables import table_block

SHELL, INPUT = 64 * 8, 24 * 8
"""Upper bounds of the sizes, in bytes, of ``fmu_state`` without its arrays, and of ``fmu_input``. The C sources do not compile when
a bound is too small."""


@dataclass(frozen=True)
class Sizes:
    """The sizes in the C tables of a mechanism's generated files (units). block: size in bytes of the memory block of a simulation
    on a 64-bit platform. On other platforms the block is smaller."""

    kernel: dict[str, int]
    outputs: dict[str, int]
    jacobian: dict[str, int]
    linear: dict[str, int]
    block: int

    def text(self) -> str:
        """C macros ``TR_MAX_…`` with the largest array lengths."""
        k, o = self.kernel, self.outputs
        works, audit = k["npowers"] if o["works"] else 0, 2
        ny = k["nq"] + k["nv"] + k["nb"]
        named = {n: v for n, v in k.items() if n != "abi" and not n.startswith("c_")} | {
            "ny": ny, "nworks": works, "width": (ny + works + audit + 3) // 4 * 4, "nz": k["active"] + k["neta"],
            "nout": o["nout"], "ncontacts": o["ncontacts"], "open_nkappa": o["nkappa"],
            "ninputs": self.linear.get("ninputs", 0), "linear_nc": self.linear.get("nc", 0),
        }  # fmt: skip
        return "".join(f"#define TR_MAX_{n.upper()} {v}\n" for n, v in named.items())


def sizes_of(units: Mapping[str, str], model: Model) -> Sizes:
    """The sizes of a model, read from the C texts of its units."""
    kernel, outputs = _table(units["kernel"], KERNEL), _table(units["outputs"], OUTPUTS)
    jacobian = _table(units["jacobian"], JACOBIAN)
    linear = _table(units["linear"], LINEAR) if "linear" in units else {}
    numbers, watched = model.built.numbers, kernel["nsliders"] + kernel["nstops"]
    counts = (len(numbers.breaks), len(table_block(numbers.tables)), events_kept(watched))
    return Sizes(kernel, outputs, jacobian, linear, _block(kernel, outputs, jacobian, *counts))


def _table(text: str, record: Record) -> dict[str, int]:
    """The integer fields of the C record in a unit's text; a missing field is 0."""
    found = re.search(rf"^const {record.tag} \w+=\{{(.*?)\}};", text, re.MULTILINE | re.DOTALL)
    assert found is not None
    said = dict(re.findall(r"\.(\w+)=(-?\d+)\b", found[1]))
    return {n: int(said.get(n, 0)) for n in record.integers}


def _block(
    kernel: dict[str, int], outputs: dict[str, int], jacobian: dict[str, int], nbreaks: int, ntables: int, events: int
) -> int:
    """The size in bytes of the memory block of a simulation, computed by the runtime."""
    tables = [r.ctype(**n) for r, n in ((KERNEL, kernel), (OUTPUTS, outputs), (JACOBIAN, jacobian))]
    size = runtime().tr_size
    size.restype = ctypes.c_size_t
    return int(size(*(ctypes.byref(t) for t in tables), ctypes.c_int(nbreaks), ctypes.c_int(ntables), ctypes.c_int(events)))
