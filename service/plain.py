"""Plain data as JSON, for the server and for its workers, which load nothing of the web."""

from __future__ import annotations

import json
from typing import Any

from engine.simulation.tables import finite


def text_of(data: Any) -> bytes:
    """JSON in plain ASCII, whatever strange characters a client sent; null where JSON has no number."""
    return json.dumps(finite(data), ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()
