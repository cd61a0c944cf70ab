"""JSON of plain data. This module imports no web framework, because workers use it."""

from __future__ import annotations

import json
from typing import Any

from trunnion.basics.json_values import finite


def text_of(data: Any) -> bytes:
    """The data as JSON in ASCII. Non-finite numbers become null."""
    try:
        return _encoded(data)
    except (TypeError, ValueError):  # NumPy numbers, or non-finite numbers
        return _encoded(finite(data))


def _encoded(data: Any) -> bytes:
    return json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()
