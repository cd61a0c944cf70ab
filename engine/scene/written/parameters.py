"""Parameters and expressions of a scene: from plain data with texts such as "{a/2 + 5 mm}" to the same data with numbers that
remember their expression."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from engine.scene.finding import Finding, Path
from engine.scene.quantities import Computed, Quantity, Worthless, number
from engine.scene.reading import DEEPEST
from engine.scene.suggest import did_you_mean, shown
from engine.scene.typed import keys_at, shape, unit_at
from engine.scene.units import NONE, Dimension, UnitError
from engine.scene.written.formula import RESERVED, WHATEVER, Formula, formula
from engine.scene.written.values import dimension, value

NAMED = "parameters"
MEND_FIRST = "mend it first"
"""The hint of what is wrong only because a parameter is."""
NOT_FORMED = "a letter, then letters, digits and _"


def is_expression(given: Any) -> bool:
    """Whether a value is written as an expression: text in braces."""
    return isinstance(given, str) and given[:1] == "{" and given.strip()[-1:] == "}"


def inside(text: str) -> str:
    """The text between the braces."""
    return text.strip()[1:-1]


@dataclass
class Known:
    """The parameters of a scene. value, dimension: by name; wrong: those that have no value, and why."""

    value: dict[str, float] = field(default_factory=dict)
    dimension: dict[str, Dimension] = field(default_factory=dict)
    wrong: dict[str, Worthless] = field(default_factory=dict)

    def computed(self, text: str) -> Computed | Worthless:
        """The value of an expression, with its braces."""
        try:
            return self._computed(text, formula(inside(text)))
        except UnitError as e:
            return Worthless(text, e.what, e.hint)

    def _computed(self, text: str, f: Formula) -> Computed | Worthless:
        for name in sorted(f.names):
            if name in self.wrong:
                return Worthless(text, f"the parameter {name} has no value", MEND_FIRST)
            if name not in self.value:
                hint = did_you_mean(name, self.value, "parameters") or f"add parameters: {{{name}: …}}"
                return Worthless(text, f"there is no parameter {shown(name)}", hint)
        measured = dimension(f.root, self.dimension)
        plain = f.plain or measured == WHATEVER
        return Computed(value(f.root, self.value), NONE if plain else measured, text, f.names, plain)

    def keep(self, name: str, given: float | Worthless) -> None:
        """Take the value of a parameter."""
        if isinstance(given, Worthless):
            self.wrong[name] = given
        else:
            self.value[name] = float(given)
            self.dimension[name] = given.dimension if isinstance(given, Quantity) else NONE


def evaluated(data: Any) -> tuple[Any, list[Finding]]:
    """The data with the value in place of every expression, and mistakes in the names of parameters. An expression that has no
    value stays as a mark, which the reader of numbers turns into a mistake at its place."""
    if not isinstance(data, dict):
        return data, []
    given = data.get(NAMED)
    parameters = given if isinstance(given, dict) else {}
    findings = list(_names(parameters))
    known = parameters_of(parameters)
    out = {k: _replaced(v, (k,), known) for k, v in data.items() if k != NAMED}
    if NAMED in data:
        out[NAMED] = {n: _kept(known, n, v) for n, v in parameters.items()} if isinstance(given, dict) else given
    return out, findings


def _kept(known: Known, name: str, given: Any) -> Any:
    if name in known.wrong and is_expression(given):
        return known.wrong[name]
    return known.computed(given) if is_expression(given) else given


def _names(parameters: Mapping[str, Any]) -> Iterable[Finding]:
    for name in parameters:
        if name in RESERVED:
            what = f'the name "{name}" is taken by a unit or function'
            yield Finding((NAMED, name), what, "an expression must have one meaning: use a longer name")
        elif not name.isidentifier() or not name.isascii() or name.startswith("_"):
            yield Finding((NAMED, name), f"{shown(name)} cannot be the name of a parameter", NOT_FORMED)


def parameters_of(given: Mapping[str, Any]) -> Known:
    """The parameters' values. Those that are expressions of others come after them; circles are mistakes."""
    known, texts = Known(), {n: v for n, v in given.items() if is_expression(v)}
    for name, v in given.items():
        if name not in texts:
            try:
                known.keep(name, number(v))
            except UnitError as e:
                known.keep(name, Worthless(shown(v), e.what, e.hint))
    for name in in_order(texts, lambda n: _needed(texts[n])):
        known.keep(name, known.computed(texts[name]))
    left = {n for n in texts if n not in known.value and n not in known.wrong}
    for name in left:
        circle = _circle(name, {n: sorted(_needed(texts[n]) & left)[0] for n in left})
        known.wrong[name] = Worthless(texts[name], f"it depends on itself: {circle}", "give one of them a number")
    return known


def _needed(text: str) -> frozenset[str]:
    try:
        return formula(inside(text)).names
    except UnitError:
        return frozenset()


def in_order(names: Iterable[str], needs: Callable[[str], Iterable[str]]) -> list[str]:
    """The names, each after those it needs; those in or behind a circle are left out."""
    open_ = {n: set(needs(n)) for n in names}
    for n in open_:
        open_[n] &= open_.keys()
    users: dict[str, list[str]] = {}
    for n, wanted in open_.items():
        for w in wanted:
            users.setdefault(w, []).append(n)
    ready, out = [n for n, wanted in open_.items() if not wanted], []
    while ready:
        done = ready.pop()
        out.append(done)
        for n in users.get(done, ()):
            open_[n].discard(done)
            if not open_[n]:
                ready.append(n)
    return out


def _circle(name: str, needs: Mapping[str, str]) -> str:
    """The circle that a name is in or leads to, in words."""
    seen: dict[str, int] = {}
    while name not in seen:
        seen[name] = len(seen)
        name = needs[name]
    return " → ".join([*list(seen)[seen[name] :], name][:12])


def _bare(node: dict[str, Any], path: Path) -> bool:
    """Whether a group is an expression without quotes: YAML reads {a/2} as a group with the key a/2 and no value."""
    if not node or any(v is not None for v in node.values()) or unit_at(shape(path)) is None:
        return False
    return not set(node) & set(keys_at(shape(path)))


def _replaced(node: Any, path: Path, known: Known) -> Any:
    if len(path) > DEEPEST:
        return node
    if isinstance(node, dict):
        if _bare(node, path):
            return Worthless(str(path[-1]), "an expression is text", f'put it in quotes: "{{{", ".join(node)}}}"')
        return {k: _replaced(v, (*path, k), known) for k, v in node.items()}
    if isinstance(node, list | tuple):
        return [_replaced(v, (*path, i), known) for i, v in enumerate(node)]
    return known.computed(node) if is_expression(node) and unit_at(shape(path)) is not None else node
