"""The C header ``tr_abi.h``, and its number. Kernels, runtime and Python compare this number to verify that they use the same
header."""

from __future__ import annotations

import hashlib
import re
from functools import lru_cache

from trunnion.runtime.abi import batch_records, kernel_records, lane_records, run_records, tangent_records
from trunnion.runtime.abi.enumerations import ENUMERATIONS, LINE, Ask, Law
from trunnion.runtime.abi.record_definition import Record
from trunnion.runtime.integrators import METHODS

TOP = """/* Declarations that C and Python share, generated from engine/runtime/abi. */
#ifndef TR_ABI_H
#define TR_ABI_H
#include <stddef.h>

struct tr_sim;
/* Number of doubles of a record of doubles. */
#define TR_DOUBLES(type) ((int)(sizeof(type) / sizeof(double)))
"""


def records() -> list[Record]:
    """All records. Each record follows the records that it contains."""
    return [
        r
        for module in (kernel_records, run_records, lane_records, batch_records, tangent_records)
        for r in vars(module).values()
        if isinstance(r, Record)
    ]


def sizes() -> str:
    """C definitions of counts and thresholds outside records."""
    counts = {"TR_EVENT_CONTACTS": run_records.EVENT_CONTACTS, "TR_EVENT_KINDS": batch_records.EVENT_KINDS}
    counts |= {"TR_STRANDS": batch_records.STRANDS, "TR_ASKS": len(Ask), "TR_METHODS": len(METHODS), "TR_LAWS": len(Law)}
    lengths = f"#define TR_LINE {LINE!r} /* norm of a mode's direction above which the pair moves along a line */\n"
    return "enum {" + ", ".join(f"{k} = {v}" for k, v in counts.items()) + "};\n" + lengths


@lru_cache(maxsize=1)
def body() -> str:
    """The header, except its include guard and the ABI's number."""
    return "\n".join([sizes(), *(e.c_text() for e in ENUMERATIONS), *(r.c_text() for r in records())])


@lru_cache(maxsize=1)
def number() -> int:
    """The ABI's number: a digest of the declarations without their comments."""
    plain = re.sub(r"/\*.*?\*/", "", body(), flags=re.DOTALL)
    return int(hashlib.sha256(" ".join(plain.split()).encode()).hexdigest()[:7], 16)


@lru_cache(maxsize=1)
def header() -> str:
    """Text of ``tr_abi.h``."""
    return f"{TOP}\nenum {{TR_ABI = {number()}}};\n{body()}#endif\n"
