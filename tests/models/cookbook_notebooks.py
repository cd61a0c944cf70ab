"""Writes each page of the cookbook as a Jupyter notebook: ``python -m tests.models.cookbook_notebooks FOLDER``.

The page is the only source. Its Python blocks become cells, and each command of its shell blocks becomes a line ``!command``.
Blocks that install stay text, because a notebook already runs in the environment where Trunnion is installed."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from trunnion.scene.library.model_folders import models_dir

FOLDER = models_dir() / "cookbook"
PAGES = sorted(p for p in FOLDER.glob("*.md") if p.name != "README.md")
BLOCK = re.compile(r"^```(python|bash)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)


def notebook(page: Path) -> dict[str, Any]:
    """The notebook of a page, in nbformat 4.5."""
    text, end, cells = page.read_text(encoding="utf-8"), 0, []
    for m in BLOCK.finditer(text):
        if m[1] == "bash" and "pip install" in m[2]:
            continue
        source = m[2] if m[1] == "python" else "".join(f"!{line}\n" for line in m[2].splitlines())
        cells += [_cell("markdown", text[end : m.start()]), _cell("code", source) | {"execution_count": None, "outputs": []}]
        end = m.end()
    cells.append(_cell("markdown", text[end:]))
    kept = [c | {"id": f"cell-{i}"} for i, c in enumerate(cells) if c["source"]]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {"nbformat": 4, "nbformat_minor": 5, "metadata": {"kernelspec": kernel}, "cells": kept}


def _cell(kind: str, text: str) -> dict[str, Any]:
    return {"cell_type": kind, "metadata": {}, "source": text.strip()}


def main() -> None:
    """Write the notebooks of all pages in a folder."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for page in PAGES:
        (folder / f"{page.stem}.ipynb").write_text(json.dumps(notebook(page), indent=1, ensure_ascii=False), encoding="utf-8")


if __name__ == "__main__":
    main()
