"""Which law the data speak for: each candidate fitted, and compared by what its further numbers are worth."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.fits.api import Fit, fit, prepared
from engine.fits.criteria import Criteria
from engine.fits.measured import Measured
from engine.friction import REGISTRY as LAWS
from engine.scene.given import Names, names_given
from engine.scene.laws import law_changes
from engine.scene.model import Scene
from engine.scene.overrides import Given, apply, scene_given

CLEAR = 2.0
"""Difference of a criterion below which it does not decide: the better one is less than e times as likely."""


@dataclass(frozen=True)
class Candidate:
    """A model to compare. parameters: what is fitted besides what all candidates have; law: of all joints that rub, the scene's own
    where none is named; overrides: other changes of the scene, first guesses among them; bounds, priors: as for ``fit``."""

    parameters: Names = ()
    law: str = ""
    overrides: Mapping[str, Any] = field(default_factory=dict)
    bounds: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    priors: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Compared:
    """A candidate and its fit; worse_by_bic, worse_by_aicc: differences to the best; weight: share of the candidates' likelihood by
    AICc. A candidate that could not be fitted has none, and says why."""

    name: str
    fit: Fit | None
    worse_by_bic: float = math.inf
    worse_by_aicc: float = math.inf
    weight: float = 0.0
    why: str = ""

    def document(self) -> dict[str, Any]:
        """As plain data; what is infinite is None."""
        said = {"name": self.name, "weight": self.weight, "why": self.why}
        numbers = {"worse_by_bic": self.worse_by_bic, "worse_by_aicc": self.worse_by_aicc}
        shown = {k: v if math.isfinite(v) else None for k, v in numbers.items()}
        return {**said, **shown, "fit": self.fit.document() if self.fit else None}


@dataclass(frozen=True)
class Evidence:
    """The candidates, the best by BIC first, and what is to be known of the comparison."""

    candidates: tuple[Compared, ...]
    notes: tuple[str, ...]

    @property
    def best(self) -> Compared:
        """The best candidate by BIC."""
        return self.candidates[0]

    def document(self) -> dict[str, Any]:
        """As plain data, ready for JSON."""
        return {"candidates": [c.document() for c in self.candidates], "notes": list(self.notes)}


def compare(
    scene: Given,
    candidates: Mapping[str, Candidate | Names],
    parameters: Names = (),
    time: Any = None,
    measured: Mapping[str, Any] | None = None,
    overrides: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
    **options: Any,
) -> Evidence:
    """Fit every candidate to the same measured curves and compare them by BIC and AICc.

    candidates: by name; where the name is that of a friction law, it may be given by its parameters alone. parameters: what is
    fitted with each. All else as for ``fit``. SceneError with what is wrong with any candidate; SimulationError when none can be
    fitted.
    """
    loaded = scene_given(scene, overrides)
    asked = {n: c if isinstance(c, Candidate) else Candidate(c, n) for n, c in candidates.items()}
    given = list(options.get("runs") or ()) or [Measured(time, measured or {}, {}, options.get("noise"))]
    each, problems = {}, []
    for name, c in asked.items():
        try:
            each[name] = of_candidate(loaded, c, names_given(parameters), options)
            where, names, extra = each[name]
            prepared(where, names, names_given(options.get("own", ())), given, rtol, extra["bounds"], extra["priors"])
        except SceneError as e:
            problems += [Problem(f"candidate {name}, {p.where}", p.what, p.hint) for p in e.problems]
    if problems or not asked:
        raise SceneError(problems or [Problem("candidates", "none is given", f"laws are {', '.join(LAWS)}")])
    fits: dict[str, Fit | str] = {}
    for name, (where, names, extra) in each.items():
        try:
            fits[name] = fit(where, names, time, measured, None, rtol, **{**options, **extra})
        except (SceneError, SimulationError) as e:
            fits[name] = str(e)
    return judged(fits)


def of_candidate(
    scene: Scene, c: Candidate, parameters: Sequence[str], options: Mapping[str, Any]
) -> tuple[Scene, tuple[str, ...], dict[str, Any]]:
    """(scene, names of what is fitted, bounds and priors) of a candidate; parameters, options: what all candidates have. SceneError
    with what is wrong with its law and changes."""
    extra = {k: {**(options.get(k) or {}), **getattr(c, k)} for k in ("bounds", "priors")}
    return _scene(scene, c), (*parameters, *names_given(c.parameters)), extra


def _scene(scene: Scene, c: Candidate) -> Scene:
    if c.law and c.law not in LAWS:
        raise SceneError([Problem("law", f"{c.law!r} is no friction law", f"one of {', '.join(LAWS)}")])
    changes = {**(law_changes(scene, c.law) if c.law else {}), **c.overrides}
    return apply(scene, changes) if changes else scene


def judged(fits: Mapping[str, Fit | str]) -> Evidence:
    """The comparison of fits, or of reasons why there are none, by name. SimulationError where there is no fit at all."""
    found = {n: f for n, f in fits.items() if isinstance(f, Fit) and f.criteria}
    failed = {n: f for n, f in fits.items() if isinstance(f, str)}
    rows, notes = weighed({n: f.criteria for n, f in found.items() if f.criteria}, {n: f.notes for n, f in found.items()}, failed)
    return Evidence(tuple(replace(c, fit=found.get(c.name)) for c in rows), notes)


def weighed(
    criteria: Mapping[str, Criteria], notes: Mapping[str, Sequence[str]], failed: Mapping[str, str]
) -> tuple[list[Compared], tuple[str, ...]]:
    """(candidates, the best by BIC first, without their fits; what is to be known) from the criteria and notes of their fits, and
    from why there are none. SimulationError where there is no fit at all."""
    if not criteria:
        raise SimulationError("; ".join(f"candidate {n}: {why}" for n, why in failed.items()))
    bic, aicc = (min(getattr(c, which) for c in criteria.values()) for which in ("bic", "aicc"))
    shares = {n: math.exp(-0.5 * (c.aicc - aicc)) if math.isfinite(aicc) else math.nan for n, c in criteria.items()}
    total = sum(shares.values())
    rows = [Compared(n, None, c.bic - bic, c.aicc - aicc, shares[n] / total) for n, c in criteria.items()]
    rows.sort(key=lambda c: c.worse_by_bic)
    return [*rows, *(Compared(n, None, why=why) for n, why in failed.items())], tuple(_notes(rows, notes))


def _notes(rows: Sequence[Compared], notes: Mapping[str, Sequence[str]]) -> list[str]:
    """What is to be known of a comparison."""
    best, out = rows[0], []
    near = [c for c in rows[1:] if c.worse_by_bic < CLEAR]
    if near:
        which = ", ".join(f"{c.name} (BIC worse by {c.worse_by_bic:.2g})" for c in near)
        out.append(f"the data cannot tell {best.name} from {which}: take the simpler one, or measure what they differ in")
    others = [c for c in rows[1:] if c.worse_by_aicc < best.worse_by_aicc - CLEAR]
    out += [f"by AICc {c.name} is better than {best.name}, by {best.worse_by_aicc - c.worse_by_aicc:.2g}" for c in others]
    return [*out, *(f"{c.name}: {note}" for c in rows for note in notes[c.name])]
