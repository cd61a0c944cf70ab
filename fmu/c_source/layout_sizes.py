"""Sizes of a mechanism as C macros for its sources."""

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
"""Bytes of ``fmu_state`` without its arrays, and of ``fmu_input``. The C text refuses to compile when they are too small."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of a mechanism's units, and bytes of its simulation block (on 64 bits, the largest)."""

    kernel: dict[str, int]
    outputs: dict[str, int]
    jacobian: dict[str, int]
    linear: dict[str, int]
    block: int

    def text(self) -> str:
        """C definitions of the largest array lengths."""
        k, o = self.kernel, self.outputs
        works, audit = k["npowers"] if o["works"] else 0, 2 if k["npowers"] else 0
        ny = k["nq"] + k["nv"] + k["nb"]
        named = {n: v for n, v in k.items() if n != "abi" and not n.startswith("c_")} | {
            "ny": ny, "nworks": works, "width": (ny + works + audit + 3) // 4 * 4, "nz": k["active"] + k["neta"],
            "nout": o["nout"], "ncontacts": o["ncontacts"], "open_nkappa": o["nkappa"],
            "ninputs": self.linear.get("ninputs", 0), "linear_nc": self.linear.get("nc", 0),
        }  # fmt: skip
        return "".join(f"#define TR_MAX_{n.upper()} {v}\n" for n, v in named.items())


def sizes_of(units: Mapping[str, str], model: Model) -> Sizes:
    """Sizes in the C texts of a model's units."""
    kernel, outputs = _table(units["kernel"], KERNEL), _table(units["outputs"], OUTPUTS)
    jacobian = _table(units["jacobian"], JACOBIAN)
    linear = _table(units["linear"], LINEAR) if "linear" in units else {}
    numbers, watched = model.built.numbers, kernel["nsliders"] + kernel["nstops"]
    counts = (len(numbers.breaks), len(table_block(numbers.tables)), events_kept(watched))
    return Sizes(kernel, outputs, jacobian, linear, _block(kernel, outputs, jacobian, *counts))


def _table(text: str, record: Record) -> dict[str, int]:
    """Integers of a unit's table."""
    found = re.search(rf"^const {record.tag} \w+=\{{(.*?)\}};", text, re.MULTILINE | re.DOTALL)
    assert found is not None
    said = dict(re.findall(r"\.(\w+)=(-?\d+)\b", found[1]))
    return {n: int(said.get(n, 0)) for n in record.integers}


def _block(
    kernel: dict[str, int], outputs: dict[str, int], jacobian: dict[str, int], nbreaks: int, ntables: int, events: int
) -> int:
    """Size of the simulation block that the runtime computes, bytes."""
    tables = [r.ctype(**n) for r, n in ((KERNEL, kernel), (OUTPUTS, outputs), (JACOBIAN, jacobian))]
    size = runtime().tr_size
    size.restype = ctypes.c_size_t
    return int(size(*(ctypes.byref(t) for t in tables), ctypes.c_int(nbreaks), ctypes.c_int(ntables), ctypes.c_int(events)))
