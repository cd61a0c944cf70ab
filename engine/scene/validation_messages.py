"""Conversion of pydantic's errors (unknown keys, wrong types, missing keys, units) to findings with scene paths."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

from trunnion.basics.errors import MOST
from trunnion.scene.data_classes.loads import APPLIED
from trunnion.scene.data_classes.signals import Drive, Signal
from trunnion.scene.data_classes.type_tree import classes_at, keys_at, length_at, required_at
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import Nearest, closest, did_you_mean, shown
from trunnion.scene.signals.registry import REGISTRY
from trunnion.scene.units.unit_parser import UnitError

Error = dict[str, Any]
UNKNOWN = "unexpected_keyword_argument"
_AFTER_COMMA = re.compile(r"\d+( .*)?", re.ASCII)
"""The text after the comma of a number such as "2,5 kg". Inside braces, YAML reads this text as a separate key."""


def findings_of(errors: Iterable[Error], data: Any) -> list[Finding]:
    """One finding for each different mistake, in pydantic's order. Only the first MOST unknown keys of a group get a search for
    the key that the user means, because no more problems are listed."""
    found, unknown = dict[Finding, None](), Counter[Path]()
    for e in errors:
        path = path_of(e["loc"], data)
        if e["type"] == UNKNOWN:
            unknown[path[:-1]] += 1
            found[_unknown_key(path, e, unknown[path[:-1]] <= MOST)] = None
        else:
            found[_RULES.get(e["type"], _other)(path, e)] = None
    return list(found)


def path_of(loc: tuple[str | int, ...], data: Any) -> Path:
    """The path of an error: pydantic's location without the tags of alternative types."""
    path: list[str | int] = []
    for key in loc:
        if isinstance(key, str) and key.startswith("·") and not (isinstance(data, dict) and key in data):
            continue
        path.append(key)
        inside = isinstance(data, dict) and key in data
        listed = isinstance(data, list | tuple) and isinstance(key, int) and 0 <= key < len(data)
        data = data[key] if inside or listed else None
    return tuple(path)


def _unknown_key(path: Path, e: Error, searched: bool) -> Finding:
    """The finding about an unknown key. searched: whether to search for the known key that the user means."""
    key, known = str(path[-1]), keys_at(path[:-1])
    if _AFTER_COMMA.fullmatch(key) and e["input"] is None:
        return Finding(path, f"unknown key {shown(key)}", "is this part of a number with a decimal comma? Write 2.5", meant="")
    if refusal := _refused_signal(path):
        return Finding(path, *refusal, meant="")
    hint = Nearest(key, known, "known keys")
    return Finding(path, f"unknown key {shown(key)}", hint, meant=closest(key, known) if searched else "")


def _refused_signal(path: Path) -> tuple[str, str] | None:
    """Reason and remedy for an unknown key that is a kind of signal, if a drive or a load does not allow this kind. None for any
    other unknown key."""
    classes, key = classes_at(path[:-1]), str(path[-1])
    if Drive in classes and key == "limit":
        return "a drive has no limits: its rate would jump", "write the limited motion as a move or table"
    if key not in REGISTRY or not {Drive, Signal} & set(classes):
        return None
    kind = REGISTRY[key]
    return kind.drives if Drive in classes else (f"a load has no {key}", kind.loads)


def _missing(path: Path, e: Error) -> Finding:
    if isinstance(path[-1], int):
        return _length(path[:-1], e)
    needed = ", ".join(required_at(path[:-1]))
    return Finding(path, f'the key "{path[-1]}" is missing', f"needed here: {needed}" if needed else "")


def _length(path: Path, e: Error) -> Finding:
    given, wanted = e["input"], length_at(path)
    count = len(given) if isinstance(given, list | tuple | dict) else 0
    return Finding(path, f"{wanted} entries are expected, not {count}")


def _group(path: Path, e: Error) -> Finding:
    known = keys_at(path)
    hint = f"known keys: {', '.join(known)}" if known else "entries look like NAME: {…}"
    return Finding(path, f"a group of keys is expected, not {shown(e['input'])}", hint)


def _list(path: Path, e: Error) -> Finding:
    n = length_at(path)
    kind = f"a list of {n}" if n else "a list"
    return Finding(path, f"{kind} is expected, not {shown(e['input'])}", "write it in brackets: [a, b, c]")


def _choice(path: Path, e: Error) -> Finding:
    known = re.findall(r"'([^']*)'", e["ctx"]["expected"]) or [e["ctx"]["expected"]]
    if path == ("schema",):
        return Finding(path, f"schema {shown(e['input'])} is not known", "this version reads schema: 1")
    return Finding(path, f"{shown(e['input'])} is not known here", did_you_mean(str(e["input"]), known))


def _text(path: Path, e: Error) -> Finding:
    hint = "put it in quotes" if isinstance(e["input"], int | float) else ""
    return Finding(path, f"text is expected, not {shown(e['input'])}", hint)


def _value(path: Path, e: Error) -> Finding:
    error = e["ctx"]["error"]
    return Finding(path, error.what, error.hint) if isinstance(error, UnitError) else Finding(path, str(error))


def _kind(path: Path, e: Error) -> Finding:
    given = e["input"]
    if not isinstance(given, dict):
        return _group(path, e)
    if "type" not in given:
        return Finding(path, 'the key "type" is missing', f"known: {', '.join(APPLIED)}")
    what = f"{shown(given['type'])} is not known here"
    return Finding((*path, "type"), what, did_you_mean(str(given["type"]), APPLIED))


def _other(path: Path, e: Error) -> Finding:
    return Finding(path, f"{shown(e['input'])} does not fit here")


_RULES: dict[str, Callable[[Path, Error], Finding]] = {
    "missing": _missing,
    "too_long": _length,
    "dataclass_type": _group,
    "dict_type": _group,
    "tuple_type": _list,
    "literal_error": _choice,
    "string_type": _text,
    "bool_type": lambda path, e: Finding(path, f"true or false is expected, not {shown(e['input'])}"),
    "value_error": _value,
    "wrong_form": lambda path, e: Finding(path, f"{e['msg']} is expected, not {shown(e['input'])}"),
    "unknown_kind": _kind,
}
