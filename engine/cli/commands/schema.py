"""``trunnion schema``."""

from __future__ import annotations

from trunnion.cli.output.exit_codes_and_errors import DONE, print_json


def command() -> int:
    """Print the JSON Schema for scene files."""
    from trunnion.scene.file_format.json_schema import json_schema

    print_json(json_schema())
    return DONE
