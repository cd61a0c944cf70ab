"""The folder ``extra/org.fmi-standard.fmi-ls-ref`` of an FMU. The folder holds reference results with their allowed differences,
and the experiment that gives these results. The folder also holds the scene and the values of the parameters. A manifest lists all
files (layered standard FMI-LS-REF 1.0.0-alpha.1, for FMI 2.0 and 3.0). The experiment is in the Experiments Format (draft
ma-hs-experiments of 2026)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from trunnion.fmu.model_description.parameter_set_ssv import TYPE, of_scene, parameter_set
from trunnion.fmu.variables.exported_model import ExportedModel
from trunnion.fmu.xml_document import xml_bytes
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.simulation.global_error.column_error_kinds import kinds
from trunnion.simulation.results.csv_and_parquet import lines_of
from trunnion.simulation.results.result import Result

NAME, VERSION = "org.fmi-standard.fmi-ls-ref", "1.0.0-alpha.1"
FOLDER = f"extra/{NAME}"
SPACE = "http://fmi-standard.org/fmi-ls-manifest"
ABOUT = "Layered Standard providing information on related files included in an FMU."
REFERENCE, ALLOWED, EXPERIMENT, VALUES = "reference.csv", "allowed_differences.csv", "reference.exp", "parameters.ssv"
EXPERIMENTS = "application/x-ma-hs-experiments"
ROUND_OFF = 1e-9
"""Least allowed difference, relative to the largest value of a column. The limit is needed because FMUs and the engine round
differently."""
GUIDE = """reference.csv contains outputs of this FMU from t = 0 to {until:.9g} s, one row every {every:g} s. The engine of Trunnion
computed them with the relative tolerance {rtol:g}, with all inputs at their start values. Accuracy of this run: {errors}. {end}
Outputs without a stated error are omitted, and so are quaternions and angles that are a half turn in some row: their sign is not
determined there. Components of an array have the names array[1], array[2], ...

allowed_differences.csv has one row: the difference of each column that other machines and other communication steps may cause. This
difference is the global error of the column, and at least {least:g} of the column's largest value. If the motion amplifies
round-off, the difference also covers repetitions of this run with other round-off. In model exchange, add the errors of the
importer's solver. At the time of an event, an output that jumps may have its value before or after the jump.

To check an importer, perform the experiment in reference.exp: simulate the default experiment of modelDescription.xml without
setting any variable, and compare the outputs at the times of reference.csv.
"""


def reference_files(made: ExportedModel, reference: Result, scalars: bool) -> dict[str, bytes]:
    """The files by path in the archive. reference: a run of the scene with error estimates. scalars: whether the FMU has no arrays.
    Only then a file of parameters is written, because SSV 1.0 has no arrays."""
    stated = _stated_rows(reference)
    errors = _allowed(made, reference, stated)
    table = reference.data[:stated, [0, *(reference.names.index(n) for n in errors)]]
    files = {
        ("scene.yaml", "application/yaml", "model", "scene"): scene_to_yaml(made.scene).encode(),
        (REFERENCE, "text/csv", "result", "reference results"): _csv(errors, table),
        (ALLOWED, "text/csv", "result", f"allowed differences from {REFERENCE}"): _csv(errors, np.array([[0.0, *errors.values()]])),
    }
    if scalars:
        values = parameter_set(made.scene.name, of_scene(made.listed))
        files[VALUES, TYPE, "parameter", "start values of all parameters"] = values
    end = "" if reference.outcome.ok else f"The run ends: {reference.outcome}.\n"
    until, rtol = float(table[-1, 0]) if stated else 0.0, float(made.scene.simulation.rtol)
    files[EXPERIMENT, EXPERIMENTS, "experiment", f"the run of {REFERENCE}"] = _experiment(made, until, scalars)
    guide = GUIDE.format(until=until, every=made.step, rtol=rtol, least=ROUND_OFF, end=end, errors=reference.certainty)
    listed = {f"{FOLDER}/{name}": content for (name, *_), content in files.items()}
    return listed | {f"{FOLDER}/fmi-ls-manifest.xml": _manifest(list(files)), "documentation/fmi-ls-ref.txt": guide.encode()}


def _stated_rows(reference: Result) -> int:
    """The number of rows, counted from the start, for which the reference run states errors."""
    c = reference.certainty
    return 0 if c is None else int(np.searchsorted(reference.time, c.promise.until))


def _allowed(made: ExportedModel, reference: Result, rows: int) -> dict[str, float]:
    """The allowed difference of each real output whose error the reference run states in the rows of ``_stated_rows``."""
    c = reference.certainty
    outputs = [v.name for v in made.listed if v.causality == "output" and not v.type]
    if c is None or not rows:
        return {}
    known = {n: float(c[n][rows - 1]) for n in outputs if n in c and np.isfinite(c[n][rows - 1])}
    allowed = {n: max(error, ROUND_OFF * float(np.abs(reference[n][:rows]).max())) for n, error in known.items()}
    turned = _half_turned(made, reference, rows, allowed)
    return {n: error for n, error in allowed.items() if n not in turned}


def _half_turned(made: ExportedModel, reference: Result, rows: int, allowed: Mapping[str, float]) -> set[str]:
    """Angles modulo 2π, and components of quaternions, that may change sign: in one of these rows, the rotation is within the
    allowed difference of a half turn."""
    k, names = kinds(reference.columns, made.model.built.numbers), [c.name for c in reference.columns]
    angles = [names[i] for i in np.flatnonzero(k.wraps) if names[i] in allowed]
    out = {n for n in angles if np.pi - np.abs(reference[n][:rows]).max() <= allowed[n]}
    fours = [[names[i] for i in four] for four in k.quaternions]
    return out.union(*(f for f in fours if f[0] in allowed and np.abs(reference[f[0]][:rows]).min() <= allowed[f[0]]))


def _csv(names: Mapping[str, float], rows: np.ndarray) -> bytes:
    """A CSV file with the time and the named columns."""
    return ",".join(["time", *names]).encode() + b"\n" + bytes(lines_of(rows))


def _experiment(made: ExportedModel, until: float, scalars: bool) -> bytes:
    """The experiment that gives the reference results. until: end of the experiment, s. scalars: whether the folder has a file of
    parameters."""
    root = Element("Experiments", {"name": made.scene.name})
    one = SubElement(root, "Experiment", {"name": "reference", "tolerance": repr(float(made.scene.simulation.rtol))})
    times = {"startTime": 0.0, "stopTime": until, "stepSize": made.step}
    SubElement(one, "TransientSimulation", {k: repr(float(x)) for k, x in times.items()})
    if scalars:
        SubElement(one, "Parameters", {"source": VALUES})
    SubElement(one, "References", {"source": REFERENCE})
    return xml_bytes(root)


def _manifest(files: Sequence[tuple[str, str, str, str]]) -> bytes:
    """``fmi-ls-manifest.xml``. files: (name, MIME type, role, description) of each file."""
    about = {"fmi-ls-name": NAME, "fmi-ls-version": VERSION, "fmi-ls-description": ABOUT}
    root = Element("fmiReferences", {"xmlns:fmi-ls": SPACE} | {f"fmi-ls:{k}": v for k, v in about.items()})
    for name, kind, role, text in files:
        SubElement(root, "Related", {"type": kind, "source": name, "role": role, "description": text})
    return xml_bytes(root)
