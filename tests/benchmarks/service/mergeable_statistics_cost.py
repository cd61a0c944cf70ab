"""Cost of tallies beside parts, for a worker and for a reader who queries all cases, compared with reading the parts themselves."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from tests.benchmarks.service.worker_count_model import timed
from tests.benchmarks.speed.million_cases import KEEP, SAMPLE
from trunnion.batch.plan import Plan, Runner, plan
from trunnion.batch.sample_statistics.bin_statistics import Bins, binned, picked
from trunnion.batch.sample_statistics.mergeable_statistics import Tally, indices_in, tally_of, together
from trunnion.scene.overrides import scene_given
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_checksum import Piece
from trunnion.service.executor.part_tallies import BATCH, tallies, write_tally
from trunnion.simulation.settings.run_settings import Run

BINS = ("joints.ball.friction.mu", "joints.ball.start.qd[2]", KEEP[0])


def made(sampling: str, cases: int) -> tuple[Plan, Any]:
    """The plan of 10⁹ cases of 8.1, and some rows of it: numbers as they are, results by chance."""
    of = plan(
        scene_given("spherical_pendulum"), sample=SAMPLE, count=10**9 // (6 if sampling == "saltelli" else 1), sampling=sampling,
        keep=KEEP, run=Run(until=0.05, every=0.05),
    )  # fmt: skip
    some = Runner(replace(of, cases=replace(of.cases, count=cases))).chunk(0, 600)
    n, chance = of.cases.values(0, cases), np.random.default_rng(0)
    columns = {name: np.resize(some[name].to_numpy(zero_copy_only=False), cases) for name in some.column_names}
    columns |= {"case": np.arange(cases)} | dict(zip(of.cases.paths, n.T, strict=True)) | {k: chance.random(cases) for k in KEEP}
    return of, pa.table([pa.array(columns[f.name], f.type, from_pandas=True) for f in some.schema], schema=some.schema)


def of_tallies(sampling: str, cases: int) -> dict[str, float]:
    """Time of each operation on parts of this many cases and their tallies, in a folder, s."""
    of, table = made(sampling, cases)
    with tempfile.TemporaryDirectory() as folder:
        parts, pieces = Parts(folder), [Piece("job", "digest", k * cases, (k + 1) * cases) for k in range(BATCH)]
        for piece in pieces:
            size = write_tally(parts, piece, of, table)
        part = parts.write_part(pieces[0], table)
        (whole,) = (t for t in tallies(parts, pieces, of) if isinstance(t, Tally))
        batches = [replace(whole, drawn=whole.drawn) for _ in range(20)]
        found = {
            "tally made": timed(lambda: tally_of(table, of.cases, of.reductions), 5),
            "tally made and written": timed(lambda: write_tally(parts, pieces[0], of, table), 5),
            "tally read and added": timed(lambda: list(tallies(parts, pieces, of)), 3) / BATCH,
            "sums added again, by tally": timed(lambda: together(batches, of.cases), 3) / len(batches) / BATCH,
            "part read and counted in bins": timed(lambda: counted(parts.read_part(pieces[0], [*BINS, "case", "outcome"])[0]), 5),
            "bytes of a tally": float(size),
            "of its part": size / part,
        }
        if sampling == "saltelli":
            found["indices from sums"] = timed(lambda: indices_in(whole, of.cases, of.reductions, KEEP), 3)
        return found


def counted(table: Any) -> Bins:
    """Bins of rows."""
    x, y, of = BINS
    rows = [picked(table, BINS, ())]
    bins = Bins(*binned((cases for cases, _, _ in rows), x, y, (60, 60)), of)
    for cases, outcome, _ in rows:
        bins.add(cases, outcome)
    return bins


def main() -> None:
    """Print the figures."""
    for sampling in ("latin", "saltelli"):
        for cases in (1000, 50_000):
            told = of_tallies(sampling, cases).items()
            said = [f"{k} {v:.4g}" if "byte" in k or "of its" in k else f"{k} {1e3 * v:.2f} ms" for k, v in told]
            print(f"{sampling}, parts of {cases}: {', '.join(said)}", flush=True)


if __name__ == "__main__":
    main()
