"""Model comparison: fits each candidate model to the same data and ranks the models by information criteria."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from trunnion.analysis.fits.information_criteria import Criteria
from trunnion.analysis.fits.measurements import MeasuredRun
from trunnion.analysis.fits.parameter_estimation import Fit, fit, make_objective
from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import Given, apply, law_changes, scene_given
from trunnion.scene.units.python_arguments import Names, names_given

CLEAR = 2.0
"""A criterion does not decide between two models if its values differ by less than this value. The better model is then less than e
times as likely as the other."""


@dataclass(frozen=True)
class Candidate:
    """A model to compare.

    Attributes:
        parameters: paths of the parameters of this model, in addition to the common parameters.
        law: friction law of all frictional joints; "" means the laws of the scene.
        overrides: other changes of the scene, {path: value}, such as start values of parameters.
        bounds: as for ``fit``.
        priors: as for ``fit``.
    """

    parameters: Names = ()
    law: str = ""
    overrides: Mapping[str, Any] = field(default_factory=dict)
    bounds: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    priors: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ModelScore:
    """A candidate with its fit and rank.

    Attributes:
        fit: the fit; None if the candidate could not be fitted.
        worse_by_bic: BIC minus the lowest BIC of all candidates.
        worse_by_aicc: AICc minus the lowest AICc of all candidates.
        weight: Akaike weight: the candidate's share of the total likelihood, by AICc.
        why: the reason why there is no fit; "" if there is a fit.
    """

    name: str
    fit: Fit | None
    worse_by_bic: float = math.inf
    worse_by_aicc: float = math.inf
    weight: float = 0.0
    why: str = ""

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers. Infinite numbers become None."""
        said = {"name": self.name, "weight": self.weight, "why": self.why}
        numbers = {"worse_by_bic": self.worse_by_bic, "worse_by_aicc": self.worse_by_aicc}
        return {**said, **finite(numbers), "fit": self.fit.document() if self.fit else None}


@dataclass(frozen=True)
class ModelComparison:
    """Ranked models.

    Attributes:
        candidates: the candidates with their fits, ordered by BIC (best first), then the candidates without a fit.
        notes: notes about how certain the ranking is, and notes of the fits.
    """

    candidates: tuple[ModelScore, ...]
    notes: tuple[str, ...]

    @property
    def best(self) -> ModelScore:
        """The best candidate by BIC."""
        return self.candidates[0]

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers for JSON."""
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
) -> ModelComparison:
    """Fit several candidate models to the same measured curves and rank them by BIC and AICc.

    Args:
        scene: as for ``simulate``.
        candidates: {name: model}. {law: parameters}, with the name of a friction law, stands for ``Candidate(parameters, law)``.
        parameters: paths of parameters that every candidate fits.
        time: as for ``fit``.
        measured: as for ``fit``.
        overrides: changes of the scene for all candidates, {path: value}.
        rtol: relative tolerance of the runs.
        options: further arguments of ``fit``.

    Returns:
        The ranked models.

    Raises:
        SceneError: lists every problem of every candidate.
        SimulationError: if no candidate can be fitted.
    """
    loaded = scene_given(scene, overrides)
    asked = {n: c if isinstance(c, Candidate) else Candidate(c, n) for n, c in candidates.items()}
    given = list(options.get("runs") or ()) or [MeasuredRun(time, measured or {}, {}, options.get("noise"))]
    each, problems = {}, []
    for name, c in asked.items():
        try:
            each[name] = apply_candidate(loaded, c, names_given(parameters), options)
            where, names, extra = each[name]
            make_objective(where, names, names_given(options.get("own", ())), given, rtol, extra["bounds"], extra["priors"])
        except SceneError as e:
            problems += [Problem(f"candidate {name}, {p.where}", p.what, p.hint) for p in e.problems]
    if problems or not asked:
        raise SceneError(problems or [Problem("candidates", "no candidate is given", f"laws are {', '.join(LAWS)}")])
    fits: dict[str, Fit | str] = {}
    for name, (where, names, extra) in each.items():
        try:
            fits[name] = fit(where, names, time, measured, None, rtol, **{**options, **extra})
        except (SceneError, SimulationError) as e:
            fits[name] = str(e)
    return rank_fits(fits)


def apply_candidate(
    scene: Scene, c: Candidate, parameters: Sequence[str], options: Mapping[str, Any]
) -> tuple[Scene, tuple[str, ...], dict[str, Any]]:
    """(scene, parameters, bounds and priors) of a candidate. parameters, options: parameters and options of all candidates.

    Raises SceneError for a wrong law or wrong changes.
    """
    if c.law and c.law not in LAWS:
        raise SceneError([Problem("law", f"{c.law!r} is not a friction law", f"one of {', '.join(LAWS)}")])
    changes = {**(law_changes(scene, c.law) if c.law else {}), **c.overrides}
    extra = {k: {**(options.get(k) or {}), **getattr(c, k)} for k in ("bounds", "priors")}
    return apply(scene, changes) if changes else scene, (*parameters, *names_given(c.parameters)), extra


def rank_fits(fits: Mapping[str, Fit | str]) -> ModelComparison:
    """The comparison of fits, {name: fit}. A text in place of a fit is the reason why there is no fit. Raises SimulationError if
    there is no fit at all."""
    found = {n: f for n, f in fits.items() if isinstance(f, Fit) and f.criteria}
    failed = {n: f for n, f in fits.items() if isinstance(f, str)}
    rows, notes = weigh_models(
        {n: f.criteria for n, f in found.items() if f.criteria}, {n: f.notes for n, f in found.items()}, failed
    )
    return ModelComparison(tuple(replace(c, fit=found.get(c.name)) for c in rows), notes)


def weigh_models(
    criteria: Mapping[str, Criteria], notes: Mapping[str, Sequence[str]], failed: Mapping[str, str]
) -> tuple[list[ModelScore], tuple[str, ...]]:
    """The candidates (without their fits) ordered by BIC, best first, and notes.

    criteria, notes: criteria and notes of each fit, by name; failed: {name: reason why there is no fit}. Raises SimulationError if
    there is no fit at all.
    """
    if not criteria:
        raise SimulationError("; ".join(f"candidate {n}: {why}" for n, why in failed.items()))
    bic, aicc = (min(getattr(c, which) for c in criteria.values()) for which in ("bic", "aicc"))
    shares = {n: math.exp(-0.5 * (c.aicc - aicc)) if math.isfinite(aicc) else math.nan for n, c in criteria.items()}
    total = sum(shares.values())
    rows = [ModelScore(n, None, c.bic - bic, c.aicc - aicc, shares[n] / total) for n, c in criteria.items()]
    rows.sort(key=lambda c: c.worse_by_bic)
    return [*rows, *(ModelScore(n, None, why=why) for n, why in failed.items())], tuple(_comparison_notes(rows, notes))


def _comparison_notes(rows: Sequence[ModelScore], notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Notes about models of nearly equal quality, notes about criteria that disagree, and the notes of the fits."""
    best, out = rows[0], []
    near = [c for c in rows[1:] if c.worse_by_bic < CLEAR]
    if near:
        which = ", ".join(f"{c.name} (BIC worse by {c.worse_by_bic:.2g})" for c in near)
        out.append(
            f"the data do not decide between {best.name} and {which}: take the simpler model, or measure what distinguishes them"
        )
    others = [c for c in rows[1:] if c.worse_by_aicc < best.worse_by_aicc - CLEAR]
    out += [f"the criterion AICc prefers {c.name} to {best.name}, by {best.worse_by_aicc - c.worse_by_aicc:.2g}" for c in others]
    return [*out, *(f"{c.name}: {note}" for c in rows for note in notes[c.name])]
