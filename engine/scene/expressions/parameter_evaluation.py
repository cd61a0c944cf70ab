"""Evaluation of a scene's parameters and expressions: each text such as "{a/2 + 5 mm}" in the plain data is replaced by a
number that stores its expression."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import field
from graphlib import CycleError, TopologicalSorter
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.force_field import COMPONENTS
from trunnion.scene.data_classes.type_tree import classes_at, keys_at, shape, unit_at
from trunnion.scene.expressions.formula_parser import RESERVED, WHATEVER, Formula, parse_formula
from trunnion.scene.expressions.formula_values_and_dimensions import dimension, value
from trunnion.scene.file_format.yaml_reader import DEEPEST
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import did_you_mean, shown
from trunnion.scene.units.numbers_with_units import Computed, NoValue, Quantity, number
from trunnion.scene.units.unit_parser import NONE, Dimension, UnitError

FORMULAS = ("expression", *COMPONENTS)
"""Keys whose values are formulas of time or position."""
NAMED = "parameters"
MEND_FIRST = "correct the parameter first"
"""The hint for an expression that has no value because one of its parameters has no value."""
NOT_FORMED = "a letter, then letters, digits and _"


def is_expression(given: Any) -> bool:
    """Whether a value is an expression, which is a text in braces."""
    return isinstance(given, str) and given[:1] == "{" and given.strip()[-1:] == "}"


def expression_text(text: str) -> str:
    """The text between the braces."""
    return text.strip()[1:-1]


@dataclass
class Parameters:
    """The parameters of a scene by name. ``value`` and ``dimension`` hold the valid parameters; ``wrong`` holds the invalid
    parameters with the reason."""

    value: dict[str, float] = field(default_factory=dict)
    dimension: dict[str, Dimension] = field(default_factory=dict)
    wrong: dict[str, NoValue] = field(default_factory=dict)

    def computed(self, text: str) -> Computed | NoValue:
        """The value of an expression; ``text`` includes the braces."""
        try:
            return self._computed(text, parse_formula(expression_text(text)))
        except UnitError as e:
            return NoValue(text, e.what, e.hint)

    def _computed(self, text: str, f: Formula) -> Computed | NoValue:
        for name in sorted(f.names):
            if name in self.wrong:
                return NoValue(text, f"the parameter {name} has no value", MEND_FIRST)
            if name not in self.value:
                hint = did_you_mean(name, self.value, "parameters") or f"add parameters: {{{name}: …}}"
                return NoValue(text, f"there is no parameter {shown(name)}", hint)
        measured = dimension(f.root, self.dimension)
        plain = f.plain or measured == WHATEVER
        return Computed(value(f.root, self.value), NONE if plain else measured, text, f.names, plain)

    def keep(self, name: str, given: float | NoValue) -> None:
        """Store the value of a parameter, or the reason why it has none."""
        if isinstance(given, NoValue):
            self.wrong[name] = given
        else:
            self.value[name] = float(given)
            self.dimension[name] = given.dimension if isinstance(given, Quantity) else NONE


def evaluate(data: Any) -> tuple[Any, list[Finding]]:
    """The data with each expression replaced by its value, and the mistakes in the names of parameters. An invalid expression
    becomes a ``NoValue``, which ``numbers_with_units.number`` reports as a mistake at its path."""
    if not isinstance(data, dict):
        return data, []
    given = data.get(NAMED)
    parameters = given if isinstance(given, dict) else {}
    findings = list(_names(parameters))
    known = parameters_of(parameters)
    out = {k: _evaluate_below(v, (k,), known) for k, v in data.items() if k != NAMED}
    if NAMED in data:
        out[NAMED] = {n: _parameter_value(known, n, v) for n, v in parameters.items()} if isinstance(given, dict) else given
    return out, findings


def _parameter_value(known: Parameters, name: str, given: Any) -> Any:
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


def parameters_of(given: Mapping[str, Any]) -> Parameters:
    """The values of the parameters, each computed after the parameters that its expression uses. A cycle is a mistake."""
    known, texts = Parameters(), {n: v for n, v in given.items() if is_expression(v)}
    for name, v in given.items():
        if name not in texts:
            try:
                known.keep(name, number(v))
            except UnitError as e:
                known.keep(name, NoValue(shown(v), e.what, e.hint))
    for name in in_order(texts, lambda n: _names_in(texts[n])):
        known.keep(name, known.computed(texts[name]))
    left = {n for n in texts if n not in known.value and n not in known.wrong}
    for name in left:
        circle = _circle(name, {n: sorted(_names_in(texts[n]) & left)[0] for n in left})
        known.wrong[name] = NoValue(
            texts[name], f"the parameter depends on itself: {circle}", "give one of these parameters a number"
        )
    return known


def _names_in(text: str) -> frozenset[str]:
    try:
        return parse_formula(expression_text(text)).names
    except UnitError:
        return frozenset()


def in_order(names: Collection[str], needs: Callable[[str], Iterable[str]]) -> list[str]:
    """The names in topological order: each name comes after the names that it needs. Names in a cycle are omitted, and so are names
    that need a name in a cycle."""
    wanted = set(names)
    order, found = TopologicalSorter({n: wanted.intersection(needs(n)) for n in names}), list[str]()
    with suppress(CycleError):  # after a cycle, the sorter still yields the names that depend on no cycle
        order.prepare()
    while ready := order.get_ready():
        found += ready
        order.done(*ready)
    return found


def _circle(name: str, needs: Mapping[str, str]) -> str:
    """The cycle of names that ``needs`` reaches from ``name``, as text with arrows."""
    seen: dict[str, int] = {}
    while name not in seen:
        seen[name] = len(seen)
        name = needs[name]
    return " → ".join([*list(seen)[seen[name] :], name][:12])


def _is_unquoted(node: dict[str, Any], path: Path) -> bool:
    """Whether a group is an expression whose quotes are missing: YAML reads {a/2} as a mapping with the key a/2 and no value."""
    if not node or any(v is not None for v in node.values()) or unit_at(shape(path)) is None:
        return False
    return not set(node) & set(keys_at(shape(path)))


def _with_numbers(given: Any, path: Path) -> Any:
    """The group of a formula of time or position, with the formula's constant parts as numbers. Any other value is unchanged. A
    formula with a mistake is also unchanged; the checks report the mistake."""
    kind = next((c for c in classes_at(shape(path)) if hasattr(c, "__separate__")), None) if path[-1] in FORMULAS else None
    if kind is None:
        return given
    group = {"formula": expression_text(given) if is_expression(given) else given} if isinstance(given, str) else given
    if not isinstance(group, dict) or not isinstance(group.get("formula"), str) or group.get("numbers"):
        return group
    try:
        return {**group, "numbers": list(kind.__separate__(group["formula"])[1])}
    except UnitError:
        return group


def _evaluate_below(node: Any, path: Path, known: Parameters) -> Any:
    if len(path) > DEEPEST:
        return node
    if isinstance(node, dict):
        if _is_unquoted(node, path):
            return NoValue(str(path[-1]), "an expression must be text", f'put it in quotes: "{{{", ".join(node)}}}"')
        return {k: _evaluate_below(_with_numbers(v, (*path, k)), (*path, k), known) for k, v in node.items()}
    if isinstance(node, list | tuple):
        return [_evaluate_below(v, (*path, i), known) for i, v in enumerate(node)]
    return known.computed(node) if is_expression(node) and unit_at(shape(path)) is not None else node
