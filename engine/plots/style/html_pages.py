"""Self-contained HTML pages. One file contains the filled template, the style sheet, the scripts and the data."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from trunnion.basics.json_values import finite


def make_html_page(template: Path, style: str, scripts: Sequence[str], title: str, data: Any) -> str:
    """The template with its marks ``{{title}}``, ``{{style}}``, ``{{data}}``, ``{{script}}`` filled.

    style, scripts: names of files in the template's folder. data: plain data, written as JSON; NaN and infinity become null.
    """
    folder = template.parent
    texts = {
        "title": html.escape(title),
        "style": (folder / style).read_text(encoding="utf-8"),
        "data": json.dumps(finite(data), separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"),
        "script": "\n".join((folder / name).read_text(encoding="utf-8") for name in scripts),
    }
    first, *rest = template.read_text(encoding="utf-8").split("{{")
    return first + "".join(texts[name] + after for name, _, after in (piece.partition("}}") for piece in rest))
