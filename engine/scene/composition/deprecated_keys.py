"""Replacement of deprecated keys and values in scenes, before other modules read the data."""

from __future__ import annotations

from typing import Any

from trunnion.basics.renamed_words import JOINT_KEYS, SIMULATION_VALUES, current, current_path
from trunnion.scene.findings.findings_and_paths import Path


def replace_deprecated(data: dict[str, Any], lines: dict[Path, int], above: Path = ()) -> None:
    """Rename deprecated keys in place, in a scene or part and in the parts of its assemblies, and update the paths in ``lines``.

    ``above`` is the path of the group. Each deprecated word gives a warning. If a joint has both the old and the new key, the joint
    stays unchanged, and validation refuses the old key.
    """
    for name, joint in _groups(data, "joints"):
        for old in [k for k in joint if k in JOINT_KEYS and JOINT_KEYS[k] not in joint]:
            _rename(joint, old, current("scene key", JOINT_KEYS, old))
            _move_lines(lines, (*above, "joints", name, old), JOINT_KEYS[old])
    simulation = data.get("simulation")
    for key, words in SIMULATION_VALUES.items():
        if isinstance(simulation, dict) and isinstance(simulation.get(key), str):
            simulation[key] = current(f"value of simulation.{key}", words, simulation[key])
    if isinstance(data.get("tunable"), list):
        data["tunable"] = [current_path(p) if isinstance(p, str) else p for p in data["tunable"]]
    for name, assembly in _groups(data, "assemblies"):
        if isinstance(assembly.get("use"), dict):
            replace_deprecated(assembly["use"], lines, (*above, "assemblies", name, "use"))


def _groups(data: dict[str, Any], key: str) -> list[tuple[str, dict[str, Any]]]:
    """(name, group) of every group below a key."""
    found = data.get(key)
    return [(n, g) for n, g in found.items() if isinstance(g, dict)] if isinstance(found, dict) else []


def _rename(group: dict[str, Any], old: str, new: str) -> None:
    """Rename a key of a group; the order of the keys is preserved."""
    items = [(new if k == old else k, v) for k, v in group.items()]
    group.clear()
    group.update(items)


def _move_lines(lines: dict[Path, int], path: Path, new: str) -> None:
    """In ``lines``, replace the last key of ``path`` by ``new``, for this path and all paths below it."""
    for p in [p for p in lines if p[: len(path)] == path]:
        lines[(*path[:-1], new, *p[len(path) :])] = lines.pop(p)
