"""A fit that ``fit`` or ``jobs fit`` requests: parameters, measured runs, laws to compare, experiments to rank."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.cli.options import completion
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import repeatable

if TYPE_CHECKING:
    from trunnion.analysis.fits.experiment_design import Experiment
    from trunnion.analysis.fits.measurements import MeasuredRun
    from trunnion.analysis.fits.model_comparison import Candidate
    from trunnion.scene.data_classes.scene import Scene

Data = Annotated[
    list[str],
    repeatable(
        "--data",
        metavar="FILE[; PATH=VALUE]…",
        help="File of a measured run (.csv or .parquet), and the numbers of the scene that were different in this run.",
    ),
]
VaryPrior = Annotated[
    list[str],
    repeatable(
        "--vary", metavar="PATH[=PRIOR]", autocompletion=completion.parameters,
        help="A parameter to estimate. PRIOR: bounds low:high, or a distribution normal(mean, deviation) or lognormal(…).",
    ),
]  # fmt: skip
Own = Annotated[
    list[str],
    repeatable(
        "--own", metavar="PATH[=PRIOR]", autocompletion=completion.parameters,
        help="A parameter to estimate for each run separately, in the notation of --vary.",
    ),
]  # fmt: skip
Column = Annotated[
    list[str],
    repeatable(
        "--column",
        metavar="COLUMN=NAME",
        help="A column of the scene, and the name of this column in the files if the names differ.",
    ),
]
Noise = Annotated[
    list[str],
    repeatable(
        "--noise",
        metavar="[COLUMN=]S",
        help="Standard deviation of the measurement noise, for all columns or for one column.",
        show_default="estimated",
    ),
]
Level = Annotated[str, typer.Option("--level", metavar="P", help="Confidence level of the intervals.")]
Compare = Annotated[
    list[str],
    repeatable(
        "--compare",
        metavar="LAW[; PATH~GUESS]…",
        help="A friction law to compare; PATH~GUESS: a number to estimate and its start value; PATH=VALUE: a fixed number.",
    ),
]
Trials = Annotated[
    list[str],
    repeatable(
        "--try",
        metavar="PATH=VALUE[; …]",
        help="A possible experiment to rank, as changed numbers of the scene; until=T and every=DT set its duration and sampling.",
    ),
]
NOISE_EXAMPLE = "--noise 'pivot.q[1]=0.5 mrad'"


@dataclass
class FitRequest:
    """Arguments of a fit. shared: parameters common to all runs. own: parameters with a value for each run. unused: columns of
    files that the fit ignores. trials: possible experiments, by their text."""

    shared: list[str] = field(default_factory=list)
    own: list[str] = field(default_factory=list)
    bounds: dict[str, tuple[str | None, str | None]] = field(default_factory=dict)
    priors: dict[str, str] = field(default_factory=dict)
    runs: list[MeasuredRun] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)
    level: float = 0.95
    candidates: dict[str, Candidate] = field(default_factory=dict)
    trials: dict[str, Experiment] = field(default_factory=dict)

    def arguments(self) -> dict[str, Any]:
        """Arguments of ``fit`` and ``compare`` besides the scene, the parameters and the laws."""
        return {"runs": self.runs, "own": self.own, "bounds": self.bounds, "priors": self.priors, "level": self.level}


def read_fit_request(
    scene: Scene | None,
    reader: ArgumentReader,
    *,
    data: Sequence[str],
    vary: Sequence[str],
    own: Sequence[str],
    column: Sequence[str],
    noise: Sequence[str],
    level: str,
    compare: Sequence[str],
    trials: Sequence[str],
) -> FitRequest:
    """The request that the words describe. Mistakes are added to ``reader``."""
    out = FitRequest()
    for texts, names, where in ((vary, out.shared, "--vary"), (own, out.own, "--own")):
        for text in texts:
            read_parameter(text, names, out, where, reader)
    if not out.shared and not any("~" in text for text in compare):
        reader.add("--vary", "no parameter is estimated", "for example --vary joints.pivot.friction.mu")
    read_level = reader.quantity(level, "1", "--level")
    out.level = 0.95 if read_level is None else read_level
    out.candidates = dict(read_candidate(text, reader) for text in compare)
    out.trials = {text: read_trial(text, scene, reader) for text in trials}
    if not data:
        reader.add("--data", "no run is given", "--data FILE.csv, with a column time and columns of the scene")
    names_in_files = reader.named_values(column, "--column", "NAME=VALUE", "--column 'pivot.q[1]=angle'")
    read_runs(data, scene, names_in_files, read_noise(noise, reader), out, reader)
    return out


def read_runs(
    texts: Sequence[str], scene: Scene | None, renamed: Mapping[str, str], noise: Any, out: FitRequest, reader: ArgumentReader
) -> None:
    """Read words of the form FILE; PATH=VALUE; … and the named files, and add the runs to the request."""
    from trunnion.analysis.fits.measurement_files import read_measured_run

    for text in texts:
        file, *changes = parts(text)
        overrides = reader.assignments(changes)
        if scene is not None:
            read = reader.attempt(partial(read_measured_run, file, scene, renamed, overrides, noise))
            if read is not None:
                name = Path(file).stem
                taken = sum(r.name.partition(" #")[0] == name for r in out.runs)
                out.runs.append(replace(read[0], name=f"{name} #{taken + 1}" if taken else name))
                out.unused += [f"{file}: {n}" for n in read[1]]


def parts(text: str) -> list[str]:
    """The parts of a word between semicolons."""
    return [part.strip() for part in text.split(";") if part.strip()] or [text]


def read_parameter(text: str, names: list[str], out: FitRequest, where: str, reader: ArgumentReader) -> None:
    """Read a parameter: PATH, PATH=low:high (one end may be empty), PATH=normal(…) or PATH=lognormal(…)."""
    path, sign, prior = (part.strip() for part in text.partition("="))
    if path not in names:
        names.append(path)
    if not sign:
        return
    low, colon, high = (part.strip() for part in prior.partition(":"))
    if "(" in prior:
        out.priors[path] = prior
    elif colon and (low or high):
        out.bounds[path] = (low or None, high or None)
    else:
        hint = "PATH alone, PATH=low:high, PATH=normal(mean, deviation) or PATH=lognormal(mean, deviation)"
        reader.add(where, f"{text!r} has neither bounds nor a prior", hint)


def read_noise(texts: Sequence[str], reader: ArgumentReader) -> float | Mapping[str, float] | None:
    """Standard deviation of the noise: one number for all columns, or numbers by column. None if the fit has to estimate the noise.
    A text without a unit is in SI units."""
    from trunnion.scene.units.numbers_with_units import AnyUnit
    from trunnion.scene.units.unit_parser import UnitError

    def read(text: str) -> float:
        try:
            return float(AnyUnit()(text))
        except UnitError as e:
            reader.add("--noise", e.what, e.hint or f"for example --noise '0.5 mrad', or {NOISE_EXAMPLE}")
            return 1.0

    if len(texts) == 1 and "=" not in texts[0]:
        return read(texts[0])
    named = reader.named_values(texts, "--noise", "NAME=VALUE", NOISE_EXAMPLE)
    return {n: read(v) for n, v in named.items()} or None


def read_candidate(text: str, reader: ArgumentReader) -> tuple[str, Candidate]:
    """Read the text "LAW; PATH~GUESS; …; PATH=VALUE; …": a law, numbers to estimate with their start values, and fixed numbers."""
    from trunnion.analysis.fits.model_comparison import Candidate
    from trunnion.elements.friction import REGISTRY

    law, *words = parts(text)
    fitted, changes = [], {}
    for word in words:
        path, sign, guess = (part.strip() for part in word.partition("~"))
        if sign:
            fitted.append(path)
        changes.update(reader.assignments([f"{path}={guess}" if sign else word]))
    reader.choice(law, tuple(REGISTRY), "--compare")
    return law if not words else text, Candidate(fitted, law, changes)


def read_trial(text: str, scene: Scene | None, reader: ArgumentReader) -> Experiment:
    """Read a possible experiment from the text "PATH=VALUE; …; until=T; every=DT"."""
    from trunnion.analysis.fits.experiment_design import Experiment
    from trunnion.scene.overrides import apply

    changes = reader.assignments(parts(text))
    times = {k: changes.pop(k) for k in ("until", "every") if k in changes}
    if scene is not None and changes:
        reader.attempt(partial(apply, scene, changes), "--try")
    return Experiment(changes, **times)
