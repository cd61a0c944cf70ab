"""Tallies: mergeable statistics of parts of a batch, which answer queries about very many cases.

A tally holds the count, least value, largest value and sum of every numerical column, and the sums of a crossed sample's points
(``sobol_index_sums``). It also holds the part's drawn rows; about a million cases of the whole batch are drawn pseudo-randomly. The
merged tally does not depend on the partition of the batch, bit for bit. This holds because sums are exact (``exact_summation``),
and because only the number of a case decides whether the case is drawn. Reading all rows of 10⁹ cases for each query would take
half an hour and several gigabytes; tallies take a minute (``service/CAPACITY.md``).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.problems import SceneError
from trunnion.batch.cases.grids_and_samples import Cases
from trunnion.batch.cases.sample_points import mixed
from trunnion.batch.sample_statistics import exact_summation, sobol_index_sums
from trunnion.batch.sample_statistics.result_queries import refused
from trunnion.batch.sample_statistics.sobol_indices import FAILED, Indices, enough
from trunnion.batch.tables.reductions import Reduction

if TYPE_CHECKING:
    import pyarrow

DRAWN = 1_000_000
"""Approximate number of drawn cases. In a batch with fewer cases, all cases are drawn."""


@dataclass(frozen=True)
class Tally:
    """A tally.

    Attributes:
        cases: number of cases.
        names: names of the c numerical columns.
        known: number of finite values in each column (c).
        low: least value of each column (c).
        high: largest value of each column (c).
        sums: exact sum of each column (c × doubles of an expansion).
        drawn: rows of the drawn cases.
        edges: rows of those points of a crossed sample that are incomplete in this part.
        points: sums of the complete points; None if there are no complete points.
    """

    cases: int
    names: tuple[str, ...]
    known: np.ndarray
    low: np.ndarray
    high: np.ndarray
    sums: np.ndarray
    drawn: pyarrow.Table
    edges: pyarrow.Table
    points: sobol_index_sums.Points | None

    def mean(self, name: str) -> float | None:
        """The mean of a column, correctly rounded; None if the column has no numbers."""
        i = self.names.index(name)
        return float(exact_summation.fractions(self.sums)[i] / int(self.known[i])) if self.known[i] else None

    def ends(self, name: str) -> tuple[float, float] | None:
        """(least, largest) number of a column; None if the column has no numbers."""
        i = self.names.index(name)
        return (float(self.low[i]), float(self.high[i])) if self.known[i] else None


def drawn(case: np.ndarray, of: int) -> np.ndarray:
    """Whether each of n cases is drawn, pseudo-randomly by its case number. of: number of all cases."""
    if of <= DRAWN:
        return np.ones(len(case), bool)
    return mixed(case.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15)) < np.uint64(int(2.0**64 * (DRAWN / of)))


def tally_of(table: pyarrow.Table, cases: Cases, kept: Sequence[Reduction]) -> Tally:
    """The tally of consecutive rows of a batch."""
    names = tuple(f.name for f in table.schema if str(f.type) != "string")
    x = np.column_stack([table[n].to_numpy().astype(float) for n in names])
    x = np.where(np.abs(x) <= exact_summation.LARGEST, x, np.nan)
    there = np.isfinite(x)
    low, high = np.where(there, x, np.inf).min(axis=0, initial=np.inf), np.where(there, x, -np.inf).max(axis=0, initial=-np.inf)
    sums = exact_summation.sums(np.where(there, x, 0.0))
    some = table.filter(drawn(table["case"].to_numpy(), cases.count))
    edges = table.select(list(dict.fromkeys(["case", "outcome", *(r.name for r in kept)])))
    points = None
    if cases.sampling == "saltelli":
        points, edges = _closed(edges, len(cases.paths))
    else:
        edges = edges.slice(0, 0)
    return Tally(len(table), names, there.sum(axis=0), low, high, sums, some, edges, points)


def together(tallies: Sequence[Tally], cases: Cases) -> Tally:
    """The tally of all cases of the given tallies."""
    import pyarrow as pa

    added = {n: np.sum([getattr(t, n) for t in tallies], axis=0) for n in ("cases", "known")}
    ends = np.min([t.low for t in tallies], axis=0), np.max([t.high for t in tallies], axis=0)
    sums, some = exact_summation.added([t.sums for t in tallies]), pa.concat_tables([t.drawn for t in tallies]).combine_chunks()
    edges, points = pa.concat_tables([t.edges for t in tallies]), [t.points for t in tallies if t.points is not None]
    if cases.sampling == "saltelli":
        closed, edges = _closed(edges.sort_by("case"), len(cases.paths))
        points += [closed] if closed is not None else []
    whole = sobol_index_sums.together(points) if points else None
    return Tally(int(added["cases"]), tallies[0].names, added["known"], *ends, sums, some, edges.combine_chunks(), whole)


def _closed(rows: pyarrow.Table, paths: int) -> tuple[sobol_index_sums.Points | None, pyarrow.Table]:
    """(sums of the complete points, rows of the incomplete points). rows: rows in the order of their cases."""
    wide = 2 * paths + 2
    of = rows["case"].to_numpy() // wide
    point, count = np.unique(of, return_counts=True)
    whole = point[count == wide]
    if not len(whole):
        return None, rows
    inside = np.isin(of, whole)
    table, names = rows.filter(inside), [n for n in rows.column_names if n not in ("case", "outcome")]
    values = np.array([table[n].to_numpy().astype(float).reshape(-1, wide) for n in names]).reshape(len(names), -1, wide)
    outcome = table["outcome"].to_numpy(zero_copy_only=False).astype(str).reshape(-1, wide)
    return sobol_index_sums.points_of(names, paths, whole, values, outcome), rows.filter(~inside)


def indices_in(t: Tally, cases: Cases, kept: Sequence[Reduction], of: Sequence[str]) -> list[Indices]:
    """Sobol indices of results, and of failures if cases failed, from all complete points. SceneError for too few points, and for
    results that are not in the table."""
    if problems := refused(cases, kept, of, (), {}):
        raise SceneError(problems)
    points, units = t.points, {r.name: r.unit for r in kept} | {FAILED: "1"}
    enough(0 if points is None else int((points.whole + points.gaps)[0].sum()))
    assert points is not None
    failing = [FAILED] if points.high[-1] > 0.0 else []
    return [points.document(name, units[name], cases.paths) for name in (*of, *failing)]



ARRAYS = ("known", "low", "high", "sums")
OF_POINTS = ("whole", "gaps", "sums", "others", "low", "high")


def packed(t: Tally) -> pyarrow.Table:
    """A tally as a table of one row: the tally's arrays (64-bit float or int) in sequence, and its drawn rows and edge rows as
    Arrow streams."""
    import pyarrow as pa

    arrays = {n: getattr(t, n) for n in ARRAYS} | {f"points.{n}": getattr(t.points, n) for n in OF_POINTS if t.points is not None}
    about: dict[str, Any] = {"cases": t.cases, "names": t.names}
    about["arrays"] = [(n, x.dtype.str, x.shape) for n, x in arrays.items()]
    if t.points is not None:
        about |= {"points": {n: getattr(t.points, n) for n in ("names", "paths", "missing")}}
    row = {"about": json.dumps(about).encode(), "arrays": b"".join(x.tobytes() for x in arrays.values())}
    row |= {"drawn": _stream(t.drawn), "edges": _stream(t.edges)}
    return pa.table({n: pa.array([data], pa.binary()) for n, data in row.items()})


def unpacked(table: pyarrow.Table) -> Tally:
    """The tally of a table from ``packed``."""
    import pyarrow as pa

    row = {n: table[n][0].as_py() for n in table.column_names}
    about, at = json.loads(row["about"]), 0
    arrays: dict[str, np.ndarray] = {}
    for name, kind, shape in about["arrays"]:
        arrays[name] = np.frombuffer(row["arrays"], kind, prod(shape), at).reshape(shape)
        at += arrays[name].nbytes
    points = None
    if told := about.get("points"):
        of: dict[str, Any] = {n: arrays[f"points.{n}"] for n in OF_POINTS}
        points = sobol_index_sums.Points(tuple(told["names"]), told["paths"], **of, missing=tuple(told["missing"]))
    more: dict[str, Any] = {n: arrays[n] for n in ARRAYS}
    more |= {n: pa.ipc.open_stream(row[n]).read_all() for n in ("drawn", "edges")}
    return Tally(about["cases"], tuple(about["names"]), **more, points=points)


def _stream(table: pyarrow.Table) -> bytes:
    import pyarrow as pa

    bare = pa.schema([pa.field(f.name, f.type, f.nullable) for f in table.schema])  # the job stores the metadata
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, bare) as writer:
        writer.write_table(table.cast(bare))
    return bytes(sink.getvalue())
