"""Runs of one scene at five settings, and their differences in outcome, events, end state and works."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.engine.checks.event_list_difference import difference
from trunnion import Scene
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import run
from trunnion.simulation.runtime_interface.simulation_block import Settings

SETTINGS: tuple[tuple[str, float, str], ...] = (
    ("auto", 1e-6, "auto"), ("rk5", 1e-6, "auto"), ("rk8", 1e-6, "auto"), ("rosenbrock", 1e-6, "auto"), ("auto", 1e-9, "compiled"),
)  # fmt: skip
"""Method, tolerance and kernel of each run; the last is the most exact."""
STEPS = 40000
"""Steps a run may take."""
ROWS = 50
COLUMNS = ["*.q*", "energy.*"]
"""Rows and columns of a run."""
APART = 1e-3
"""Largest relative difference of end states and works for runs that are alike. The limit is a thousand times the tolerance, because
stops, hooks and onsets of sliding amplify errors."""
TIGHTER, TIGHTEST = 1e-3, 1e-11
"""Factor on the tolerances at which differing runs are repeated, and the least tolerance of these repeated runs. The repeated runs
must also agree within ``APART``."""
MANY = 20.0
"""A run with this many times the steps of the run with the fewest is reported."""


@dataclass(frozen=True)
class Runs:
    """The runs of a scene, in the order of the settings, and the differences between them."""

    results: tuple[Result, ...]
    differences: tuple[str, ...]
    marginal: bool
    """Whether a run has an event that its own tolerance leaves undecided."""
    amplified: tuple[str, ...] = ()
    """Differences that vanish at tighter tolerances: the mechanism amplifies the error that the tolerance allows."""

    @property
    def outcomes(self) -> tuple[str, ...]:
        """The name of the outcome of each run."""
        return tuple(r.outcome.name for r in self.results)

    @property
    def alike(self) -> bool:
        """True if there is no difference."""
        return not self.differences


def runs(scene: Scene, settings: tuple[tuple[str, float, str], ...] = SETTINGS) -> Runs:
    """Run a scene at all settings, and compare each run with the run at the last setting. Runs on one kernel share the model. Runs
    with the same outcome that differ are repeated at tighter tolerances."""
    models = {k: Model(scene, COLUMNS, k) for k in dict.fromkeys(k for _, _, k in settings)}
    found = _runs(scene, models, settings)
    if found.alike or len(set(found.outcomes)) > 1:
        return found
    tighter = _runs(scene, models, tuple((m, max(TIGHTER * rtol, TIGHTEST), k) for m, rtol, k in settings), 1.0 / TIGHTER)
    return replace(found, differences=(), amplified=found.differences) if tighter.alike else found


def _runs(scene: Scene, models: dict[str, Model], settings: tuple[tuple[str, float, str], ...], allowed: float = 1.0) -> Runs:
    """The runs at all settings. Allowed differences of event times are multiplied by ``allowed``."""
    until = scene.simulation.until
    found = tuple(run(models[k], until, until / ROWS, Settings(rtol, m, max_steps=STEPS)) for m, rtol, k in settings)
    exact = found[-1]
    told = [
        f"{m} {rtol:g} {k}: {what}"
        for (m, rtol, k), r in zip(settings, found, strict=True)
        for what in _told(r, exact, allowed * max(rtol, settings[-1][1]))
    ]
    marginal = any(e.marginal for r in found for e in r.events)
    return Runs(found, tuple(told), marginal)


def _told(r: Result, exact: Result, rtol: float) -> list[str]:
    """The differences between a run and the exact run."""
    if r.outcome.name != exact.outcome.name:
        return [f"{r.outcome.name} at {r.outcome.time:.6g} s, not {exact.outcome.name} at {exact.outcome.time:.6g} s"]
    duration = float(exact.settings["until"])
    events = difference(r, exact, rtol, duration)
    told = [events] if events else []
    if r is exact or not (len(r) and len(exact)):
        return told
    if not _near(r.outcome.time, exact.outcome.time):
        told.append(f"ends at {r.outcome.time:.6g} s, not {exact.outcome.time:.6g} s")
    names = [c.name for c in exact.columns]
    states = _apart(r, exact, [n for n in names if n.split(".")[-1].startswith(("q[", "qd["))])
    works = _apart(r, exact, [c.name for c in exact.columns if c.name in ("energy.dissipated", "energy.input", "energy.kinetic")])
    told += [f"end state off by {states[0]:.1e} ({states[1]})"] if states[0] > APART else []
    told += [f"work off by {works[0]:.1e} ({works[1]})"] if works[0] > APART else []
    turned = float(np.ptp(r["energy.kinetic"]) + np.abs(r["energy.dissipated"][-1]) + np.ptp(r["energy.potential"]))
    residual = float(np.abs(r["energy.residual"]).max())
    if any(e.kind == "contact_closed" for e in exact.events):  # restitution takes energy, which remains in the residual
        residual = abs(float(r["energy.residual"][-1] - exact["energy.residual"][-1]))
    told += [f"energy residual {residual:.1e} J of {turned:.1e}"] if residual > APART * max(turned, 1e-9) else []
    told += [f"audit {r.audit.verdict}"] if r.audit.verdict == "inaccurate" else []
    return told


def _near(a: float, b: float) -> bool:
    return abs(a - b) <= APART * max(abs(a), abs(b), 1e-6)


def _apart(r: Result, exact: Result, names: list[str]) -> tuple[float, str]:
    """The largest difference of final values, relative to the range of values of this kind in the run."""
    worst = (0.0, "")
    for name in names:
        kind = name.split(".")[-1].split("[")[0] if ".q" in name else "energy"
        alike = [n for n in names if kind == "energy" or n.split(".")[-1].split("[")[0] == kind]
        size = float(np.ptp(exact[name]))
        size = max(size, 1e-3 * max(float(np.ptp(exact[n])) for n in alike), 1e-6)
        worst = max(worst, (abs(float(r[name][-1] - exact[name][-1])) / size, name))
    return worst
