"""Values of arguments and options. A reader collects all mistakes, so that a command reports all mistakes at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from trunnion.basics.atomic_files import destination_problems
from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import suggestion

if TYPE_CHECKING:
    from typer import Context

    from trunnion.scene.data_classes.scene import Scene

T = TypeVar("T")
TABLES, PICTURES, SCENES = (".csv", ".parquet"), (".png", ".svg", ".pdf"), (".yaml", ".yml")
"""Suffixes of files that commands write."""
COLUMNS_HINT = "columns are chosen with --outputs"


@dataclass
class ArgumentReader:
    """Reads values. After a mistake, a method returns None and adds the mistake to ``problems``."""

    problems: list[Problem] = field(default_factory=list)

    def add(self, where: str, what: str, hint: str = "") -> None:
        """Add a mistake with its place (where), its cause (what) and its remedy (hint)."""
        self.problems.append(Problem(where, what, hint))

    def attempt(self, work: Callable[[], T], where: str = "") -> T | None:
        """The result of ``work``. If ``work`` raises SceneError, the problems are added (at ``where`` if given), and the result is
        None."""
        try:
            return work()
        except SceneError as e:
            self.problems += [problem_at(where, p) if where else p for p in e.problems]
            return None

    def end(self) -> None:
        """Raise SceneError with all mistakes, if there are any."""
        raise_problems(self.problems)

    def checked(self, value: T | None) -> T:
        """The value, which is None only after a mistake. SceneError with all mistakes, if there are mistakes."""
        self.end()
        assert value is not None
        return value

    def time(self, text: str | None, where: str, zero: bool = False) -> float | None:
        """Seconds of a text such as "2.5", "10 ms" or "1 min"; None if there is no text. The time must be positive. With ``zero``,
        the time 0 is valid, too."""
        value = None if text is None else self.quantity(text, "s", where)
        if value is not None and (value < 0 or (value == 0 and not zero)):
            self.add(where, f"{text} is not a positive time", "write a time such as 2.5, 10 ms or 1 min")
            return None
        return value

    def quantity(self, text: str, unit: str, where: str) -> float | None:
        """The SI value of a number with or without a unit."""
        from trunnion.scene.units.numbers_with_units import Per
        from trunnion.scene.units.unit_parser import UnitError

        try:
            return float(Per(unit)(text))
        except UnitError as e:
            self.add(where, e.what, e.hint)
            return None

    def choice(self, text: str | None, words: Sequence[str], where: str) -> str | None:
        """The text, which must be one of the words. None without text, or after a mistake."""
        if text is None or text in words:
            return text
        self.add(where, f"{text!r} is unknown", suggestion(text.lower(), words, f"one of {', '.join(words)}"))
        return None

    def destination(self, text: str | None, suffixes: Sequence[str], where: str = "-o") -> Path | None:
        """The path of a file to write. None without text. A wrong suffix or an unwritable folder becomes a problem."""
        if text is None:
            return None
        problems = destination_problems(text, suffixes, where)
        self.problems += [replace(p, hint=f"{p.hint}; {COLUMNS_HINT}") for p in problems] if is_pattern(text) else problems
        return Path(text)

    def picture(self, text: str | None) -> Path | None:
        """The path of the picture that ``--plot`` names."""
        return self.destination(text, PICTURES, "--plot")

    def assignments(self, texts: Sequence[str]) -> dict[str, Any]:
        """{path: value} of the valid PATH=VALUE words of ``--set``."""
        out: dict[str, Any] = {}
        for text in texts:
            from trunnion.scene.overrides import parse_assignment

            parsed = self.attempt(partial(parse_assignment, text), "--set")
            if parsed is None:
                continue
            if parsed[0] in out:
                self.add("--set", f"{parsed[0]} is set twice", "keep one")
            out[parsed[0]] = parsed[1]
        return out

    def named_values(self, texts: Sequence[str], where: str, form: str, example: str) -> dict[str, str]:
        """{name: value} of the valid NAME=VALUE words. A word is split at the first "=". form: the notation that an error
        names."""
        out: dict[str, str] = {}
        for text in texts:
            name, sign, value = (part.strip() for part in text.partition("="))
            if not sign or not name or not value:
                self.add(where, f"{text!r} is not {form}", f"for example {example}")
            elif name in out:
                self.add(where, f"{name} is given twice", "keep one")
            else:
                out[name] = value
        return out

    def scene(
        self, word: str | None, context: Context, changes: Sequence[str], law: str | None = None, massless: bool = False
    ) -> Scene | None:
        """The scene that the command line names, changed by ``--set`` and ``--law``. massless: whether bodies may lack masses."""
        from trunnion.cli.options.checked_scene_cache import stored_scene

        source, values = self.scene_word(word, context), self.assignments(changes)
        scene = self.attempt(partial(stored_scene, source, massless)) if source is not None else None
        if scene is None or (law is None and not values):
            return scene
        from trunnion.scene.overrides import apply, law_changes

        if law is not None:
            scene = self.attempt(partial(apply, scene, law_changes(scene, law)), "--law") or scene
        return self.attempt(partial(apply, scene, values), "--set") or scene

    def scene_word(self, first: str | None, context: Context) -> str | None:
        """The scene among the words that click does not recognise. An unknown option, several scenes or no scene is a mistake."""
        words = [*([] if first is None else [first]), *context.args]
        rest: list[str] = []
        skip = False
        for i, word in enumerate(words):
            if skip:
                skip = False
            elif word.startswith("-") and word != "-":
                name = word.split("=", 1)[0]
                self.add(name, "there is no such option", suggestion(name, long_options(context.command), "see --help"))
                others = [w for w in words[i + 1 :] if not w.startswith("-")]
                follows = i + 1 < len(words) and not words[i + 1].startswith("-")
                skip = "=" not in word and follows and (len(others) > 1 or bool(rest))
            else:
                rest.append(word)
        if not rest:
            self.add("SCENE", "no scene is given", "a file, a folder with a scene.yaml, or a name that `trunnion models` lists")
        for extra in rest[1:]:
            self.add("SCENE", f"{extra!r} is an extra word", "put values with blanks in quotes")
        return rest[0] if rest else None

    def check_columns(self, scene: Scene | None, patterns: Sequence[str]) -> None:
        """Add a problem for each pattern of ``--outputs`` that matches no column of the scene."""
        from trunnion.kernel.interface.output_columns import columns
        from trunnion.simulation.run import pattern_problems
        from trunnion.system.construction.system_builder import build

        if scene is not None and patterns:
            named = tuple(p for p in patterns if p != "time")
            self.problems += pattern_problems(columns(build(scene).system), named, "--outputs")


def problem_at(where: str, p: Problem) -> Problem:
    """The problem, with an option as its place. A problem that stands for several others is returned unchanged."""
    if p.count != 1:
        return p
    return Problem(where, f"{p.where}: {p.what}" if where != p.where else p.what, p.hint)


def is_pattern(text: str) -> bool:
    """Whether a file name looks like a pattern of columns. The user then probably wrote --output instead of --outputs."""
    return any(mark in text for mark in "[*?")


def long_options(command: Any) -> list[str]:
    """The long options that the help of a command shows."""
    shown = [p for p in command.params if not getattr(p, "hidden", False)]
    return [o for p in shown for o in (*p.opts, *p.secondary_opts, "--help") if o.startswith("--")]
