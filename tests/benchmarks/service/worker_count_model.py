"""The costs of a job in addition to stepping, and a model of 10⁹ cases on 10⁴ workers from these costs (service/CAPACITY.md).

``python -m tests.benchmarks.service.worker_count_model [-o FIGURE.png]`` measures times on this machine, in seconds. The measured
operations are: send a chunk and store its outcome (SQLite, and PostgreSQL if available); renew a lease; write, read and count a
part; read rows of the table of chunks. With ``--real``, the real dispatcher and its store send chunks to some hundred workers that
only wait. The script then evaluates a model with these constants. In the model, one dispatcher sends chunks and takes them back,
one or many in a commit. Each worker has a running and a waiting chunk. ``ActiveJob.size`` gives the sizes of chunks. The only
inputs are the constants and the cost of a case. """

from __future__ import annotations

import argparse
import heapq
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

from tests.service.store.single_chunks import chunk_done, cut
from trunnion.service.executor.active_job import ActiveJob
from trunnion.service.executor.chunk_dispatcher import AHEAD
from trunnion.service.executor.chunk_size import COMMIT_SIZE, DispatchCost
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange
from trunnion.service.store.leases_and_chunks import ChunkReport, WorkStore
from trunnion.service.store.store_records import Job

CHUNK_SECONDS = 2.0

# -- the model -----------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fleet:
    """workers: their number. case: time to step a case, s. cut, land: time of the dispatcher for a commit that sends chunks, and
    for one that takes chunks back, s. each: additional time for each chunk, s. together: largest number of chunks in a commit.
    part, row: time of a worker to write a part, and additional time for each case, s."""

    workers: int
    case: float = 1e-3
    cut: float = 2.5e-3
    land: float = 2.5e-3
    part: float = 0.05
    each: float = 0.0
    together: int = 1
    row: float = 0.0


@dataclass(frozen=True)
class End:
    """seconds: time until all outcomes are stored. pieces: number of chunks. share: share of the workers' time that is stepping.
    busy: share of the dispatcher's time that is work. cost: time of the dispatcher for a chunk, s."""

    seconds: float
    pieces: int
    share: float
    busy: float
    cost: float


def simulated(cases: int, fleet: Fleet, learns: bool = True) -> End:
    """The end of a job with this number of cases. learns: whether the sizes of chunks follow from the cost of dispatching them."""
    job = Job("", 0.0, None, None, "", "", "", "", "running", cases, 0, 0, 0, {}, 0.0, 0.0, 0, inf, [])
    active, dispatch_cost = ActiveJob(job, cost=fleet.case, warm=True), DispatchCost()
    if fleet.together == 1:  # the cost of a chunk is constant
        dispatch_cost = DispatchCost(each=(0.5 * (fleet.cut + fleet.land) + fleet.each) * learns)

    def took(n: int, seconds: float) -> None:
        if learns and fleet.together > 1:
            dispatch_cost.record(n, seconds)

    free, landing = [0.0] * fleet.workers, list[float]()
    now, busy, flying, pieces = 0.0, 0.0, 0, 0
    while active.planned < cases or flying:
        began = now
        while landing and landing[0] <= now:
            back = 0
            while landing and landing[0] <= now and back < fleet.together:
                heapq.heappop(landing)
                back += 1
            now, flying = now + fleet.land + back * fleet.each, flying - back
            took(back, fleet.land + back * fleet.each)
        while active.planned < cases and flying < fleet.workers * (1 + AHEAD):
            longest = dispatch_cost.longest(CHUNK_SECONDS, fleet.workers, fleet.together)
            sizes = active.sizes(min(fleet.together, fleet.workers * (1 + AHEAD) - flying), longest, fleet.workers, dispatch_cost)
            now += fleet.cut + len(sizes) * fleet.each
            took(len(sizes), fleet.cut + len(sizes) * fleet.each)
            for n in sizes:
                n = min(n, cases - active.planned)
                active.planned += n
                if n:
                    over = max(heapq.heappop(free), now) + n * (fleet.case + fleet.row) + fleet.part
                    heapq.heappush(free, over)
                    heapq.heappush(landing, over)
                    flying, pieces = flying + 1, pieces + 1
        busy += now - began
        if now == began:
            now = landing[0]
    return End(now, pieces, cases * fleet.case / (now * fleet.workers), busy / now, busy / pieces)


# -- constants -----------------------------------------------------------------------------------------------------------------


def timed(f: Callable[[], Any], times: int) -> float:
    """Median time of a call, s."""
    took = []
    for _ in range(times):
        began = time.perf_counter()
        f()
        took.append(time.perf_counter() - began)
    return statistics.median(took)


@contextmanager
def stores() -> Iterator[dict[str, WorkStore]]:
    """A store on SQLite, and a store on PostgreSQL if it is available."""
    from tests.service.postgresql_servers import DatabaseMissing, installed, packaged

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        found = {"SQLite": WorkStore(f"sqlite:///{folder / 'jobs.db'}")}
        for way in (packaged, installed):
            try:
                (folder / way.__name__).mkdir()
                found["PostgreSQL"] = WorkStore(stack.enter_context(way(folder / way.__name__)))
                break
            except (DatabaseMissing, ImportError):
                continue
        for store in found.values():
            store.upgrade()
            stack.callback(store.close)
        yield found


def of_store(store: WorkStore, pieces: int) -> dict[str, float]:
    """Time of each operation of a store with this many pieces in its table, s."""
    job, _ = store.submit("me", "d", "scene", "", "{}", 10**9, 1e9)
    store.claim("server", 1e9)
    store.begin("server", job.id)
    cut_chunks, lands = [], []
    for _ in range(pieces):
        began = time.perf_counter()
        chunk = cut(store, "server", job.id, 1000)
        cut_chunks.append(time.perf_counter() - began)
        assert chunk is not None
        began = time.perf_counter()
        chunk_done(store, "server", job.id, chunk.start, ChunkReport({"done": 1000}, 1.0, 0.0, 25_000, "worker"))
        lands.append(time.perf_counter() - began)
    return {
        "cut": statistics.median(cut_chunks[pieces // 2 :]),
        "land": statistics.median(lands[pieces // 2 :]),
        **of_many(store, job.id, pieces),
        "lease": timed(lambda: store.claim("server", 1e9), 20),
        "rows of all pieces, each": timed(lambda: store.finished(job.id), 5) / pieces,
        "one piece of all": timed(lambda: store.finished(job.id, 5000, 6000), 20),
        "ends of all pieces, each": timed(lambda: store.ends(job.id), 5) / pieces,
    }


def of_many(store: WorkStore, job: str, pieces: int) -> dict[str, float]:
    """Time of commits of many pieces, for each piece, s."""
    cut_chunks, lands = [], []
    for _ in range(max(5, pieces // COMMIT_SIZE)):
        began = time.perf_counter()
        some = store.cut_chunks("server", job, [1000] * COMMIT_SIZE)
        cut_chunks.append(time.perf_counter() - began)
        began = time.perf_counter()
        store.record_outcomes("server", job, {c.start: ChunkReport({"done": 1000}, 1.0, 0.0, 25_000, "worker") for c in some})
        lands.append(time.perf_counter() - began)
    cut, land = statistics.median(cut_chunks) / COMMIT_SIZE, statistics.median(lands) / COMMIT_SIZE
    return {"cut, of many each": cut, "land, of many each": land}


def of_parts(cases: int) -> dict[str, float]:
    """Time of operations on a part of this many cases of 8.1 in a folder, s, and its bytes for each case."""
    from tests.benchmarks.speed.million_cases import KEEP, SAMPLE
    from trunnion.batch.plan_and_runner import Runner, plan
    from trunnion.scene.overrides import scene_given
    from trunnion.simulation.settings.run_settings import Run

    of = plan(scene_given("spherical_pendulum"), sample=SAMPLE, count=cases, keep=KEEP, run=Run(until=0.05, every=0.05))
    table = Runner(of).chunk(0, cases)
    with tempfile.TemporaryDirectory() as folder:
        parts, piece = Parts(folder), CaseRange("job", "digest", 0, cases)
        size = parts.write_part(piece, table)
        return {
            "part written": timed(lambda: parts.write_part(piece, table), 9),
            "part read": timed(lambda: parts.read_part(piece), 9),
            "part counted": timed(lambda: parts.part_outcomes(piece), 9),
            "look for the mark of a stopped job": timed(lambda: parts.exists(parts.marker("job")), 99),
            "bytes a case": size / cases,
        }


def constants(pieces: int) -> dict[str, dict[str, float]]:
    """Measure all constants and print them."""
    found = {"parts of 1,000 cases": of_parts(1000), "parts of 50,000": of_parts(50_000)}
    with stores() as there:
        found |= {f"{name}, {pieces} pieces": of_store(store, pieces) for name, store in there.items()}
    for what, numbers in found.items():
        said = (f"{k} {v:.1f}" if "bytes" in k else f"{k} {1e3 * v:.3f} ms" for k, v in numbers.items())
        print(f"{what}: {', '.join(said)}", flush=True)
    return found


def compared(fleet: Fleet, cases: int = 200_000, workers: int = 300) -> None:
    """Compare the real dispatcher, with workers that wait, with the model's prediction, and print the figures."""
    from tests.benchmarks.service.dispatcher_with_idle_workers import real

    case = fleet.case
    print(f"{cases} cases of {1e3 * case:.1f} ms on {workers} waiting workers: {cases * case / workers:.1f} s at least")
    for learns in (False, True):
        seconds, pieces, _ = real(cases, workers, case, learns)
        end = simulated(cases, replace(fleet, workers=workers), learns)
        how = "cost" if learns else "time"
        print(f"  sized by {how}: {seconds:.1f} s, {pieces} pieces; model: {end.seconds:.1f} s, {end.pieces}", flush=True)


def main() -> None:
    """Print the figures."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("-o", "--figure", type=Path)
    ask.add_argument("--pieces", type=int, default=2000)
    ask.add_argument("--case", type=float, default=0.9e-3, help="s of one case")
    ask.add_argument("--real", action="store_true")
    asked = ask.parse_args()
    found = constants(asked.pieces)
    small, large = (found[f"parts of {n}"]["part written"] for n in ("1,000 cases", "50,000"))
    row = (large - small) / 49_000
    sqlite, store = (next(v for k, v in some if "SQL" in k) for some in (found.items(), reversed(found.items())))
    if asked.real:
        compared(fleet_of(sqlite, 2 * asked.case, 0.0, COMMIT_SIZE))
    fleets = [replace(fleet_of(store, asked.case, small, together), row=row) for together in (1, COMMIT_SIZE)]
    words = ("workers", "a commit", "pieces", "seconds", "stepping", "dispatcher", "ms a piece")
    print(" ".join(f"{word:>10s}" for word in words))
    for fleet in (replace(f, workers=w) for w in (10, 100, 1000, 10_000) for f in fleets):
        end = simulated(10**9, fleet)
        print(f"{fleet.workers:10d} {fleet.together:10d} {end.pieces:10d} {end.seconds:10.0f} {end.share:10.3f} {end.busy:10.3f} "
              f"{1e3 * end.cost:10.2f}")
    if asked.figure:
        from tests.benchmarks.service.worker_count_figure import draw

        draw(asked.figure, fleets)


def fleet_of(store: dict[str, float], case: float, part: float, together: int) -> Fleet:
    """A fleet with the measured values of a store. together: number of pieces in a commit."""
    one, many = store["cut"] + store["land"], store["cut, of many each"] + store["land, of many each"]
    each = max(0.0, (many - one / COMMIT_SIZE) / (1.0 - 1.0 / COMMIT_SIZE))
    fixed = (one - each) / one
    return Fleet(1, case, fixed * store["cut"], fixed * store["land"], part, each / 2, together)


if __name__ == "__main__":
    main()
