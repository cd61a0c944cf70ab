"""Cases with the error of what is kept of them: each is run at its tolerance and at a tighter one (METHOD, "Global error")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from engine.abi import EventKind
from engine.abi.batches import CASE_SETTINGS
from engine.batch.loop import Loop, Reduced
from engine.batch.preparing import Rows
from engine.batch.reductions import ERROR, EVENT_NUMBERS, OF_COLUMNS, OF_DECISIONS, Reduction
from engine.batch.series import Series
from engine.batch.watch import Tick
from engine.kernel.columns import columns
from engine.simulation.block import Settings
from engine.simulation.certainty import estimate as rules
from engine.simulation.certainty.companion import companion
from engine.simulation.certainty.kinds import COORDINATES, kinds
from engine.simulation.certainty.pairing import TOLD
from engine.simulation.certainty.stated import REASONS
from engine.simulation.settings import Run

EXTREMES = ("max", "min", "final")
"""Reductions by which the motions of two runs are compared."""
BESIDE = 0.3
"""Part of the largest error among the reductions of a column that each of them has at least: one alone may pass through zero."""
RTOL = CASE_SETTINGS.names.index("rtol")
WHY = tuple(REASONS)
"""Why no error is stated of a case, by the number that is kept while it runs; 0: errors are stated."""


class CertainLoop:
    """Runs cases of one structure twice. Used as a ``Loop``; its reductions are those of the first run, and errors of them."""

    def __init__(self, rows: Rows, chosen: Sequence[Reduction], run: Run, kernel: str, series: Series | None = None):
        self.chosen = tuple(chosen)
        everything = columns(rows.built.system)
        about = [_named(r.what) for r in chosen if r.kind == ERROR]
        shown = {c for k, c in [(r.kind, r.what) for r in chosen if r.kind != ERROR] + about if k in OF_COLUMNS}
        state = [c.name for c in everything if c.quantity.name in COORDINATES]
        wanted = [(r.kind, r.what) for r in chosen if r.kind != ERROR] + about
        wanted += [(k, c) for c in [*shown, *state] for k in EXTREMES]
        wanted += [("count", k) for k, n in EVENT_NUMBERS.items() if EventKind(n).name.lower() not in TOLD]
        wanted += [(k, "") for k in OF_DECISIONS]
        self.wanted = list(dict.fromkeys(wanted))
        self.at = {w: i for i, w in enumerate(self.wanted)}
        inner = [Reduction(k, c, "", "") for k, c in self.wanted]
        self.first, self.second = Loop(rows, inner, run, kernel, series), Loop(rows, inner, run, kernel)
        self.model = self.first.model
        self.state = state
        known = [c for c in everything if c.name in {*shown, *state}]
        k = kinds(known, rows.built.numbers)
        self.scale = {c.name: float(k.scale[i]) for i, c in enumerate(known)}
        self.wraps = {c.name for i, c in enumerate(known) if k.wraps[i]}
        self.has_error = {c.name for i, c in enumerate(known) if k.errs[i]}
        self.rate, self.method = rows.built.numbers.rate, run.method_of(rows.built.scene)

    @property
    def build_seconds(self) -> float:
        """Time of symbolic build and compilation so far, s."""
        return self.first.build_seconds + self.second.build_seconds

    def run(self, rows: Rows, tick: Tick | None = None) -> Reduced:
        """Run the cases; when ``tick`` says no, only those that have been run twice by then count."""
        n = len(rows.index)
        a = self.first.run(rows, tick and (lambda done: tick(done // 2)))
        at = np.searchsorted(rows.index, a.index)
        rtol, found = np.unique(rows.settings[:, RTOL], return_inverse=True)
        pairs = [companion(Settings(float(r), self.method), {}) for r in rtol]
        tight, larger = (np.array(x)[found] for x in ([s.rtol for s, _ in pairs], [c for _, c in pairs]))
        settings = rows.settings.copy()
        settings[:, RTOL] = tight
        b = self.second.run(replace(rows, settings=settings).some(at), tick and (lambda done: tick((n + done) // 2)))
        both = np.isin(a.index, b.index)
        order = np.argsort(b.index)[np.searchsorted(np.sort(b.index), a.index[both])]
        alike = np.array([x.name == b.outcomes[j].name for x, j in zip(_some(a.outcomes, both), order, strict=True)], bool)
        begun = a.steps[both] > 0
        numbers, why = self._numbers(
            a.numbers[both], b.numbers[order], rows.settings[at[both], RTOL], larger[at[both]], alike, begun
        )
        kept = a.kept if a.kept is None else a.kept[np.isin(a.kept[:, 0], np.flatnonzero(both))]
        return Reduced(a.index[both], numbers, _some(a.outcomes, both), _some(a.audits, both), a.steps[both],
                       a.seconds + b.seconds, kept, why)  # fmt: skip

    def _numbers(
        self, a: np.ndarray, b: np.ndarray, rtol: np.ndarray, larger: np.ndarray, alike: np.ndarray, begun: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(what is asked for, cases × reductions; why no error is stated, cases) from what two runs gave (cases × wanted). larger:
        by how much differences are to be enlarged; alike: whether both ended alike; begun: whether they made a step."""
        with np.errstate(invalid="ignore"):  # no event, or no margin: infinite in both
            off = np.abs(a - b)
        for (_, column), i in self.at.items():
            if column in self.wraps:
                off[:, i] = np.abs(np.mod(off[:, i] + np.pi, 2.0 * np.pi) - np.pi)
        off *= rules.SAFETY * larger[:, None]
        states = np.zeros(len(a))
        for name in self.state:
            places = [self.at[k, name] for k in EXTREMES]
            size = self.scale[name] + np.abs(a[:, places]).max(axis=1)
            states = np.maximum(states, off[:, places].max(axis=1) / size)
        why = self._why(a, b, states, alike, begun)
        out = []
        for r in self.chosen:
            if r.kind != ERROR:
                out.append(a[:, self.at[r.kind, r.what]])
                continue
            found = self._error(_named(r.what), a, off, states, rtol)
            out.append(np.where((why == 0) & np.isfinite(a[:, self.at[_named(r.what)]]), found, np.nan))
        return (np.array(out).T if out else np.zeros((len(a), 0))), why

    def _why(self, a: np.ndarray, b: np.ndarray, states: np.ndarray, alike: np.ndarray, begun: np.ndarray) -> np.ndarray:
        """Why no error is stated of each case, as a place in WHY; 0 where both runs decide alike, clearly, and errors stay small.
        Of several reasons that one is told which comes first in a run, for the most part, and makes the others follow."""
        counts = [i for (k, what), i in self.at.items() if k == "count" and what not in ("any", *TOLD)]
        margin, marginal = (self.at[k, ""] for k in OF_DECISIONS)
        near = [(alike & (x[:, margin] < rules.DECIDED * states)) | (x[:, marginal] > 0.0) for x in (a, b)]
        other = alike & (a[:, counts] != b[:, counts]).any(axis=1)
        of_one = other & ~(near[0] & near[1])  # what is decided narrowly is the event that only one of them has
        found = {
            "growth": ~(states <= rules.LINEAR),
            "outcome": ~alike,  # states and events of a run that ends earlier are those of another time
            "events": other,
            "marginal": (near[0] | (b[:, marginal] > 0.0)) & ~of_one,
            "start": ~begun,
        }
        why = np.zeros(len(a), np.int8)
        for reason, here in found.items():
            why[here] = WHY.index(reason)
        return why

    def _error(self, of: tuple[str, str], a: np.ndarray, off: np.ndarray, states: np.ndarray, rtol: np.ndarray) -> np.ndarray:
        """The error of a reduction, cases."""
        kind, what = of
        own = off[:, self.at[of]]
        if kind == "count":
            return np.zeros(len(a))
        if kind == "first":
            floor = rules.RESOLVED * rtol / self.rate + rules.ROUND_OFF * np.abs(a[:, self.at[of]])
            return np.maximum(rules.TIMED * own + floor, rules.STATE * states / self.rate)
        if what not in self.has_error:
            return np.full(len(a), np.nan)
        places = [self.at[k, what] for k in EXTREMES]
        size = np.abs(a[:, places]).max(axis=1)
        floor = np.maximum(rules.RESOLVED * rtol * size, rules.ROUND_OFF * np.maximum(size, self.scale[what]))
        return np.maximum(np.maximum(own, BESIDE * off[:, places].max(axis=1)), floor)


def _named(text: str) -> tuple[str, str]:
    kind, _, what = text.partition(":")
    return kind, what


def _some(every: list, mask: np.ndarray) -> list:
    return [x for x, kept in zip(every, mask, strict=True) if kept]
