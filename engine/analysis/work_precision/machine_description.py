"""Description of the machine that measures, and pinning of the process to one core, which makes repeats comparable."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def describe_machine() -> dict[str, str]:
    """The processor, the operating system, and the versions of Trunnion and Python."""
    from trunnion.basics.version import version

    return {
        "processor": processor_name(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "trunnion": version(),
    }


def processor_name() -> str:
    """The processor's name, or its architecture if the operating system gives no name."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


@contextmanager
def pin_to_one_core() -> Iterator[None]:
    """Run the body on one core if the system supports it, so that repeats are comparable. Afterwards the allowed cores are
    restored."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)
