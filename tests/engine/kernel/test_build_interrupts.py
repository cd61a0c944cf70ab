"""Ctrl-C works while a kernel is derived and compiled: the program does not wait for a compiler, and no partial result remains.

Each test interrupts itself at a fixed place in the work."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

import trunnion
from trunnion.basics.interrupts import heed, held
from trunnion.kernel import shared_libraries
from trunnion.kernel.compilation import compiler_processes, library_cache
from trunnion.kernel.compilation.compiler_processes import BuildCancelled, CompilerProcesses, side_by_side

SLEEPS = ["sleep", "600"]
GROUPS = pytest.mark.skipif(not hasattr(os, "killpg"), reason="programs have no groups here")


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty kernel cache. The runtime and the digest of the sources are found in the usual cache first."""
    shared_libraries.runtime(), shared_libraries.sources_key()
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    return tmp_path


def interrupted(work: Callable[[], object]) -> None:
    """While the work runs, Ctrl-C acts as at a terminal and must end the work."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def left(folder: Path) -> list[str]:
    """Files in a cache other than the compiler's own files. If Ctrl-C comes while a thread is being started, the program does not
    know this thread. The thread then removes its own files."""
    names = ["?"]
    for _ in range(1000):
        names = [p.name for p in folder.iterdir() if not p.name.startswith("zig")]
        if not names:
            break
        time.sleep(0.01)
    return names


@GROUPS
def test_no_compiler_is_waited_for(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiler of this test takes ten minutes. The build ends it as soon as it has started."""
    started: list[Any] = []
    popen = subprocess.Popen

    def sleeping(command: list[str], **how: Any) -> Any:
        started.append(popen(SLEEPS, **how))
        os.kill(os.getpid(), signal.SIGINT)
        return started[-1]

    monkeypatch.setattr(compiler_processes.subprocess, "Popen", sleeping)
    interrupted(lambda: trunnion.simulate("simple_pendulum", until=0.01, kernel="compiled"))
    assert started
    assert all(p.returncode == -signal.SIGKILL for p in started)
    assert left(own_cache) == []


@GROUPS
def test_a_second_ctrl_c_does_not_disturb_the_ending_of_compilers(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While the programs are being ended, Ctrl-C is pressed again, once for each program. All programs end nevertheless."""
    started: list[Any] = []
    popen, kill = subprocess.Popen, compiler_processes._kill

    def sleeping(command: list[str], **how: Any) -> Any:
        started.append(popen(SLEEPS, **how))
        os.kill(os.getpid(), signal.SIGINT)
        return started[-1]

    def killing(process: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        kill(process)

    monkeypatch.setattr(compiler_processes.subprocess, "Popen", sleeping)
    monkeypatch.setattr(compiler_processes, "_kill", killing)
    interrupted(lambda: trunnion.simulate("simple_pendulum", until=0.01, kernel="compiled"))
    assert all(p.returncode == -signal.SIGKILL for p in started)
    assert left(own_cache) == []


@pytest.mark.parametrize("swallowed", [True, False])
def test_an_interrupt_that_a_library_keeps_to_itself_is_heard_all_the_same(
    swallowed: bool, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The wrappers of the symbolic library catch every exception inside them, or replace it by their own error."""
    leaves = shared_libraries.library_cache.entry

    def entry(name: str, make: Callable[[Path], None]) -> tuple[Path, bool]:
        if name.startswith("kernel-"):
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt:
                if not swallowed:
                    raise RuntimeError("KeyboardInterrupt") from None
        return leaves(name, make)

    monkeypatch.setattr(library_cache, "entry", entry)
    interrupted(lambda: trunnion.simulate("simple_pendulum", until=0.01, kernel="compiled"))
    assert left(own_cache) == []


@GROUPS
def test_a_failure_beside_running_programs_ends_them() -> None:
    """Work that has not started does not start after the failure."""
    group: list[CompilerProcesses] = []
    work: list[Future[Any]] = []

    def sleep() -> None:
        group.append(compiler_processes._CURRENT.get() or CompilerProcesses())
        compiler_processes.run(SLEEPS, os.environ)

    def fails() -> None:
        with side_by_side(1) as submit:
            work.extend([submit(sleep), submit(sleep)])
            while not (group and group[0]._running):
                pass
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert isinstance(work[0].exception(), BuildCancelled)
    assert work[1].cancelled() or isinstance(work[1].exception(), BuildCancelled)


def test_a_delay_of_interrupts_applies_within_code_that_admits_them() -> None:
    """The command line lets Ctrl-C through to its commands. A run within a command delays Ctrl-C until its rows are safe."""

    def work() -> None:
        with held() as outer, outer.open():
            with held() as inner:
                signal.raise_signal(signal.SIGINT)
                heed()
                assert inner.asked
            assert not outer.asked
            signal.raise_signal(signal.SIGINT)

    interrupted(work)
