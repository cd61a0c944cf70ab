"""What the C runtime and Python share, written once: enumerations (``choices``), records (``kernels``, ``runs``, ``lanes``,
``batches``), and the C header generated from them (``header``). No other file may know a number, a size or a layout of these."""

from engine.abi.choices import (
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
