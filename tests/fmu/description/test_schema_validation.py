"""fmpy's validation and the schemas of the standards find no problem in any form of an FMU of any bundled model."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from pathlib import Path

import fmpy
import pytest
from fmpy.model_description import read_build_description
from fmpy.validation import validate_fmu
from lxml import etree

import trunnion
from tests.fmu.exported_fmus import arm
from tests.fmu.sources.c_library_build import DESIGNS
from trunnion.fmu.scene_export import ExportedScene, started
from trunnion.fmu.variables.model_exchange_states import KINDS
from trunnion.scene import model_names

pytestmark = pytest.mark.slow
TERMINALS = Path(str(fmpy.__file__)).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"


def forms(made: ExportedScene, with_sources: bool) -> Iterator[tuple[str, dict[str, bytes]]]:
    """(description of the form, its files without compiled files) of a model, in one standard and for one kind of use."""
    for flavour in ("native", "python") if made.standard == "2.0" and made.kind == "cs" else ("native",):
        for sources in (False, True) if with_sources and flavour == "native" else (False,):
            yield f"{made.standard} {made.kind} {flavour}{' with sources' * sources}", made.documents(flavour, sources)


def problems(files: dict[str, bytes]) -> list[str]:
    """Problems that fmpy and the schemas find in the files of a form, and missing files that the description names."""
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w") as z:
        for name, text in files.items():
            z.writestr(name, text)
    wrong = validate_fmu(box)
    root = etree.fromstring(files["modelDescription.xml"])
    named = {e.get("name") for e in root.iterfind("*/SourceFiles/File")}
    if "terminalsAndIcons/terminalsAndIcons.xml" in files:
        schema = etree.XMLSchema(etree.parse(str(TERMINALS)))
        schema.validate(etree.fromstring(files["terminalsAndIcons/terminalsAndIcons.xml"]))
        wrong += [str(e) for e in schema.error_log]
    if "sources/buildDescription.xml" in files:
        named = {f for told in read_build_description(box) for s in told.sourceFileSets for f in s.sourceFiles}
    if any(f.startswith("sources/") for f in files) != bool(named):
        wrong.append("sources, or the names of them, are missing")
    return wrong + [f"{n} is missing" for n in named if f"sources/{n}" not in files]


@pytest.mark.parametrize("name", [*model_names(), *DESIGNS, "arm"])
def test_no_form_of_any_model_has_a_problem(name: str) -> None:
    """Kernels made of parts have the same description, but no sources."""
    scene = arm() if name == "arm" else trunnion.load_scene(trunnion.models_dir() / name)
    model, first = started(scene, None, "compiled")
    found = {}
    for standard in ("2.0", "3.0"):
        for kind in ("cs",) if name == "arm" else KINDS:  # a motion of ``arm`` follows an input, which excludes model exchange
            made = ExportedScene(model, first, 0.0, True, standard, kind)
            found |= {what: problems(files) for what, files in forms(made, True)}
    assert len(found) == (5 if name == "arm" else 13)
    assert {what: wrong for what, wrong in found.items() if wrong} == {}
