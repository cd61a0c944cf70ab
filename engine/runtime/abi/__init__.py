"""Enumerations and records that the C runtime and Python share, and the C header generated from these declarations. Numbers, sizes
and layouts are declared here only."""

from trunnion.runtime.abi.enumerations import (
    LINE,
    Array,
    AuditLaw,
    Breaks,
    Coordinate,
    EventKind,
    Overrun,
    PairKind,
    PairState,
    Post,
    RowKind,
    Status,
    StopState,
    TableKind,
    Verdict,
    Wants,
    Why,
)

__all__ = [
    "LINE", "Array", "AuditLaw", "Breaks", "Coordinate", "EventKind", "Overrun", "PairKind", "PairState", "Post", "RowKind",
    "Status", "StopState", "TableKind", "Verdict", "Wants", "Why",
]  # fmt: skip
