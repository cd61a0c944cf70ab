"""Renamed words of scenes, commands and results. Each kind of word has a table {deprecated word: current word}.

Readers of scenes, paths, patterns, reductions, requests, stored jobs and result files translate words only with this module.
Deprecated words work for one more version. ``deprecation_notes`` collects one note for each deprecated word that was read; runs,
commands and requests report the notes."""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

EVENTS = {"stop": "stick", "turn": "contact_jump", "stop_on": "end_stop_engaged", "stop_off": "end_stop_released"}
"""Kinds of events."""
OUTCOMES = {
    "stopped": "cancelled",
    "apart": "overlap_lost",
    "gimbal": "gimbal_lock",
    "stalled": "no_progress",
    "unsettled": "not_converged",
}
"""Outcomes of runs."""
JOINT_KEYS = {"stops": "end_stops"}
"""Scene keys of a joint."""
SIMULATION_VALUES = {"jams": {"stop": "end"}}
"""Values of scene keys below ``simulation``: {key: {deprecated value: current value}}."""
SETTINGS = {"patience": "cpu_limit", "steps": "max_steps", "over": "vary"}
"""Settings of batches. These names are fields of requests and stored jobs, and names of server limits."""
OPTIONS = {
    "--over": "--vary", "--to": "--vary", "--patience": "--cpu-limit", "--steps": "--max-steps", "--outputs": "--columns",
    "--stops": "--end-stops", "--file": "--output", "--output-dir": "--output", "--peers": "--solvers",
    "--no-peers": "--no-solvers",
}  # fmt: skip
"""Options of commands."""

_DEVICE = re.compile(r"(?<=\.)stop(?=\.(?:effort|power|\*))")
"""The word ``stop`` in the name of a column ``JOINT.stop.effort[k]`` or ``JOINT.stop.power[k]``, or in a pattern for such names."""
_JOINT_KEY = re.compile(rf"(joints\.[^.\[\]]+\.)({'|'.join(JOINT_KEYS)})(?![^.\[])")
"""A renamed key in a dotted path."""

_collected: ContextVar[list[str] | None] = ContextVar("deprecation_notes", default=None)


@contextmanager
def deprecation_notes() -> Iterator[list[str]]:
    """Collect the notes about deprecated words that are read in the block, without repetitions. Outside this block, each note is a
    FutureWarning."""
    notes: list[str] = []
    token = _collected.set(notes)
    try:
        yield notes
    finally:
        _collected.reset(token)


def report(kind: str, word: str, instead: str) -> None:
    """Add a note that a deprecated word was read. kind: kind of the word ("event", "scene key", …). instead: current word."""
    add_note(f"{kind} {word} is deprecated: write {instead}")


def add_note(note: str) -> None:
    """Add a note about a deprecated word, for example a note that another process made."""
    notes = _collected.get()
    if notes is None:
        warnings.warn(note, FutureWarning, stacklevel=4)
    elif note not in notes:
        notes.append(note)


def current(kind: str, words: Mapping[str, str], word: str) -> str:
    """The current word for a word that a user wrote. A deprecated word is added to the notes."""
    if word not in words:
        return word
    report(kind, word, words[word])
    return words[word]


def current_path(path: str) -> str:
    """A dotted scene path in current words. Deprecated keys are added to the notes."""
    found = _JOINT_KEY.match(path)
    if found is None:
        return path
    return f"{found[1]}{current('scene key', JOINT_KEYS, found[2])}{path[found.end() :]}"


def current_paths(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Values by dotted path, with the paths in current words."""
    return {current_path(path): value for path, value in changes.items()}


def current_options(words: Sequence[str], known: Collection[str]) -> list[str]:
    """The arguments of a command, with deprecated options replaced and reported. known: the command's current options."""
    end = words.index("--") if "--" in words else len(words)
    names = {old: new for old, new in OPTIONS.items() if old not in known and new in known}
    pairs = [word.partition("=") for word in words[:end]]
    return [current("option", names, name) + sign + value for name, sign, value in pairs] + list(words[end:])


def current_column(name: str) -> str:
    """The current name of a column of a run, or the current form of a pattern. A deprecated name is not reported."""
    return _DEVICE.sub("end_stop", name)


def current_pattern(pattern: str, matches: bool) -> str:
    """A pattern of columns in current words. A change is reported. matches: whether the pattern matches a column as written. Such a
    pattern stays unchanged."""
    new = pattern if matches else current_column(pattern)
    if new != pattern:
        report("column", pattern, new)
    return new


def current_result(name: str) -> str:
    """The current name of a column in the table of a batch. A deprecated name is not reported."""
    path = _JOINT_KEY.sub(lambda found: found[1] + JOINT_KEYS[found[2]], name)
    return name if path.startswith(("first:", "count:")) else current_column(path)


def known_result(name: str, known: Collection[str]) -> str:
    """The name in ``known`` that a possibly deprecated name means, for a column in the table of a batch. An unknown name stays
    unchanged."""
    kind, _, what = name.partition(":")
    return next((n for n in (name, current_result(name), f"{kind}:{EVENTS.get(what, what)}") if n in known), name)
