"""Export of a scene as a web page that simulates and draws the mechanism by WebAssembly. The page is one file and needs no server
or network."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.fmu.c_library.library_files import Library, filled, library, plain
from trunnion.fmu.variables.outputs_inputs_parameters import HUGE, Variable
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.plots.geometry.mechanism_geometry import Scenery, scenery
from trunnion.plots.geometry.motion_and_view import bounds, first_view, motion
from trunnion.plots.style.palette import JOINT, hex_color
from trunnion.scene.overrides import Given
from trunnion.simulation.results.result import Result

TARGET = ("-target", "wasm32-wasi", "-mexec-model=reactor")
FLAGS = ("-std=c99", "-O2", "-fno-sanitize=all", "-g0", "-s", "-w")
FUNCTIONS = ("init", "set", "get", "start", "step", "time", "why")
ALL = ("*",)
"""The page has all output columns, because drawing needs the poses of all bodies."""
DIGITS = 6
SETTINGS = "solver."


def web(scene: Given, overrides: Mapping[str, Any] | None = None, step: float = 0.0) -> dict[str, bytes]:
    """Two files: the page, which contains the WebAssembly module, and the module alone. The errors are the errors of
    ``library``."""
    made = library(scene, overrides, ALL, step)
    module = wasm(made)
    given = {"title": escape(made.first.scene.title or made.first.scene.name), "wasm": base64.b64encode(module).decode()}
    page = filled("wasm_page.html", given | {"model": json.dumps(_model(made)).replace("<", "\\u003c")})
    return {f"{made.name}.html": page.encode(), f"{made.name}.wasm": module}


def wasm(made: Library) -> bytes:
    """The WebAssembly module of a library, from the cache or compiled. The module exports ``web_init`` and the other ``FUNCTIONS``,
    simulates one mechanism and imports nothing."""
    files = {n: t for n, t in made.files.items() if n.endswith((".c", ".h")) and n != "main.c"}
    files["web.c"] = filled("wasm_exports.c", {"name": made.name, "scene": plain(made.first.scene.name)})
    exported = [f"-Wl,--export=web_{name}" for name in FUNCTIONS]
    key = library_cache.digest(
        *TARGET, *FLAGS, *exported, c_compiler.compiler_version(), *(x for pair in sorted(files.items()) for x in pair)
    )

    def make(folder: Path) -> None:
        for name, text in files.items():
            (folder / name).write_text(text)
        sources = [str(folder / n) for n in sorted(files) if n.endswith(".c")]
        c_compiler.run(
            [*TARGET, *FLAGS, *sources, "-lm", *exported, "-o", str(folder / "module.wasm")], library_cache.cache_folder()
        )

    return (library_cache.entry(f"wasm-{key}", make)[0] / "module.wasm").read_bytes()


def _model(made: Library) -> dict[str, Any]:
    """The data of a mechanism that the page reads: drawing, controls, curves."""
    variables = list(made.called.values())
    index = {v.name: i for i, v in enumerate(variables)}
    drawn = scenery(made.first.scene)
    controls = [_control(v, i) for i, v in enumerate(variables) if v.causality in ("input", "parameter") and _offered(v)]
    shown = [{"index": i, "name": v.name, "unit": _unit(v)} for i, v in enumerate(variables) if v.causality in ("output", "local")]
    live = [i for i, c in enumerate(controls) if c["live"]]
    told = [i for i in live if controls[i]["name"].endswith(".mu")]
    poses = [{w: index[f"{p.name}.{w}[1]"] for w in ("position", "orientation")} for p in drawn.parts]
    return {
        "bodies": poses, "parts": _parts(drawn), "view": _view(made, drawn), "controls": controls, "shown": shown,
        "curve": next((i for i, s in enumerate(shown) if s["name"] == _fastest(made.first)), 0),
        "control": ([i for i in live if controls[i]["input"]] or told or live or [0])[0],
    }  # fmt: skip


def _fastest(first: Result) -> str:
    """The index of the joint rate with the largest acceleration at the start. Among equal accelerations, the largest rate
    decides."""
    rates = [n for n in first.names if re.search(r"\.qd\[\d+\]$", n)]
    return max(rates, key=lambda n: (abs(float(first[n.replace(".qd[", ".qdd[")][0])), abs(float(first[n][0]))), default="")


def _unit(v: Variable) -> str:
    return "" if v.unit == "1" else v.unit


def _offered(v: Variable) -> bool:
    return not v.name.startswith(SETTINGS) and v.type == ""


def _control(v: Variable, index: int) -> dict[str, Any]:
    """A slider with its range. live: whether a changed value takes effect during the run, without a new start."""
    value = float(v.start or 0.0)
    low, high = sorted((0.0, 2.0 * value)) if value else (-1.0, 1.0)
    least, most = v.minimum, v.maximum
    given = {"low": max(low, least) if least > -HUGE else low, "high": min(high, most) if most < HUGE else high}
    live = v.causality == "input" or v.variability == "tunable"
    return given | {"index": index, "name": v.name, "unit": _unit(v), "value": value, "live": live, "input": v.causality == "input"}


def _parts(drawn: Scenery) -> list[dict[str, Any]]:
    """The meshes of bodies and of joint pins, each in the coordinates of its body."""
    meshes = [(i, p.mesh, p.color) for i, p in enumerate(drawn.parts)]
    meshes += [(on, mesh, JOINT) for j in drawn.joints for on, mesh in j.pins]
    return [
        {"body": on, "color": [*bytes.fromhex(hex_color(color)[1:])], "vertices": np.round(mesh.vertices, DIGITS).tolist(),
         "faces": [list(f) for f in mesh.faces]}
        for on, mesh, color in meshes
    ]  # fmt: skip


def _view(made: Library, drawn: Scenery) -> list[float]:
    """The view matrix, row by row. The rows are the directions right, up, and towards the viewer."""
    moved = motion(made.first, [p.name for p in drawn.parts])
    return [float(x) for x in first_view(drawn.up, *bounds(drawn, moved)).ravel()]
