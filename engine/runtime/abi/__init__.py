"""Declarations that the C runtime and Python share: enumerations, records, and the C header generated from them. No other file
repeats a number, a size or a layout of these."""

from trunnion.runtime.abi.enumerations import (
    LINE,
    Array,
    Breaks,
    Coordinate,
    EventKind,
    Law,
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
    "LINE", "Array", "Breaks", "Coordinate", "EventKind", "Law", "Overrun", "PairKind", "PairState", "Post", "RowKind", "Status",
    "StopState", "TableKind", "Verdict", "Wants", "Why",
]  # fmt: skip
