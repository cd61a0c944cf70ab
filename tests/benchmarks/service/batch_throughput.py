"""Share of two cores that a batch in the service uses for stepping: example 8.1 with swept friction and start angle, reductions
only.

Run it with ``python -m tests.benchmarks.service.batch_throughput [CASES]`` on an idle machine. The script starts a server with two
workers and warms up the server. It measures the rate of one core that only steps (the same C loop, in this process). It then runs
10,000 cases from submission to result, and at last the large batch. """

from __future__ import annotations

import sys
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import psutil

from tests.service.http_servers import MU, Served, eventually, spawned
from trunnion.batch.plan_and_runner import Runner
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import JobRequest, plan_of_request

WORKERS = 2
ANGLE = "joints.ball.start.q.angle"


def request(cases: int) -> dict[str, Any]:
    """A request for a grid of about this many cases."""
    angles = 400
    return {
        "scene": "spherical_pendulum",
        "overrides": {"joints.ball.start.q": {"axis": [0, 1, 0], "angle": 0.0}},
        "vary": {MU: f"0.1:0.6:{max(1, cases // angles)}", ANGLE: f"-60 deg:60 deg:{angles}"},
        "reductions": ["max:ball.contact[1].normal_force", "final:pendulum.position[3]", "first:reversal", "count:reversal"],
        "until": 5.0,
        "every": 0.1,
    }


def bare(asked: dict[str, Any], seconds: float) -> tuple[float, float]:
    """Cases per second that one core steps without any other work, over pieces from the whole batch (cases differ in cost). One
    rate is per second of wall time, the other per second of processor time. The second rate is independent of other work on the
    machine."""
    runner = Runner(plan_of_request(JobRequest(**asked), Limits()))
    count, size, used, done = runner.plan.cases.count, 400, 0.0, 0
    runner.chunk(0, size)
    first = runner.seconds
    end, at = time.perf_counter() + seconds, 0
    while time.perf_counter() < end:
        start = (at * 7919 * size) % max(1, count - size)
        cpu = time.process_time()
        runner.chunk(start, start + size)
        used, done, at = used + time.process_time() - cpu, done + size, at + 1
    return done / (runner.seconds - first), done / used


def processors(s: Served) -> list[float]:
    """Processor seconds used so far by the server and by each worker."""
    return [sum(p.cpu_times()[:2]) for p in processes(s)]


def processes(s: Served) -> list[psutil.Process]:
    """The server and its workers."""
    assert s.process is not None
    me = psutil.Process(s.process.pid)
    return [me, *filter(spawned, me.children(recursive=True))]


def memory(s: Served) -> list[int]:
    """MB of the server and of each worker."""
    return [round(p.memory_info().rss / 1e6) for p in processes(s)]


def timed(s: Served, asked: dict[str, Any]) -> tuple[float, float, dict[str, Any], list[list[int]]]:
    """(seconds end to end, seconds until the first rows, the job, memory during the run)."""
    sizes: list[list[int]] = []
    over = threading.Event()

    def watch() -> None:
        while not over.wait(5.0):
            sizes.append(memory(s))

    watcher = threading.Thread(target=watch)
    began = time.perf_counter()
    job = s.submit(asked)
    eventually(lambda: s.job(job)["done"])
    first = time.perf_counter() - began
    watcher.start()
    while (end := s.job(job))["state"] == "running":
        time.sleep(0.25)
    over.set()
    watcher.join()
    return time.perf_counter() - began, first, end, sizes


def main() -> None:
    """Print the figures."""
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else 400_000
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        with Served(Path(folder) / "data", "--workers", str(WORKERS)) as s:
            eventually(lambda: s.get("/readyz").json()["workers"] == WORKERS)
            print(f"server and {WORKERS} workers up in {time.perf_counter() - began:.1f} s")
            large = request(cases)
            began = time.perf_counter()
            s.ended(s.submit(request(800)))
            print(f"first job (800 cases, kernel built or loaded) in {time.perf_counter() - began:.1f} s")
            rate, by_cpu = bare(large, 10.0)
            print(f"bare stepping, one core: {rate:.0f} cases/s ({1e3 / rate:.3f} ms a case); {by_cpu:.0f} a processor second")
            wall, first, end, _ = timed(s, request(10_000))
            print(
                f"{end['cases']} cases end to end: {wall:.2f} s ({end['cases'] / wall:.0f} cases/s; first rows after {first:.2f} s)"
            )
            before, cpu = memory(s), processors(s)
            wall, first, end, sizes = timed(s, large)
            used = [b - a for a, b in zip(cpu, processors(s), strict=True)]
            again, again_cpu = bare(large, 10.0)
            with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
                both = sum(r[0] for r in pool.map(bare, [large] * WORKERS, [10.0] * WORKERS))
            best, best_cpu = max(rate, again), max(by_cpu, again_cpu)
            got = end["cases"] / wall
            n, mb, stepped = end["cases"], end["bytes"] / 1e6, end["stepping_seconds"]
            print(f"{n} cases: {n / best:.0f} s of bare stepping done in {wall:.1f} s, first rows after {first:.2f} s")
            print(f"outcomes {end['outcomes']}, {mb:.1f} MB, stepping {stepped:.1f} s on the workers")
            print(f"bare rate again: {again:.0f} cases/s")
            print(f"throughput {got:.0f} cases/s = {100 * got / (WORKERS * best):.0f} % of {WORKERS} x bare (80 % is wanted)")
            of_one, had, busy = 100 * both / (WORKERS * best), 100 * got / both, 100 * stepped / (WORKERS * wall)
            print(f"{WORKERS} cores stepping bare at once: {both:.0f} cases/s, {of_one:.0f} % of {WORKERS} x one")
            print(f"of which the batch had {had:.0f} %; {busy:.0f} % of its time was stepping")
            share, taken = 100 * n / best_cpu / sum(used), [round(x, 1) for x in used]
            print(f"processor seconds (server, workers) {taken}, bare stepping {n / best_cpu:.1f}: {share:.0f} %")
            print(f"memory, MB (server, workers): before {before}, on the way {sizes[len(sizes) // 4 :: max(1, len(sizes) // 4)]}")


if __name__ == "__main__":
    main()
