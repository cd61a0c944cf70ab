"""Every block of every page runs as printed, in an environment with exactly what the page installs.

Run with ``python -m pytest -m pages -n 2 --dist loadgroup``. Pages are grouped by what they install: the pages of a group share an
environment, in an order in which it only grows by what the next page asks for itself.
"""

from __future__ import annotations

import shutil
import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.pages.reader import PRINTED_PORT, Reader, copied
from tests.pages.reading import Step, pages, steps

ROOT = Path(__file__).resolve().parents[2]
INSTALLED = "python3 -m venv .venv && . .venv/bin/activate && pip install -q ."
GROUPS = {
    "plain, fmu, service": [
        *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "models").glob("*/README.md") if p.parent.name != "cookbook"),
        "README.md",
        "models/cookbook/system.md",
    ],
    "pandas, service": ["engine/README.md", "models/cookbook/data.md", "service/README.md"],
    "fmu": ["fmu/README.md"],
    "cad": ["models/cookbook/designer.md"],
}
"""By the extras their environment ends with."""


def test_every_page_with_something_to_run_is_run() -> None:
    found = {p.relative_to(ROOT).as_posix() for p in pages(ROOT)}
    assert found == {page for group in GROUPS.values() for page in group if steps(ROOT / page)}


def begins(page: str) -> list[Step]:
    """A page's steps; a model's page is read with the installation of the README, to which the list of models sends its readers."""
    found = steps(ROOT / page)
    model = page.startswith("models/") and (ROOT / page).with_name("scene.yaml").exists()
    return [Step("bash", 0, INSTALLED), *found] if model and found else found


def test_every_page_begins_with_what_it_installs() -> None:
    """A page that names a command without saying where it comes from leaves its reader to guess."""
    for page in (page for group in GROUPS.values() for page in group if steps(ROOT / page)):
        first = begins(page)[0].text
        assert "pip install" in first, f"{page} begins with {first.splitlines()[0]!r}"
    assert "[README](../README.md)" in (ROOT / "models" / "README.md").read_text(encoding="utf-8")


def by_group() -> list[object]:
    """(group, page), marked so that the pages of a group run in order, in one process, as do all groups that serve at one port."""
    return [
        pytest.param(
            group,
            page,
            id=page.removesuffix(".md"),
            marks=[pytest.mark.xdist_group("port" if "service" in group else "no port"), pytest.mark.pages],
        )
        for group, its in GROUPS.items()
        for page in its
        if steps(ROOT / page)
    ]


@pytest.fixture(scope="module")
def homes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Path]]:
    """A copy of the checkout for every group, with an environment of its own; gone afterwards."""
    made: dict[str, Path] = {}
    yield made
    for home in made.values():
        shutil.rmtree(home, ignore_errors=True)


@pytest.mark.parametrize(("group", "page"), by_group())
def test_the_page_runs_as_printed(group: str, page: str, homes: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> None:
    if group not in homes:
        homes[group] = copied(ROOT, tmp_path_factory.mktemp("page") / "checkout")
        drawings(homes[group])
    todo = begins(page)
    serves = any("trunnion serve" in s.text or PRINTED_PORT in s.text for s in todo)
    if serves:
        with socket.socket() as probe:
            assert probe.connect_ex(("127.0.0.1", int(PRINTED_PORT))) != 0, f"something else serves at the port {page} prints"
    with Reader(homes[group]) as reader:
        for step in todo:
            reader.does(step, page)


def drawings(home: Path) -> None:
    """Files a page takes to be there: a designer's drawing and a robot."""
    corners = np.array([[0, 0, 0], [40, 0, 0], [0, 20, 0], [0, 0, 10]])
    faces = ["0 2 1", "0 1 3", "0 3 2", "1 2 3"]
    facets = [[corners[int(i)] for i in f.split()] for f in faces]
    lines = ["solid part"]
    for facet in facets:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in facet), "endloop", "endfacet"]
    (home / "part.stl").write_text("\n".join([*lines, "endsolid part", ""]))
    link = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>'
    (home / "robot.urdf").write_text(f'<robot name="r"><link name="a"/><link name="b">{link}</link>{joint}</robot>')
