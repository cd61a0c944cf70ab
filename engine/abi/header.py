"""The C header ``tr_abi.h``, and the number by which kernels, runtime and Python recognise that they agree about it."""

from __future__ import annotations

import hashlib
import re
from functools import lru_cache

from engine.abi import batches, kernels, lanes, runs
from engine.abi.choices import ENUMERATIONS, LINE, Ask, Law
from engine.abi.records import Record
from engine.integrators import METHODS

TOP = """/* What C and Python share, generated from the tables in engine/abi. */
#ifndef TR_ABI_H
#define TR_ABI_H
#include <stddef.h>

struct tr_sim;
/* How many doubles a record of doubles takes. */
#define TR_DOUBLES(type) ((int)(sizeof(type) / sizeof(double)))
"""


def records() -> list[Record]:
    """All records, each after those it contains."""
    return [r for module in (kernels, runs, lanes, batches) for r in vars(module).values() if isinstance(r, Record)]


def sizes() -> str:
    """C definitions of the counts and lengths that are no field of a record."""
    counts = {"TR_EVENT_CONTACTS": runs.EVENT_CONTACTS, "TR_EVENT_KINDS": batches.EVENT_KINDS}
    counts |= {"TR_STRANDS": batches.STRANDS, "TR_ASKS": len(Ask), "TR_METHODS": len(METHODS), "TR_LAWS": len(Law)}
    lengths = f"#define TR_LINE {LINE!r} /* a direction in a mode that is longer is that of a pair on a line */\n"
    return "enum {" + ", ".join(f"{k} = {v}" for k, v in counts.items()) + "};\n" + lengths


@lru_cache(maxsize=1)
def body() -> str:
    """The header without its include guard and the ABI's number."""
    return "\n".join([sizes(), *(e.c_text() for e in ENUMERATIONS), *(r.c_text() for r in records())])


@lru_cache(maxsize=1)
def number() -> int:
    """The ABI's number: a digest of the declarations, without comments."""
    plain = re.sub(r"/\*.*?\*/", "", body(), flags=re.DOTALL)
    return int(hashlib.sha256(" ".join(plain.split()).encode()).hexdigest()[:7], 16)


@lru_cache(maxsize=1)
def header() -> str:
    """Text of ``tr_abi.h``."""
    return f"{TOP}\nenum {{TR_ABI = {number()}}};\n{body()}#endif\n"
