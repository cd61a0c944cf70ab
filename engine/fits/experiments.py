"""Which of several further experiments would tell most of a fit's parameters, by what it would add to their information."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.fits.api import Fit
from engine.scene.given import Amounts, Names, names_given
from engine.scene.overrides import apply
from engine.sensitivities.api import sensitivity


@dataclass(frozen=True)
class Trial:
    """An experiment that could be made. overrides: what would be different from the scene; outputs: what would be measured; noise:
    with which standard deviation, for all or by column; until, every: to when, and how often, s. Left out: as in the fit's first
    run."""

    overrides: Mapping[str, Any] = field(default_factory=dict)
    outputs: Names | None = None
    noise: float | Mapping[str, float] | None = None
    until: float | str | None = None
    every: float | str | None = None


@dataclass(frozen=True)
class Proposal:
    """An experiment and what it would tell. gain: information, bits (log2 of how much smaller the ellipsoid of the parameters would
    be); deviation: local standard deviations after it, by parameter; why: what keeps it from being made, its gain is then −∞."""

    name: str
    gain: float
    deviation: Mapping[str, float]
    why: str = ""

    def document(self) -> dict[str, Any]:
        """As plain data; what is infinite is None."""
        gain = self.gain if math.isfinite(self.gain) else None
        deviation = {n: d if math.isfinite(d) else None for n, d in self.deviation.items()}
        return {"name": self.name, "gain": gain, "deviation": deviation, "why": self.why}


def propose(found: Fit, trials: Mapping[str, Trial | Mapping[str, Any]]) -> tuple[Proposal, ...]:
    """Rank experiments by their D-optimal gain at a fit's estimate, the best first.

    trials: by name; one may be given by its overrides alone. The gain is that of the parameters which all runs share; a start of
    its own would have to be found from the new run too. So that it is finite where nothing determines a parameter yet, each counts
    as known beforehand to its own size. SceneError with what is wrong with any trial.
    """
    asked = {n: t if isinstance(t, Trial) else Trial(t) for n, t in trials.items()}
    if not asked:
        raise SceneError([Problem("trials", "none is given", 'for example {"from higher": {"joints.pivot.start.q": "120 deg"}}')])
    assert found.found is not None
    objective = found.found.objective
    shared = len(objective.curves.shared)
    unit = _sizes(found)
    now = _schur(found.found.J.T @ found.found.J * np.outer(unit, unit), shared) + np.eye(shared)
    out, problems = [], []
    for name, trial in asked.items():
        try:
            out.append(_proposal(name, found, trial, now))
        except SceneError as e:
            problems += [Problem(f"trial {name}, {p.where}", p.what, p.hint) for p in e.problems]
        except SimulationError as e:
            out.append(Proposal(name, -math.inf, {}, str(e)))
    if problems:
        raise SceneError(problems)
    return tuple(sorted(out, key=lambda p: -p.gain))


def _sizes(found: Fit) -> np.ndarray:
    """The size of every parameter, in units of its start value."""
    assert found.found is not None
    u = np.abs(found.found.u)
    return np.where(u > 1e-6, u, 1.0)


def _schur(M: np.ndarray, shared: int) -> np.ndarray:
    """Information about the first parameters when the others have to be found as well."""
    A, B, C = M[:shared, :shared], M[:shared, shared:], M[shared:, shared:]
    return A - B @ np.linalg.pinv(C) @ B.T if C.size else A


def _proposal(name: str, found: Fit, trial: Trial, now: np.ndarray) -> Proposal:
    solved = found.found
    assert solved is not None
    curves, objective, first = solved.objective.curves, solved.objective, found.runs[0]
    read = Amounts()
    until = float(first.time[-1]) if trial.until is None else read.time(trial.until, "until")
    every = float(first.time[1]) if trial.every is None else read.time(trial.every, "every")
    read.end()
    paths, shared = [*curves.shared, *curves.own], len(curves.shared)
    scene = apply(solved.scene, {p: found.values[p] for p in curves.shared} | dict(trial.overrides))
    outputs = list(first.measured) if trial.outputs is None else list(names_given(trial.outputs))
    s = sensitivity(scene, paths, outputs, until, every, curves.rtol)
    noise = np.array([_noise(c, trial, first.noise) for c in s.names])
    sizes = _sizes(found)[: len(paths)] * objective.unit[: len(paths)]
    J = (s.derivatives / noise[None, :, None]).reshape(-1, len(paths)) * sizes
    after = now + _schur(J.T @ J, shared)
    gain = 0.5 * (np.linalg.slogdet(after)[1] - np.linalg.slogdet(now)[1]) / math.log(2.0)
    deviation = np.sqrt(np.diag(np.linalg.inv(after))) * sizes[:shared]
    return Proposal(name, float(gain), dict(zip(curves.shared, deviation.tolist(), strict=True)))


def _noise(column: str, trial: Trial, known: Mapping[str, float]) -> float:
    """Standard deviation with which a trial would measure a column. SceneError where nothing says."""
    given = trial.noise.get(column) if isinstance(trial.noise, Mapping) else trial.noise
    found = known.get(column) if given is None else given
    if found is None or not found > 0.0:
        raise SceneError([Problem("noise", f"nothing says how exactly {column} is measured", "give its standard deviation")])
    return float(found)


__all__: Sequence[str] = ["Proposal", "Trial", "propose"]
