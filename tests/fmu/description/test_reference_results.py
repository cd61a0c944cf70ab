"""FMI-LS-REF: an FMU with its reference results. The tests compare the manifest with the standard's schema, and the FMU's own run
with the results."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

from tests.fmu.fmpy_validation import validated
from trunnion import load_scene, simulate
from trunnion.fmu.reference_run import reference_run
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict
from trunnion.system.construction.system_builder import build

FOLDER = "extra/org.fmi-standard.fmi-ls-ref/"
ROOT = {
    "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-version": "1.0.0-alpha.1",
    "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-description":
        "Layered Standard providing information on related files included in an FMU.",
}  # fmt: skip
ROLES = re.compile(
    "document|requirement|specification|model|parameter|system|testcase|experiment(/(smoke-test|validation|uncertainty-analysis))?"
    "|result|method|rationale|report|request|delivery|configuration|signature|serialized-state(/.*)?|meta-data|other"
)


def table(z: zipfile.ZipFile, name: str) -> dict[str, np.ndarray]:
    """The columns of a CSV file beside the manifest."""
    head, *rows = csv.reader(io.TextIOWrapper(z.open(FOLDER + name)))
    return dict(zip(head, np.array(rows, float).T, strict=True))


def largest_share(file: Path, **start: float) -> float:
    """The largest difference between the FMU's run by the reference's experiment and its reference, relative to the allowed
    difference."""
    with zipfile.ZipFile(file) as z:
        expected, allowed = table(z, "reference.csv"), table(z, "allowed_differences.csv")
        (run,) = ElementTree.fromstring(z.read(FOLDER + "reference.exp")).iter("TransientSimulation")
    names, until, every = [n for n in expected if n != "time"], float(run.attrib["stopTime"]), float(run.attrib["stepSize"])
    got = simulate_fmu(str(file), output=names, start_values=start, stop_time=until, output_interval=every)
    assert list(expected) == list(allowed)
    assert np.allclose(got["time"], expected["time"], rtol=0.0, atol=1e-9)
    return max(float(np.abs(got[n] - expected[n]).max() / allowed[n][0]) for n in names)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("model", "how"), [("spherical_pendulum", {"fmi": 3, "scalars": True}), ("crank_slider", {})])
def test_an_fmu_with_its_reference_proves_itself_and_a_wrong_one_does_not(model: str, how: dict, tmp_path: Path) -> None:
    file = tmp_path / "proved.fmu"
    export(model, file, reference=True, outputs=["*.q[*]", "*.qd[*]", "*.friction.torque[*]"], **how)
    assert validated(str(file)) == []
    assert largest_share(file) <= 1.0
    friction = {"spherical_pendulum": "joints.ball.friction.mu", "crank_slider": "joints.slider_pin.friction.mu"}[model]
    assert largest_share(file, **{friction: 0.0}) > 100.0


def test_the_stated_errors_cover_other_runs_of_a_motion_that_amplifies_round_off() -> None:
    """The pole of `cart_pole` passes the vertical within a microsecond: other builds of the same run differed by 26 times its own
    error. Other tolerances stand for other builds."""
    scene = load_scene("cart_pole")
    numbers, settings = build(scene).numbers, {"kernel": "parts", "outputs": ["*.q[*]", "*.qd[*]"]}
    run = reference_run(scene, numbers, settings)
    assert run.certainty is not None
    rows = int(np.searchsorted(run.time, run.certainty.promise.until))
    assert rows > 4000
    for share in np.linspace(0.9, 0.99, 10):
        other = simulate(scene, rtol=share * float(scene.simulation.rtol), **settings)
        assert (np.abs(other.data - run.data)[:rows, 1:].max(axis=0) <= run.certainty.error[rows - 1]).all(), share


def test_the_errors_of_a_motion_that_does_not_amplify_round_off_are_those_of_its_run() -> None:
    scene = load_scene("simple_pendulum")
    settings = {"kernel": "parts", "outputs": ["*.q[*]"]}
    run, plain = reference_run(scene, build(scene).numbers, settings), simulate(scene, certify=True, **settings)
    assert run.certainty is not None
    assert plain.certainty is not None
    assert np.array_equal(run.certainty.error, plain.certainty.error)


def test_a_quaternion_whose_sign_round_off_decides_is_no_reference(tmp_path: Path) -> None:
    """The wheel is at a half turn at 0.5 s; an orientation's scalar part is not negative."""
    turn = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "wheel"}
    turn["drive"] = {"table": {"time": [0, 1], "value": [0, 2 * np.pi]}}
    wheel = {"mass": 1, "inertia": [1, 1, 1]}
    scene = scene_from_dict(
        {"name": "half_turn", "bodies": {"wheel": wheel}, "joints": {"shaft": turn}, "simulation": {"until": 1, "every": 0.1}}
    )
    export(scene, tmp_path / "proved.fmu", reference=True, kernel="parts", outputs=["wheel.orientation[*]", "shaft.q[1]"])
    with zipfile.ZipFile(tmp_path / "proved.fmu") as z:
        assert list(table(z, "reference.csv")) == ["time", "shaft.q[1]"]


def test_the_reference_of_a_mechanism_that_begins_at_rest_on_its_catch_has_every_row(tmp_path: Path) -> None:
    """The trolley's engagement at 1e-6 s was marginal, and no row after it was stated."""
    file = tmp_path / "proved.fmu"
    export("folding_panel", file, reference=True, kernel="parts", outputs=["*.q[1]", "*.qd[1]"])
    with zipfile.ZipFile(file) as z:
        assert table(z, "reference.csv")["time"][-1] == float(read_model_description(file).defaultExperiment.stopTime)
    assert largest_share(file) <= 1.0


def test_the_manifest_lists_its_files_as_the_schema_requires(tmp_path: Path) -> None:
    file = tmp_path / "proved.fmu"
    export("simple_pendulum", file, reference=True, fmi=3)
    with zipfile.ZipFile(file) as z:
        root = ElementTree.fromstring(z.read(FOLDER + "fmi-ls-manifest.xml"))
        names, guide = set(z.namelist()), z.read("documentation/fmi-ls-ref.txt").decode()
    assert root.tag == "fmiReferences"
    assert root.attrib == ROOT
    for related in root:
        assert related.tag == "Related"
        assert set(related.attrib) <= {"type", "source", "role", "description"}
        assert ROLES.fullmatch(related.attrib["role"])
        assert FOLDER + related.attrib["source"] in names
    assert {r.get("role") for r in root} == {"model", "result", "experiment"}  # SSV 1.0 has no arrays
    assert "from t = 0 to" in guide


@pytest.mark.parametrize("scalars", [False, True])
def test_the_experiment_is_the_default_one_with_the_files_beside_it_as_the_schema_requires(scalars: bool, tmp_path: Path) -> None:
    file = tmp_path / "proved.fmu"
    export("simple_pendulum", file, reference=True, fmi=3, scalars=scalars)
    with zipfile.ZipFile(file) as z:
        root = ElementTree.fromstring(z.read(FOLDER + "reference.exp"))
        names, times = set(z.namelist()), table(z, "reference.csv")["time"]
    usual = read_model_description(file).defaultExperiment
    assert (root.tag, set(root.attrib)) == ("Experiments", {"name"})
    (one,) = root
    assert (one.tag, set(one.attrib)) == ("Experiment", {"name", "tolerance"})
    simulation, *files = one
    expected = [("startTime", usual.startTime), ("stopTime", usual.stopTime), ("stepSize", usual.stepSize)]
    assert simulation.tag == "TransientSimulation"
    assert [(k, float(x)) for k, x in simulation.attrib.items()] == [(k, float(x)) for k, x in expected]
    assert times[-1] == float(usual.stopTime)
    assert [f.tag for f in files] == ["Parameters"] * scalars + ["References"]
    assert all(list(f.attrib) == ["source"] and FOLDER + f.attrib["source"] in names for f in files)
