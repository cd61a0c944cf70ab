"""The committed chart pages share one viewer: each folder of ``models/charts`` holds a short page and its data.

python -m tests.benchmarks.chart_pages      after `trunnion chart … -o models/charts/NAME`, whose page holds viewer and data
"""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CHARTS = ROOT / "models" / "charts"
VIEWER = ROOT / "engine" / "analysis" / "work_precision" / "viewer"
INLINE_DATA = re.compile(r"<script>(const study = .*;)</script>")
POLICY = {"'unsafe-inline'": "'self' file: 'unsafe-inline'"}
"""The short page may load files from its own folder, from a server or from disk."""


def short_page(title: str) -> str:
    """The page of a folder: the viewer's template, with links to ``data.js`` and to the viewer's files. title: as HTML."""
    beside = os.path.relpath(VIEWER, CHARTS / "any").replace(os.sep, "/")
    text = (VIEWER / "chart.html").read_text(encoding="utf-8")
    for old, new in {
        **POLICY,
        "{{title}}": title,
        "<style>\n{{style}}\n</style>": f'<link rel="stylesheet" href="{beside}/chart.css">',
        "<script>const study = {{data}};</script>": '<script src="data.js"></script>',
        "<script>\n{{script}}\n</script>": f'<script src="{beside}/chart.js"></script>',
    }.items():
        assert old in text
        text = text.replace(old, new)
    return text


def share_viewer(folder: Path) -> None:
    """Move the data of the folder's page to ``data.js``, one curve a line, and shorten the page."""
    page = folder / "chart.html"
    text = page.read_text(encoding="utf-8")
    if found := INLINE_DATA.search(text):
        (folder / "data.js").write_text(found[1].replace('{"label"', '\n{"label"') + "\n", encoding="utf-8")
    page.write_text(short_page(text.partition("<title>")[2].partition("</title>")[0]), encoding="utf-8")


if __name__ == "__main__":
    for chart in sorted(CHARTS.glob("*/chart.html")):
        share_viewer(chart.parent)
        print(chart.parent.name)
