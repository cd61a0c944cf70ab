"""Generated pages are current, and all pages build into a site."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.documentation.reference_generators.result_pages import DETAILS
from tests.documentation.reference_pages import PAGES, outdated
from trunnion.simulation.results import event_decoder, outcome

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "engine" / "docs" / "reference"
LARGEST_PAGE = 40 * 1024
"""Largest page in bytes; readers do not scroll through longer pages."""


def test_generated_pages_are_current() -> None:
    assert outdated() == [], "run python -m tests.documentation.reference_pages"
    assert len(PAGES) >= 2


def test_the_reference_lists_the_events_that_the_runtime_reports() -> None:
    """The rows of the page of events are exactly the kinds of events that the C code logs."""
    code = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "engine" / "runtime").rglob("*.c"))
    told = {name.lower() for name in re.findall(r"\bTR_EV_(\w+)", code)}
    assert rows_of("events") == told
    assert told <= set(event_decoder.KINDS.values())


def test_the_reference_lists_the_outcomes_of_runs() -> None:
    assert rows_of("outcomes") == {outcome.DONE, *outcome.ADVICE}
    assert set(DETAILS) <= set(outcome.ADVICE)


def rows_of(page: str) -> set[str]:
    """Names in the first column of the table on a page of the reference."""
    text = (REFERENCE / f"{page}.md").read_text(encoding="utf-8")
    return {name for row in re.findall(r"^\| (`.*?) \|", text, re.MULTILINE) for name in re.findall(r"`(\w+)`", row)}


def test_no_page_is_longer_than_a_reader_scrolls() -> None:
    pages = [p for top in ("engine", "fmu", "service", "models", "tests") for p in (ROOT / top).rglob("*.md")]
    pages += list(ROOT.glob("*.md"))
    assert len(pages) > 50
    assert {p.relative_to(ROOT).as_posix(): p.stat().st_size for p in pages if p.stat().st_size > LARGEST_PAGE} == {}


@pytest.mark.slow
def test_all_pages_build_into_a_site_with_search(tmp_path: Path) -> None:
    if find_spec("sphinx") is None:
        pytest.skip("the site needs the extra docs")
    build = [
        sys.executable,
        "-m",
        "sphinx",
        "-W",
        "--keep-going",
        "-q",
        "-c",
        "engine/docs",
        "-d",
        str(tmp_path / "tree"),
        ".",
        str(tmp_path / "site"),
    ]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for page in ("index.html", "README.html", "search.html", "searchindex.js", "engine/docs/guide/first_run.html"):
        assert (tmp_path / "site" / page).stat().st_size > 50
