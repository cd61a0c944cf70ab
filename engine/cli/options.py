"""Words of the command line as values; every mistake is collected, so that all of them can be told at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from engine.basics.files import destination_problems
from engine.basics.problems import Problem, SceneError

if TYPE_CHECKING:
    from typer import Context

T = TypeVar("T")
ASK = "columns are chosen with --outputs"


@dataclass
class Findings:
    """Collects the mistakes found so far; ``end`` raises them all."""

    problems: list[Problem] = field(default_factory=list)

    def add(self, where: str, what: str, hint: str = "") -> None:
        """Note one more mistake: where it is, what it is, what to do."""
        self.problems.append(Problem(where, what, hint))

    def attempt(self, work: Callable[[], T], where: str = "") -> T | None:
        """What ``work`` returns; None when it raises SceneError, whose problems are kept (at ``where`` when that is given)."""
        try:
            return work()
        except SceneError as e:
            self.problems += [_under(where, p) if where else p for p in e.problems]
            return None

    def end(self) -> None:
        """SceneError with every problem found."""
        if self.problems:
            raise SceneError(self.problems)


def _under(where: str, p: Problem) -> Problem:
    """The problem as one of an option; the line that counts the others stays as it is."""
    if p.count != 1:
        return p
    return Problem(where, f"{p.where}: {p.what}" if where != p.where else p.what, p.hint)


def time(text: str | None, where: str, findings: Findings, zero: bool = False) -> float | None:
    """Seconds of "2.5", "10 ms", "1 min"; must be positive (``zero``: or zero)."""
    if text is None:
        return None
    value = quantity(text, "s", where, findings)
    if value is not None and (value < 0 or (value == 0 and not zero)):
        findings.add(where, f"{text} is not a positive time", "write a time such as 2.5, 10 ms or 1 min")
        return None
    return value


def quantity(text: str, unit: str, where: str, findings: Findings) -> float | None:
    """SI value of a number with or without a unit."""
    from engine.scene.quantities import Per
    from engine.scene.units import UnitError

    try:
        return float(Per(unit)(text))
    except UnitError as e:
        findings.add(where, e.what, e.hint)
        return None


def settings(who: str, texts: Mapping[str, Any], findings: Findings) -> dict[str, Any]:
    """SI values of the settings that a command offers; mistakes are noted."""
    from engine.simulation.settings import settings_read

    values, problems = settings_read(who, texts, lambda name: f"--{name}")
    findings.problems += problems
    return values


def choice(text: str | None, known: Sequence[str], where: str, findings: Findings) -> str | None:
    """The text when it is one of the known words; None for a mistake, which is noted."""
    if text is None or text in known:
        return text
    near = get_close_matches(text.lower(), known, 1)
    hint = f"did you mean {near[0]}?" if near else f"one of {', '.join(known)}"
    findings.add(where, f"{text!r} is unknown", hint)
    return None


def destination(text: str | None, suffixes: Sequence[str], where: str, findings: Findings) -> Path | None:
    """The path of a file to write; whatever would keep it from being written is noted."""
    if text is None:
        return None
    found = destination_problems(text, suffixes, where)
    findings.problems += [replace(p, hint=f"{p.hint}; {ASK}") for p in found] if names_columns(text) else found
    return Path(text)


def names_columns(text: str) -> bool:
    """Whether the name of a file looks like a pattern of columns: a slip of --output for --outputs."""
    return any(mark in text for mark in "[*?")


def assignments(texts: Sequence[str], findings: Findings) -> dict[str, Any]:
    """{path: value} of PATH=VALUE words."""
    from engine.scene.overrides import parse_assignment

    out: dict[str, Any] = {}
    for text in texts:
        parsed = findings.attempt(partial(parse_assignment, text), "--set")
        if parsed is None:
            continue
        if parsed[0] in out:
            findings.add("--set", f"{parsed[0]} is set twice", "keep one")
        out[parsed[0]] = parsed[1]
    return out


class Words(list[str]):
    """Words of the command line that were no option of the command; ``known``: the options it has, in their long form."""

    known: tuple[str, ...] = ()


def words_of(scene: str | None, context: Context) -> Words:
    """All words of the command line that are not known options, in their order."""
    out = Words([*([] if scene is None else [scene]), *context.args])
    shown = [p for p in context.command.params if not getattr(p, "hidden", False)]
    names = (o for p in shown for o in (*p.opts, *p.secondary_opts) if o.startswith("--"))
    out.known = (*names, "--help")
    return out


def one_scene(words: Sequence[str], findings: Findings) -> str | None:
    """The scene among the words that are no options; words that look like options are unknown ones."""
    known = words.known if isinstance(words, Words) else ()
    rest: list[str] = []
    skip = False
    for i, word in enumerate(words):
        if skip:
            skip = False
        elif word.startswith("-") and word != "-":
            name = word.split("=", 1)[0]
            near = get_close_matches(name, known, 1)
            findings.add(name, "there is no such option", f"did you mean {near[0]}?" if near else "see --help")
            others = [w for w in words[i + 1 :] if not w.startswith("-")]
            follows = i + 1 < len(words) and not words[i + 1].startswith("-")
            skip = "=" not in word and follows and (len(others) > 1 or bool(rest))
        else:
            rest.append(word)
    if not rest:
        findings.add("SCENE", "no scene is given", "a file, a folder with a scene.yaml, or a name that `trunnion models` lists")
    for extra in rest[1:]:
        findings.add("SCENE", f"{extra!r} is one word too many", "put values with blanks in quotes")
    return rest[0] if rest else None


def laws() -> tuple[str, ...]:
    """Friction laws the scene format knows."""
    from engine.friction import REGISTRY

    return tuple(REGISTRY)
