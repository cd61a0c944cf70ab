"""Write the generated pages of the reference and the JSON Schema: ``python -m tests.documentation.reference_pages``. With
``--check`` the command lists the files that are out of date."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.documentation.reference_generators import (
    command_line_page,
    import_items_page,
    python_api_page,
    result_pages,
    scene_keys_pages,
)
from trunnion.scene.file_format.json_schema import json_schema

REFERENCE = Path(__file__).resolve().parents[2] / "engine/docs/reference"
SCENE_KEYS = ("scene_keys", "scene_keys_bodies_joints", "scene_keys_loads_signals", "scene_keys_assemblies")
PAGES: dict[str, Callable[[], str]] = {
    "../../cli/help.txt": command_line_page.help_text,
    "columns.md": result_pages.columns_text,
    "command_line.md": command_line_page.page_text,
    "events.md": result_pages.events_text,
    "import_items.md": import_items_page.page_text,
    "notation.md": partial(result_pages.notation_text, REFERENCE / "notation.md"),
    "outcomes.md": result_pages.outcomes_text,
    "python_api.md": python_api_page.page_text,
    **{f"{page}.md": partial(scene_keys_pages.page_text, page) for page in SCENE_KEYS},
    "scene.schema.json": lambda: json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n",
}
"""File of the reference → the function that returns its text."""


def outdated() -> list[str]:
    """Pages whose text differs from the text that their function returns."""
    files = {p: REFERENCE / p for p in PAGES}
    return [p for p, file in files.items() if not file.is_file() or file.read_text(encoding="utf-8") != PAGES[p]()]


def main(words: list[str]) -> int:
    """Write the pages, or with ``--check`` print the names of outdated files. The exit code is 1 if any file is out of date."""
    old = outdated()
    if "--check" in words:
        print("\n".join(old))
        return int(bool(old))
    for page in old:
        (REFERENCE / page).write_text(PAGES[page](), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
