"""The picture, the documentation page and the licences of an FMU."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from string import Template

from trunnion.fmu.variables.outputs_inputs_parameters import HUGE, Variable
from trunnion.kernel.compilation import library_cache
from trunnion.kernel.compilation.c_compiler import version_of
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.simulation.results.result import Result

PAGE = Path(__file__).with_name("documentation_page.html")
PICTURE = "picture.png"


def picture(result: Result) -> bytes:
    """A PNG picture, without metadata, of the mechanism at its start. The picture is cached, because the import of matplotlib takes
    longer than the rest of an export."""
    plots = find_spec("trunnion.plots")
    assert plots is not None
    sources = sorted(f for place in plots.submodule_search_locations or () for f in Path(place).rglob("*.py"))
    content: list[str | bytes] = [scene_to_yaml(result.scene), result.data.tobytes(), "\n".join(result.names)]
    drawn_by: list[str | bytes] = [version_of("matplotlib"), version_of("numpy"), *(f.read_bytes() for f in sources)]

    def make(folder: Path) -> None:
        (folder / PICTURE).write_bytes(draw(result))

    folder, _ = library_cache.entry(f"picture-{library_cache.digest(*content, *drawn_by)}", make)
    return (folder / PICTURE).read_bytes()


def draw(result: Result) -> bytes:
    """A new PNG picture of the mechanism at its start."""
    from trunnion.kernel.interface.output_columns import columns, select
    from trunnion.plots.mechanism_pictures.instant_picture import mechanism, needed
    from trunnion.system.construction.system_builder import build

    wanted = {c.name for c in select(columns(build(result.scene).system), tuple(needed(result.scene)))}
    source = result if wanted <= set(result.names) else result.scene
    out = io.BytesIO()
    mechanism(source, labels=True).savefig(out, format="png", dpi=60, metadata={"Software": None})
    return out.getvalue()


PAGES = {
    "2.0": {
        "picture": "../model.png",
        "ends": "returns fmi2Discard with the\ntime reached as fmi2LastSuccessfulTime and fmi2Terminated true",
        "events": "",
    },
    "3.0": {
        "picture": "diagram.png",
        "ends": "returns fmi3Discard with\nterminateSimulation and lastSuccessfulTime",
        "events": "<li>In hosts that handle events and accept early returns, steps end at each stick, slip, reversal, separation "
        "and\nimpact. The clock for the joint and the kind of event then ticks. Outputs have the values just before the event; "
        "after\nfmi3UpdateDiscreteStates, they have the values just after the event.</li>",
    },
}
"""Texts of the page that differ between FMI versions. picture: path relative to the page. ends: what the FMU returns when a run
cannot continue. events: HTML list items about the handling of events."""


def page(result: Result, listed: Sequence[tuple[str, Variable]], flavour: str, guid: str, standard: str) -> bytes:
    """The page documentation/index.html. listed: the variables with their displayed names."""
    scene = result.scene
    groups = {"outputs": "output", "locals": "local", "inputs": "input", "parameters": "parameter"}
    tables = {name: _table([(n, v) for n, v in listed if v.causality == c]) for name, c in groups.items()}
    notes = "".join(f"<li>{escape(n)}</li>" for n in result.notes)
    text = Template(PAGE.read_text(encoding="utf-8")).substitute(
        name=escape(scene.name), title=escape(scene.title or scene.name), guid=guid, flavour=flavour, notes=notes,
        standard=standard, **PAGES[standard],
        law=escape(", ".join(sorted({scene.law_of(f) for j in scene.joints.values() if (f := j.friction)})) or "none"),
        scene=escape(scene_to_yaml(scene)), **tables,
    )
    return text.encode()


def _table(rows: Iterable[tuple[str, Variable]]) -> str:
    """The variables as rows of an HTML table."""
    out = ""
    for name, v in rows:
        start = "" if v.start is None else f"{v.start:.9g}"
        low, high = (f"{x:g}" if abs(x) < HUGE else "" for x in (v.minimum, v.maximum))
        bounds = f"{low} … {high}" if low or high else ""
        cells = (name, v.unit, v.variability, start, bounds, v.description)
        out += "<tr>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>\n"
    return out or '<tr><td colspan="6">none</td></tr>\n'


def licences(flavour: str) -> dict[str, bytes]:
    """Licence texts by path in the archive."""
    out = {"documentation/licenses/license.txt": _licence("trunnion")}
    if flavour == "python":
        out["documentation/licenses/pythonfmu.txt"] = _licence("pythonfmu")
    return out


def _licence(name: str) -> bytes:
    """The licence of an installed distribution. In a source checkout, the licence of Trunnion is the file LICENSE at the root."""
    own = Path(__file__).resolve().parents[2] / "LICENSE"
    if name == "trunnion" and own.is_file():
        return own.read_bytes()
    try:
        files = distribution(name).files or []
    except PackageNotFoundError:
        files = []
    for file in files:
        if "LICENSE" in file.name.upper() and ".dist-info" in str(file):
            return Path(str(file.locate())).read_bytes()
    return f"{name}: see the distribution of that name\n".encode()
