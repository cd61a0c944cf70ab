"""Texts for the problems of a request. These texts replace the messages of pydantic, the library that validates requests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trunnion.basics.errors import Problem
from trunnion.scene.findings.name_suggestions import shown

KINDS = {
    "string": "a text", "int": "a whole number", "float": "a number", "bool": "true or false", "list": "a list", "tuple": "a list",
    "dict": "an object with fields", "model": "an object with fields", "dataclass": "an object with fields",
    "model_attributes": "an object with fields", "mapping": "an object with fields", "none_required": "null",
}  # fmt: skip
"""The kinds of values, by the beginning of pydantic's names of errors."""
BOUNDS = {"greater_than": ("gt", ">"), "greater_than_equal": ("ge", "≥"), "less_than": ("lt", "<"), "less_than_equal": ("le", "≤")}
"""{pydantic's name of an error: (key of the bound, sign)}."""
HIDDEN = "no control characters and no characters that change the direction of writing"


def problem_of(error: Mapping[str, Any]) -> Problem:
    """The problem that describes an error of pydantic."""
    what, hint = _words(error["type"], error.get("ctx") or {}, error.get("input"), str(error.get("msg", "")))
    return Problem(".".join(map(str, error["loc"]))[:300] or "body", what[:500], hint)


def _words(kind: str, about: Mapping[str, Any], given: Any, message: str) -> tuple[str, str]:
    """The cause and the remedy. about: bounds and lengths; given: the value; message: the message of a check of this program."""
    if kind == "missing":
        return "is not given", "add this field"
    if kind == "extra_forbidden":
        return "there is no such field", "remove the field, or correct its name"
    if kind == "value_error":
        return message.removeprefix("Value error, "), ""
    if kind == "string_pattern_mismatch":
        is_name = "\\w" in str(about.get("pattern", ""))
        return f"{shown(given)} has a character that is not allowed", "letters, digits and _.:/+@-" if is_name else HIDDEN
    if kind in BOUNDS:
        key, sign = BOUNDS[kind]
        return f"{shown(given)} is out of range", f"a number {sign} {about[key]}"
    if kind in ("too_long", "string_too_long", "too_short", "string_too_short"):
        things = "characters" if kind.startswith("string") else "entries"
        limit = f"at most {about['max_length']}" if kind.endswith("long") else f"at least {about['min_length']}"
        return f"has too {'many' if kind.endswith('long') else 'few'} {things}", f"{limit} {things}"
    if kind in ("literal_error", "enum"):
        return f"{shown(given)} is none of the choices", f"one of {about['expected']}"
    if kind == "finite_number":
        return f"{shown(given)} is not finite", "a finite number"
    wanted = next((words for name, words in KINDS.items() if kind.startswith(f"{name}_") or kind == name), "another kind of value")
    return f"{shown(given)} is not {wanted}", ""
