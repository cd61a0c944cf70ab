"""Renaming of the bodies, points, joints, inputs and parameters that a part refers to."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from trunnion.scene.expressions.formula_parser import parse_formula, rename_names
from trunnion.scene.expressions.formula_values_and_dimensions import value
from trunnion.scene.expressions.parameter_evaluation import FORMULAS, expression_text, is_expression
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.units.unit_parser import UnitError

Renamer = Callable[[str, Path], str]
_BRACES = re.compile(r"\{([^{}]*)\}")


def restore_on(data: dict[str, Any]) -> None:
    """Restore the key ``on`` of forces. YAML 1.1 reads ``on`` as true, and tools for YAML 1.1 write ``true:``."""
    forces = data.get("forces")
    for force in forces.values() if isinstance(forces, dict) else ():
        said = [k for k in ("true", "True") if k in force] if isinstance(force, dict) and "on" not in force else []
        if said:
            force["on"] = force.pop(said[0])


def rename_references(section: str, name: str, part: Any, by: Renamer) -> Any:
    """A copy of a joint or load; ``by`` returns the new name of each body and point in it."""
    path: Path = (section, name)
    if not isinstance(part, dict):
        return part
    if section == "joints":
        return {k: _rename_side(v, (*path, k), by) if k in ("inboard", "outboard", "at") else v for k, v in part.items()}
    out = dict(part)
    for key in ("on", "towards"):
        if isinstance(part.get(key), str):
            out[key] = by(part[key], (*path, key))
    if isinstance(part.get("between"), list):
        ends = enumerate(part["between"])
        out["between"] = [by(e, (*path, "between", i)) if isinstance(e, str) else e for i, e in ends]
    return out


def _rename_side(side: Any, path: Path, by: Renamer) -> Any:
    if isinstance(side, str):
        return by(side, path)
    if not isinstance(side, dict) or not isinstance(side.get("body"), str):
        return side
    point = side.get("point")
    if not isinstance(point, str):
        return {**side, "body": by(side["body"], (*path, "body"))}
    body, _, found = by(f"{side['body']}.{point}", (*path, "point")).partition(".")
    return {**side, "body": body, "point": found}


def rename_leading_joint(joint: Any, by: Callable[[str], str]) -> Any:
    """A copy of a joint; ``by`` returns the new name of the leading joint of its mimic."""
    mimic = joint.get("mimic") if isinstance(joint, dict) else None
    if not isinstance(mimic, dict) or not isinstance(mimic.get("joint"), str):
        return joint
    return {**joint, "mimic": {**mimic, "joint": by(mimic["joint"])}}


def rename_inputs(node: Any, names: dict[str, str]) -> Any:
    """A copy of a joint or load; ``names`` maps old names of inputs to new ones."""
    if isinstance(node, list):
        return [rename_inputs(v, names) for v in node]
    if not isinstance(node, dict):
        return node
    return {k: names.get(v, v) if k == "input" and isinstance(v, str) else rename_inputs(v, names) for k, v in node.items()}


def rename_parameters(node: Any, names: dict[str, str]) -> Any:
    """A copy of a value; ``names`` maps old names of parameters in its expressions to new ones."""
    if isinstance(node, dict):
        return {k: _rename_in_formula(k, v, names) or rename_parameters(v, names) for k, v in node.items()}
    if isinstance(node, list):
        return [rename_parameters(v, names) for v in node]
    return "{" + rename_names(expression_text(node), names) + "}" if is_expression(node) else node


def _rename_in_formula(key: str, given: Any, names: dict[str, str]) -> str:
    """The text of a formula of time or position without braces, with other names of parameters; "" for any other value."""
    timed = key in (*FORMULAS, "formula") and isinstance(given, str) and not is_expression(given)
    return rename_names(given, names) if timed else ""


def number_name(text: str, number: int) -> str:
    """The name with {i}, {i+1}, … replaced by numbers, where i is the ``number`` of a copy. Raises UnitError when the braces hold
    another name or give no whole number."""

    def one(m: re.Match[str]) -> str:
        found = value(parse_formula(rename_names(m[1], {"i": str(number)})).root, {})
        if found != int(found):
            raise UnitError(f"{m[0]} is {found:g}, not a whole number", "copies are counted from 1: {i}, {i-1}")
        return str(int(found))

    try:
        return _BRACES.sub(one, text)
    except KeyError as e:
        raise UnitError(f"{e.args[0]} in {text} is unknown", "use only i, the number of the copy: {i}, {i-1}") from e
