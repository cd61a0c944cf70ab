"""Plain data as JSON. Imports no web framework: workers use it."""

from __future__ import annotations

import json
from typing import Any

from trunnion.simulation.results.csv_and_parquet import finite


def text_of(data: Any) -> bytes:
    """ASCII JSON; null for numbers that JSON lacks."""
    return json.dumps(finite(data), ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()
