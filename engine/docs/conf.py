"""Configuration of the documentation site (Sphinx with MyST): the repository's pages with navigation and search, built offline.

Build from the repository's root: ``python -m sphinx -W -q -c engine/docs . out/site``; open ``out/site/index.html``.
"""

from __future__ import annotations

from pathlib import Path

from sphinx.application import Sphinx

project = "Trunnion"
author = "The Trunnion authors"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "README"
include_patterns = ["*.md", "engine/**.md", "fmu/*.md", "service/*.md", "models/**.md", "tests/benchmarks/**.md"]
exclude_patterns = ["out", "**/.venv*", ".venv*", "**/.pytest_cache"]
suppress_warnings = ["myst.xref_missing"]  # links to folders and source files: the site shows pages only

myst_heading_anchors = 4

html_theme = "furo"
html_title = "Trunnion"
html_copy_source = False
html_show_sphinx = False

NAVIGATION = {
    "Guide": ["engine/docs/guide/*", "models/cookbook/README", "models/cookbook/*"],
    "Reference": ["engine/docs/reference/README", "engine/docs/reference/*"],
    "Theory": ["engine/docs/theory/README", "engine/docs/theory/*"],
    "FMUs and the service": ["fmu/README", "service/README", "service/*"],
    "Models": ["models/README", "models/**"],
    "Development": ["CONTRIBUTING", "CHANGELOG", "engine/README", "engine/**", "tests/benchmarks/**"],
}
"""{caption of a part of the navigation: its pages, in order}. A page that matches several patterns appears at its first match."""
FIRST_PAGE = '<!doctype html><meta http-equiv="refresh" content="0; url=README.html"><title>Trunnion</title>\n'


def add_navigation(app: Sphinx, page: str, text: list[str]) -> None:
    """Append the table of contents to the first page's text. The README does not contain it, because repository viewers would show
    it as code."""
    if page == root_doc:
        for caption, pages in NAVIGATION.items():
            entries = "\n".join(f"/{p}" for p in pages)
            text[0] += f"\n```{{toctree}}\n:hidden:\n:glob:\n:caption: {caption}\n\n{entries}\n```\n"


def write_first_page(app: Sphinx, error: Exception | None) -> None:
    """Write ``index.html``, which redirects to the README's page."""
    if error is None and app.builder.format == "html":
        Path(app.outdir, "index.html").write_text(FIRST_PAGE, encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Register ``add_navigation`` and ``write_first_page`` with Sphinx."""
    app.connect("source-read", add_navigation)
    app.connect("build-finished", write_first_page)
