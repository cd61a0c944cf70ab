"""Time until a program ends after Ctrl-C or after its time budget, at random instants of builds, assembly, mode decisions,
stepping, writing and bounds (``interrupt_workloads.py``).

Each measurement uses a new process. The process is a fork of this process, so that all modules are imported already. The process
does the whole work. It is interrupted at a random instant, evenly distributed over the duration of the uninterrupted work. The
script prints the time until the process has ended, and the processor time that the process has used. The processor time does not
depend on other work of the machine. It also prints exit codes and kept rows. Linux only. ``python -m
tests.benchmarks.speed.interrupt_latency [instants] [place …]``"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from tests.benchmarks.speed.interrupt_workloads import PLACES, Place, Work
from trunnion.kernel.compilation import library_cache
from trunnion.simulation.runtime_interface.c_signatures import library

TICK = os.sysconf("SC_CLK_TCK")
SEED, DEFECT, OVER = 12, 70, "over before"


@dataclass
class Found:
    """Measurements: wall times, s, processor times, s, exit codes, kept results."""

    seconds: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    codes: Counter[str] = field(default_factory=Counter)
    kept: Counter[str] = field(default_factory=Counter)

    def line(self, name: str, whole: float) -> str:
        """One line of the table."""
        spans = [f"{1e3 * median(x):.0f} / {1e3 * max(x):.0f}" if x else "" for x in (self.seconds, self.cpu)]
        ends = ", ".join([*(f"{n} × {c}" for c, n in self.codes.items()), *(f"{n} × {k}" for k, n in self.kept.items() if k)])
        return f"| {name} | {whole:.2f} | {len(self.seconds)} | {spans[0]} | {spans[1]} | {ends} |"


def opened(folder: Path, fresh: bool) -> None:
    """Prepare a fork. If ``fresh``, its kernel cache contains only the runtime. The fork writes no output to a terminal."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(folder)
    if fresh:
        full, home = library_cache.cache_folder(), folder / "cache"
        home.mkdir()
        for there in full.iterdir():
            if there.name.partition("-")[0] in ("runtime", "zig"):
                (home / there.name).symlink_to(there)
        os.environ["TRUNNION_CACHE"] = str(home)
    said = os.open("said", os.O_CREAT | os.O_WRONLY)
    os.dup2(said, 1)
    os.dup2(said, 2)


def forked(fresh: bool, folder: Path, work: Work) -> int:
    """A process that has just begun with the work."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        code = DEFECT
        try:
            opened(folder, fresh)
            os.write(writing, b".")
            code = work(folder)
        except KeyboardInterrupt:
            code = 1
        except BaseException as e:  # noqa: BLE001  # the waiting process reports the exception
            (folder / "said").write_text(repr(e))
        finally:
            os._exit(code)
    os.close(writing)
    os.read(reading, 1)
    os.close(reading)
    return pid


def used(pid: int) -> float:
    """Processor seconds of a process, without the seconds of its ended child processes."""
    return sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13])) / TICK


def whole(place: Place) -> float:
    """Seconds that the uninterrupted work takes; the shorter time of two runs."""
    each = []
    for _ in range(2):
        with tempfile.TemporaryDirectory() as name:
            pid = forked(place.fresh, Path(name), place.work)
            began = time.perf_counter()
            os.waitpid(pid, 0)
            each.append(time.perf_counter() - began)
    return min(each)


def ended(place: Place, after: float, budget: bool, found: Found) -> None:
    """Interrupt the work this many seconds after its start, and record the time until it has ended."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pid = forked(place.fresh, folder, (lambda f: place.budget(f, after)) if budget and place.budget else place.work)  # type: ignore[misc]
        time.sleep(after)
        before = used(pid)
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None:
            os.waitpid(pid, 0)
            found.codes[OVER] += 1
            return
        if not budget:
            os.kill(pid, signal.SIGINT)
        asked = time.perf_counter()
        os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
        found.seconds.append(time.perf_counter() - asked)
        found.cpu.append(used(pid) - before)
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        found.codes[f"exit code {code}"] += 1
        found.kept[place.told(folder)] += 1
        if code == DEFECT:
            print((folder / "said").read_text(), file=sys.stderr)


def main(words: list[str]) -> None:
    """Measure the named places, or all places."""
    library()
    instants = int(words[0]) if words else 100
    print("| place | whole, s | n | ms to the end, median / worst | of the processor | ends, and what was kept |")
    print("|---|---|---|---|---|---|")
    for name in words[1:] or PLACES:
        place, chance = PLACES[name], random.Random(SEED)
        place.first()
        takes = place.most or whole(place)
        for budget in (False, True)[: 1 + (place.budget is not None)]:
            found = Found()
            for _ in range(instants):
                ended(place, chance.uniform(0.0, takes), budget, found)
            print(found.line(f"{name}, {'budget' if budget else 'SIGINT'}", takes), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
