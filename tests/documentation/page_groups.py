"""Groups of pages that share an environment, and the run of a page from its first block to its last.

Pages are grouped by the packages that they install. The pages of a group share an environment. In the order of the pages, each page
only adds packages. After every page, the tests compare the environment with the typed installations. """

from __future__ import annotations

import os
import socket
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from tests.documentation.code_blocks import Step, steps
from tests.documentation.shell_session import PRINTED_PORT, Reader
from tests.documentation.virtual_environments import Home, copied

ROOT = Path(__file__).resolve().parents[2]
INSTALLED = "python3 -m venv .venv && . .venv/bin/activate && pip install -q ."
LAST = ("models/friction_identification/README.md", "models/cookbook/mechanism_designer.md")
"""Pages that install analysis and cad themselves, so that they must come last."""
ELSEWHERE = (*LAST, "models/cookbook/README.md")
GROUPS = {
    "plain": [
        *sorted({p.relative_to(ROOT).as_posix() for p in (ROOT / "models").glob("*/README.md")} - set(ELSEWHERE)),
        *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "models" / "designer").glob("*/README.md")),
        *LAST,
    ],
    "guide, plain": [
        f"engine/docs/guide/{page}.md"
        for page in ("installation", "first_run", "scene", "springs_and_loads", "friction", "pictures")
    ],
    "tables": [f"engine/docs/guide/{page}.md" for page in ("accuracy", "batches")],
    "analysis": ["engine/docs/guide/mechanical_analyses.md"],
    "pandas": ["models/cookbook/data_scientist.md"],
    "plain, fmu, service": ["README.md", "models/cookbook/system_engineer.md"],
    "service, pandas": ["service/README.md"],
    "fmu": ["engine/docs/guide/signals.md", "fmu/README.md"],
}
"""Pages by group. The group's name lists the packages that its pages install, in their order."""
ABOUT_MODELS = ("plain", "guide, plain", "pandas")
"""Groups that one process runs. A second process runs all other groups, because all pages with a server use the same port. The two
processes take about the same time. A process runs the pages of one file of tests (``--dist loadfile``)."""


def begins(page: str) -> list[Step]:
    """The steps of a page. The page of a model begins with the installation of the README, to which the list of models refers."""
    found = steps(ROOT / page)
    model = page.startswith("models/") and (ROOT / page).with_name("scene.yaml").exists()
    return [Step("bash", 0, INSTALLED), *found] if model and found else found


def cases(about_models: bool) -> list[object]:
    """(group, page) of the pages that one process runs."""
    mine = [(group, its) for group, its in GROUPS.items() if (group in ABOUT_MODELS) == about_models]
    return [pytest.param(group, page, id=page.removesuffix(".md")) for group, its in mine for page in its if steps(ROOT / page)]


def read_through(group: str, page: str, homes: dict[str, Home], folders: pytest.TempPathFactory) -> None:
    """Run all blocks of the page in the copy of the checkout that its group shares."""
    if group not in homes:
        shared = in_common(folders)
        alone(shared, group in ABOUT_MODELS)
        homes[group] = Home(copied(ROOT, folders.mktemp("page") / "checkout"), shared)
        drawings(homes[group].path)
    todo = begins(page)
    serves = any("trunnion serve" in s.text or PRINTED_PORT in s.text for s in todo)
    if serves:
        with socket.socket() as probe:
            assert probe.connect_ex(("127.0.0.1", int(PRINTED_PORT))) != 0, f"something else serves at the port {page} prints"
    with Reader(homes[group]) as reader:
        for step in todo:
            reader.does(step, page)
    surplus, lacking = homes[group].surplus()
    assert not surplus, f"the environment of {page} has what no line typed into it asks for: {sorted(surplus)}"
    assert not lacking, f"the environment of {page} lacks {sorted(lacking)}"


def alone(shared: Path, about_models: bool) -> None:
    """A lock that keeps other processes from running pages of this kind. Two servers would use one port, and clients would get
    answers of the wrong server."""
    reader = shared / f"{'models' if about_models else 'others'}.process"
    with suppress(FileExistsError), reader.open("x") as new:
        new.write(str(os.getpid()))
    assert reader.read_text() == str(os.getpid()), "two processes read pages of one file of tests; run with --dist loadfile"


def in_common(folders: pytest.TempPathFactory) -> Path:
    """A folder that all processes of a test session share. It holds the kernel cache of the pages, which is empty at first, and one
    copy of the packages that all pages install."""
    mine = folders.getbasetemp()
    shared = (mine.parent if "PYTEST_XDIST_WORKER" in os.environ else mine) / "pages"
    shared.mkdir(exist_ok=True)
    return shared


def drawings(home: Path) -> None:
    """Write the files that a page assumes to exist: the drawing of a designer and a robot."""
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
