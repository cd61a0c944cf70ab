"""A scene as a page with WebAssembly. The page needs no other files. It steps and draws the scene while the user changes
numbers."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import trunnion
from tests.fmu.sources.c_library_build import Loaded, columns
from tests.plots.webgl_browser import Opened, browsers
from trunnion.cli import main
from trunnion.fmu.c_library import wasm_page as made_web
from trunnion.fmu.c_library.library_files import library
from trunnion.fmu.c_library.wasm_page import wasm, web
from trunnion.plots.geometry.mechanism_geometry import scenery
from trunnion.plots.style.palette import BODIES

SCENE, STEPS, EVERY = "spherical_pendulum", 50, 0.02
SAME = 1e-12
"""Allowed difference relative to a column's size: both programs are compiled from the same C code; only sines and cosines come from
another library."""
IMPORTS = 2
"""Number of the section that lists a module's imports."""


def model_of(page: str) -> Any:
    """The data of the mechanism that a page receives."""
    found = re.search(r'<script id="model" type="application/json">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("scene", [SCENE, "crank_slider"])
def test_a_page_knows_poses_and_what_can_be_set_and_asks_for_nothing(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(made_web, "wasm", lambda made: b"\0asm")
    files = web(scene)
    page, model, made = files[f"{scene}.html"].decode(), model_of(files[f"{scene}.html"].decode()), library(scene)
    assert not re.search(r"https?:|src=|href=|import\(|fetch\(|@\w+@", page)
    names = [v.name for v in made.called.values()]
    for pose, body in zip(model["bodies"], made.first.scene.bodies, strict=True):
        assert names[pose["position"]] == f"{body}.position[1]"
        assert names[pose["orientation"]] == f"{body}.orientation[1]"
    assert all(-1 <= p["body"] < len(model["bodies"]) for p in model["parts"])
    view = np.reshape(model["view"], (3, 3))
    assert np.abs(view @ view.T - np.eye(3)).max() < 1e-12
    for c in model["controls"]:
        v = made.called[list(made.called)[c["index"]]]
        assert (v.name, v.minimum <= c["low"] <= c["value"] <= c["high"] <= v.maximum) == (c["name"], True)
    assert model["controls"][model["control"]]["name"].endswith("friction.mu")


def test_a_page_draws_bodies_whose_colours_are_names() -> None:
    drawn = scenery(trunnion.load_scene("gear_train"))
    assert any(not p.color.startswith("#") for p in drawn.parts)
    for part, shown in zip(drawn.parts, made_web._parts(drawn), strict=False):
        assert np.allclose(np.array(shown["color"]) / 255, to_rgb(part.color), rtol=0.0, atol=0.5 / 255)
    unknown = replace(drawn, parts=(replace(drawn.parts[0], color="no such colour"),))
    assert made_web._parts(unknown)[0]["color"] == list(bytes.fromhex(BODIES[0][1:]))


@pytest.mark.slow
def test_the_module_imports_nothing() -> None:
    module = wasm(library(SCENE, outputs=("*",)))
    at, sections = 8, []
    while at < len(module):
        kind, size, shift = module[at], 0, 0
        while True:
            at += 1
            size, shift = size | (module[at] & 0x7F) << shift, shift + 7
            if module[at] < 0x80:
                break
        sections.append(kind)
        at += 1 + size
    assert IMPORTS not in sections


@pytest.mark.slow
def test_the_page_computes_what_the_library_does_and_its_slider_changes_the_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "web", SCENE, "-o", str(tmp_path / "web"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [f"{SCENE}.html", f"{SCENE}.wasm"]
    native = Loaded(tmp_path / "native", library(SCENE, outputs=("*",), checked=True))
    count = len(columns(native.made))
    native.call("init"), native.call("start", 0.0)
    for _ in range(STEPS):
        native.call("step", EVERY)
    with browsers() as start:
        browser = start("--no-sandbox")
        tab = browser.new_context(offline=True).new_page()
        page = Opened(tab)
        tab.goto((tmp_path / "web" / f"{SCENE}.html").as_uri())
        page.until("m !== undefined && m.web_time() > 0.1")
        page.do("running = false; changed.clear(); m.web_init(); m.web_start(0)")
        page.do(f"for (let i = 0; i < {STEPS}; ++i) m.web_step({EVERY})")
        mine = np.array(page.ask(f"Array.from({{length: {count}}}, (_, k) => m.web_get(k))"))
        assert (np.abs(mine - native.row()) / np.maximum(1.0, np.abs(native.row()))).max() <= SAME
        page.do("const s = document.getElementById('slider'); s.value = s.max; s.oninput()")
        most = page.ask("chosen().high")
        assert page.ask("m.web_get(chosen().index)") == pytest.approx(most)
        page.do("document.getElementById('again').onclick(); running = false")
        page.do(f"for (let i = 0; i < {STEPS}; ++i) m.web_step({EVERY})")
        other = np.array(page.ask(f"Array.from({{length: {count}}}, (_, k) => m.web_get(k))"))
        assert np.abs(other - mine).max() > 0.01
        assert page.ask("document.getElementById('picture').getContext('2d').getImageData(0, 0, 4000, 4000).data.some((x) => x)")
        assert page.wrong == []
        browser.close()
