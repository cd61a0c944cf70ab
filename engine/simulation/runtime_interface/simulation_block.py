"""A simulation block (the runtime's memory of one run) and the runtime's functions on it, called through ctypes."""

from __future__ import annotations

import ctypes
import mmap
import struct
from collections.abc import Callable
from contextlib import AbstractContextManager
from copy import copy
from typing import Any

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.shared_libraries import Kernel
from trunnion.runtime.abi import Array, Breaks, Status
from trunnion.runtime.abi.kernel_records import OUTPUTS
from trunnion.runtime.abi.run_records import BREAK, CERTIFICATE, EVENT, HELD, JUDGEMENT, SETTINGS, STATS
from trunnion.runtime.integrators import METHODS as NAMES
from trunnion.simulation.runtime_interface.c_signatures import library
from trunnion.simulation.runtime_interface.cancellation import cancellable
from trunnion.system.construction.start_values_and_scales import Numbers
from trunnion.system.signals.signal_tables import table_block

METHODS = {name: number for number, name in enumerate(NAMES)}
COUNTERS = (*(n for n in STATS.names if n != "of_method"), *NAMES)
"""Names of the numbers of ``tr_stats``, in their order. The last field of ``tr_stats`` counts the steps of each method."""
COUNTS = struct.Struct(f"{len(COUNTERS)}l")
EVENT_CAPACITY = 1024
NO_EVENTS = np.zeros(0, EVENT.dtype)
OK, MORE, ROWS_FULL, EVENTS_FULL = Status.OK, Status.MORE, Status.ROWS_FULL, Status.EVENTS_FULL
NEED_JACOBIAN, DONE, NEED_REDUNDANT = Status.NEED_JACOBIAN, Status.DONE, Status.NEED_REDUNDANT
CANCELLED = Status.CANCELLED


@dataclass(frozen=True)
class Settings:
    """Settings of the steps of a run.

    Attributes:
        rtol: relative tolerance, and also the absolute tolerance in the scene's scales.
        method: integration method.
        step: fixed step, s, without error control; 0: error control.
        max_step: longest step, s.
        max_steps: largest number of steps; 0: no limit.
        locate: whether events are located.
        project: whether loops are closed by projection after each step.
        through_jams: whether a jammed joint is stopped by a tangential impact, after which the run continues.
        evaluations: largest number of evaluations in a bounded step.
        iterations: largest number of Newton iterations in a bounded step.
        events: largest number of events in a bounded step.
    """

    rtol: float = 1e-6
    method: str = "auto"
    step: float = 0.0
    max_step: float = float("inf")
    max_steps: int = 0
    locate: bool = True
    project: bool = True
    through_jams: bool = False
    evaluations: int = 0
    iterations: int = 0
    events: int = 0

    def record(self, **scales: float) -> Any:
        """The runtime's record of the settings. scales: length in m, rate in 1/s, energy in J. Raises SceneError if the method is
        unknown."""
        if self.method not in METHODS:
            raise SceneError([Problem("method", f"{self.method!r} is unknown", f"one of {', '.join(METHODS)}")])
        return SETTINGS.ctype(*SETTINGS.row(
            rtol=self.rtol, hmax=self.max_step, hmin=0.0, hfixed=self.step, method=METHODS[self.method], project=self.project,
            locate=self.locate, max_steps=self.max_steps, through_jams=self.through_jams, brief=False,
            evaluations=self.evaluations, iterations=self.iterations, events=self.events, **scales,
        ))  # fmt: skip


def address(array: np.ndarray) -> int:
    """Address of the first number of a writable, contiguous array. (``array.ctypes.data`` takes twice as long.)"""
    return ctypes.addressof(ctypes.c_double.from_buffer(array.data))


def zeroed(count: int) -> np.ndarray:
    """Zeros that begin at a memory page. The operating system provides each page at its first use. Arrays for dense maps grow with
    the square of the mechanism's size. Such arrays take memory only in runs that form dense maps."""
    private = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_PRIVATE") else {}
    return np.frombuffer(mmap.mmap(-1, 8 * count, **private), float)


def signals(tables: np.ndarray, count: int, t: float, x: np.ndarray) -> None:
    """Write time t, s, and the values of ``count`` signals at t into the external values x (contiguous). x[1] is a time inside the
    step and selects the interval of each curve. tables: records of the curves (``system.signals.signal_tables``)."""
    library().tr_signals(tables.ctypes.data, count, t, x.ctypes.data)


class Block:
    """A simulation block: the runtime's memory of one run. Array attributes are views into this memory."""

    def __init__(self, kernel: Kernel, numbers: Numbers, parameters: np.ndarray, event_capacity: int = EVENT_CAPACITY):
        self.kernel, self.numbers, self.lib = kernel, numbers, library()
        k, o = kernel.address("kernel"), kernel.address("outputs")
        self._sizes = (len(numbers.breaks), len(table_block(numbers.tables)), event_capacity)
        self._has_jacobian = False
        self._settings: tuple[Settings | None, Numbers, Any] = (None, numbers, None)
        self._allocate(None)
        if not self.lib.tr_init(self.at, k, o, None, *self._sizes):
            raise RuntimeError("the kernel and the runtime belong to different versions of Trunnion: delete the cache of kernels")
        self.ny = sum(kernel.sizes[n] for n in ("nq", "nv", "nb"))
        self._views()
        self.width = 1 + OUTPUTS.ctype.from_address(o).nout
        self.take(numbers, parameters)

    def _allocate(self, jacobian: int | None) -> None:
        k, o = self.kernel.address("kernel"), self.kernel.address("outputs")
        self.bytes = self.lib.tr_size(k, o, jacobian, *self._sizes)
        self._memory = zeroed(self.bytes // 8 + 8)
        self.at = self._memory.ctypes.data

    def _views(self) -> None:
        s = self.kernel.sizes
        self.parameters = self._view(Array.PARAMETERS, s["np"])
        self.y = self._view(Array.STATE, self.ny + s["works"])
        self.x = self._view(Array.SIGNALS, s["nx"])
        self._tables = self.lib.tr_array(self.at, Array.TABLES)
        self.events = self._view(Array.EVENTS, EVENT.numbers * self._sizes[2]).view(EVENT.dtype)

    def copied_to(self, at: int) -> Block:
        """The copy of this block that the runtime made at the address ``at``. The caller must not free the memory of the copy."""
        other = copy(self)
        other.at, other._memory = at, np.ctypeslib.as_array((ctypes.c_double * (self.bytes // 8)).from_address(at))
        other._views()
        return other

    def attach_jacobian(self) -> None:
        """Attach the Jacobian unit, and build it if necessary. The state of the run is kept."""
        old, old_at = self._memory, self.at
        j = self.kernel.jacobian()
        self._allocate(j)
        if not self.lib.tr_attach_jacobian(self.at, old_at, j, self._sizes[1]):
            raise RuntimeError(
                "the Jacobian unit and the runtime belong to different versions of Trunnion: delete the cache of kernels"
            )
        del old
        self._has_jacobian = True
        self._views()

    def _view(self, which: Array, n: int) -> np.ndarray:
        first = (self.lib.tr_array(self.at, which) - self.at) // 8 if n else 0
        return self._memory[first : first + n]

    def take(self, numbers: Numbers, parameters: np.ndarray) -> None:
        """Set parameters, start values, tables and times of kinks of a run of the same structure. ``assemble`` and ``start`` must
        be called afterwards."""
        self.numbers = numbers
        self._start = np.concatenate([numbers.q, numbers.v, np.zeros(len(self.y) - len(numbers.q) - len(numbers.v))])
        self._given = np.concatenate([numbers.q_given_by_rate, numbers.v_given, [0.0]]).astype(float)
        self._view(Array.BREAKS, BREAK.numbers * len(numbers.breaks))[:] = numbers.break_records()
        tables = table_block(numbers.tables)
        self._view(Array.TABLES, len(tables))[:] = tables
        self.parameters[:] = parameters
        self.prepare()

    def signals(self, t: float, x: np.ndarray) -> None:
        """Write time t, s, and the values of all tables at t into the external values x (contiguous, nx). x[1] selects the interval
        of each curve."""
        self.lib.tr_signals(self._tables, self.kernel.sizes["ntables"], t, x.ctypes.data)

    def prepare(self) -> None:
        """Recompute the constants that depend on ``parameters``. This function must be called after every change of
        ``parameters``."""
        self.lib.tr_set_parameters(self.at)

    def configure(self, s: Settings) -> None:
        """Set tolerances, method and limits of the run."""
        n, (known, scaled, settings) = self.numbers, self._settings
        if known is not s or scaled is not n:
            settings = s.record(length=n.length, rate=n.rate, energy=n.energy)
            self._settings = (s, n, settings)
        self.lib.tr_configure(self.at, ctypes.addressof(settings))

    def assemble(self, t: float = 0.0) -> int:
        """Change the start values so that the loops are closed at t, s. Returns 1 after success, 0 if positions stay open, and −1
        if velocities stay open."""
        self.y[:] = self._start
        by_rate = address(self._given)
        with self.cancellable():
            return self.lib.tr_assemble(self.at, t, by_rate, by_rate + self._given.itemsize * len(self.numbers.q_given_by_rate))

    def start(self, t: float, t_stop: float, every: float, row: np.ndarray | None) -> int:
        """Begin a run from t to t_stop with output spacing ``every``, all in s; 0: a row for each step, −n: n rows. Writes the
        first row to ``row`` (width), if any. Returns the ``Status``."""
        with self.cancellable():
            return self.lib.tr_start(self.at, t, t_stop, every, None if row is None else address(row))

    def cancellable(self, stop: Callable[[], bool] = lambda: False) -> AbstractContextManager[None]:
        """Allow ``stop`` and Ctrl-C to end long work of the block (``cancellation.cancellable``)."""
        return cancellable(self.lib, lambda: self.at, stop)

    def advance(self, target: float, max_steps: int, rows: np.ndarray) -> tuple[int, int]:
        """Step towards ``target``, s, by at most ``max_steps`` steps. Returns (``Status``, number of rows written to ``rows``)."""
        count = ctypes.c_long(0)
        code = self.lib.tr_advance(self.at, target, max_steps, address(rows), len(rows), ctypes.addressof(count))
        return code, count.value

    def row(self, out: np.ndarray) -> int:
        """Write the output row at the current time to ``out`` (width). Returns OK, or the ``Status`` of the failure."""
        return self.lib.tr_row(self.at, out.ctypes.data)

    def evaluate(self) -> tuple[np.ndarray, np.ndarray]:
        """(ẏ (ny), multipliers [λ of active rows; η]) at the current state. Raises RuntimeError if there is no solution."""
        sizes = self.kernel.sizes
        dy, z = np.zeros(self.ny + sizes["works"] + 4), np.zeros(sizes["active"] + sizes["neta"] + 1)
        if not self.lib.tr_evaluate(self.at, dy.ctypes.data, z.ctypes.data):
            raise RuntimeError("the equations of the multipliers have no solution at this state")
        return dy[: self.ny], z[:-1]

    def derivatives(self) -> np.ndarray:
        """∂ẏ/∂[y, t] at the current state (ny × (ny + 1)). Attaches the Jacobian unit if it is missing. Raises RuntimeError if the
        derivatives do not exist."""
        if not self._has_jacobian:
            self.attach_jacobian()
        out = np.zeros((self.ny + 1, self.ny))
        if not self.lib.tr_derivatives(self.at, out.ctypes.data):
            raise RuntimeError("the derivatives do not exist at this state")
        return out.T

    def redundancy(self) -> tuple[int, np.ndarray]:
        """(number of patterns, largest component of each scaled reaction over all patterns (loop rows)). A pattern is a unit vector
        of scaled loop reactions that the motion does not determine."""
        share = np.zeros(sum(n for _, n in self.kernel.facts["loop_rows"]) + 1)
        return max(self.lib.tr_redundancy(self.at, share.ctypes.data), 0), share[:-1]

    def open_columns(self) -> np.ndarray:
        """Changes of the columns along the reaction patterns that the motion does not determine (evaluations × columns). Patterns
        of rows that structure removes are evaluated together for the loops of a group (``tr_open_columns``)."""
        count = self.lib.tr_open_columns(self.at, None)
        rows = np.zeros((count + 1, self.width - 1))
        self.lib.tr_open_columns(self.at, rows.ctypes.data)
        return rows[1:] - rows[0]

    def hold(self) -> np.ndarray | None:
        """Statics at the current state with all friction pairs in stick. ``start`` must be called before. Returns a ``tr_held`` for
        each pair; None if the statics have no solution."""
        out = np.zeros(self.kernel.sizes["nsliders"] + 1, HELD.dtype)
        with self.cancellable():
            return out[:-1] if self.lib.tr_hold_all(self.at, out.ctypes.data) else None

    def multipliers(self) -> np.ndarray:
        """The friction multipliers η (neta) of the last solution."""
        s = self.kernel.sizes
        return self._view(Array.MULTIPLIERS, s["active"] + s["neta"])[s["active"] :]

    def active_multipliers(self) -> np.ndarray:
        """The multipliers λ of the active rows of the last solution."""
        s = self.kernel.sizes
        return self._view(Array.MULTIPLIERS, s["active"] + s["neta"])[: s["active"]]

    def why(self) -> tuple[int, int]:
        """The cause of a failure of friction: (``Why``, index of the responsible friction pair or −1)."""
        pair = ctypes.c_int(-1)
        return self.lib.tr_diagnose_friction(self.at, ctypes.addressof(pair)), pair.value

    def open_row(self) -> tuple[int, float]:
        """The cause of a failure of the loops: (responsible constraint row or −1, independence of the rows). The independence is 1
        for fully independent rows, and 0 for dependent rows. The independence is −1 if the failure has another cause."""
        number = ctypes.c_double(-1.0)
        return self.lib.tr_fail_row(self.at, ctypes.addressof(number)), number.value

    def gap(self) -> tuple[np.ndarray, np.ndarray]:
        """At the current state: constraint residuals of the loops (rows), m or sine of an angle; their time derivatives (rows)."""
        rows = self.kernel.sizes["rows"]
        flat = np.zeros(2 * rows + 1)
        self.lib.tr_gap(self.at, flat.ctypes.data)
        return flat[:rows], flat[rows : 2 * rows]

    def broken(self, deciding: bool = False) -> set[Breaks]:
        """The laws that the current state, modes and multipliers violate. deciding: whether to apply the checks that follow a
        decision about pairs at rest, instead of the checks at the end of a step."""
        bits = self.lib.tr_verify(self.at, int(deciding))
        return {law for law in Breaks if bits & law}

    def roots(self) -> int:
        """Number of roots of the complement equations that are found at the current state."""
        return self.lib.tr_roots(self.at)

    def certificate(self) -> Any:
        """The certificate of the run so far (``tr_certificate``)."""
        out = CERTIFICATE.ctype()
        self.lib.tr_certify_run(self.at, ctypes.addressof(out))
        return out

    def judgement(self) -> bytes:
        """The audit of the finished run (a ``tr_judgement``)."""
        out = JUDGEMENT.ctype()
        self.lib.tr_audit_end(self.at)
        self.lib.tr_judge(self.at, ctypes.addressof(out))
        return bytes(out)

    @property
    def time(self) -> float:
        """Time of the state, s."""
        return self.lib.tr_time(self.at)

    def statistics(self) -> dict[str, int]:
        """The counters of the run by name: the fields of ``tr_stats``, and the number of steps of each method."""
        counted = dict(zip(COUNTERS, COUNTS.unpack(ctypes.string_at(self.lib.tr_statistics(self.at), COUNTS.size)), strict=True))
        del counted["auto"]  # a step counts for the method that auto chose
        return counted

    def take_events(self) -> np.ndarray:
        """The events since the last call (n ``tr_event``)."""
        n = self.lib.tr_events_take(self.at)
        return self.events[:n].copy() if n else NO_EVENTS
