"""Components of reactions, and efforts of drives, that redundant loops do not determine (theory, "Redundant loops")."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from trunnion.kernel.interface.output_columns import Column
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.redundant_reactions import SHARE, Combination, Redundancy, redundancy
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.system.structure.loop_joints import rows_of
from trunnion.system.structure.redundant_loop_groups import joints_of_loop, reaction_groups

LINEAR = {"reaction", "axial_force", "gearbox_output", "drive"}
"""Kinds of columns that are affine in the reactions."""
LENGTHS = {"N*m": 1.0}
"""Power of the length scale by which a column with this unit is divided; 0 for other units."""


def open_reactions(model: Model, settings: bl.Settings) -> Redundancy:
    """The redundancy at the current state of a started model, with the columns that are not unique. settings: settings of the
    run."""
    found = redundancy(model.block)
    if found.joints not in model.perhaps_open:
        model.perhaps_open[found.joints] = [c for c in model.available if _may_be_open(c, found.joints)]
    wanted = model.perhaps_open[found.joints]
    changes = _changes(model, wanted, settings) if wanted else np.zeros((0, 0))
    if not len(changes):
        return found
    length = model.built.numbers.length
    sizes = np.abs(changes).max(axis=0) / [length ** LENGTHS.get(c.unit, 0.0) for c in wanted]
    largest = dict.fromkeys(found.joints, 0.0)
    for size, c in zip(sizes, wanted, strict=True):
        largest[c.subject[0]] = max(largest[c.subject[0]], size)
    is_open = [size > SHARE * largest[c.subject[0]] for size, c in zip(sizes, wanted, strict=True)]
    drives = [i for i, c in enumerate(wanted) if c.kind == "drive" and is_open[i]]
    names = tuple(wanted[i].name for i in drives)
    return replace(
        found, columns=tuple(c.name for c, o in zip(wanted, is_open, strict=True) if o and c.kind != "drive"), drives=names,
        determined=_combinations(names, changes[:, drives] / np.abs(changes[:, drives]).max(initial=0.0)) if drives else (),
    )  # fmt: skip


def _may_be_open(c: Column, joints: tuple[str, ...]) -> bool:
    """Whether redundant loops may leave a column open. The reaction of a drive is minus the drive's effort; only the effort is
    examined."""
    return c.kind in LINEAR and c.subject[0] in joints and (c.kind != "drive" or c.quantity.output == "effort")


def _changes(model: Model, wanted: list[Column], settings: bl.Settings) -> np.ndarray:
    """Changes of the columns ``wanted`` along the open directions (directions × columns). If the model lacks these columns, a
    second model that has them is started in the same state. Empty if the second model cannot start."""
    places = {c.name: i for i, c in enumerate(model.columns)}
    if not all(c.name in places for c in wanted):
        other = model.with_reactions([c.name for c in wanted])
        other.block.configure(settings)
        other.block.y[: model.block.ny] = model.block.y[: model.block.ny]
        if other.begin(settings, model.block.time, np.inf, 0.0) != bl.OK:
            return np.zeros((0, len(wanted)))
        return _changes(other, wanted, settings)
    changes = model.block.open_columns()[:, [places[c.name] for c in wanted]]
    return np.concatenate([np.zeros((1, len(wanted))), *_by_loop(model, wanted, changes)])


def _by_loop(model: Model, wanted: list[Column], changes: np.ndarray) -> Iterator[np.ndarray]:
    """Changes along single directions (n × columns). The first rows of ``changes`` are directions that are already single. In each
    further row, every loop of a group moves one constraint row that structure removes. The function splits such a row by loop;
    loops without drives stay together."""
    joints = tuple(c.subject[0] for c in wanted)
    if joints not in model.columns_of_loops:
        model.columns_of_loops[joints] = _columns_of_loops(model, joints, np.array([c.kind == "drive" for c in wanted]))
    slots, on_loops = model.columns_of_loops[joints]
    at = len(changes) - sum(slots)
    yield changes[:at]
    for count, masks in zip(slots, on_loops, strict=True):
        for mask in masks:
            yield np.where(mask, changes[at : at + count], 0.0)
        at += count


def _columns_of_loops(model: Model, joints: tuple[str, ...], is_drive: np.ndarray) -> tuple[list[int], list[list[np.ndarray]]]:
    """For each group of loops: the number of rows that structure removes, and masks of columns. There is one mask for the joints of
    each loop with a drive, and one for all other loops together. Only loops with drives need separate directions, because
    ``_combinations`` combines only efforts of drives."""
    loops, on_loops = reaction_groups(model.system), dict(rows_of(model.system))
    active, groups = set(model.block.kernel.facts["active_rows"]), loops["loop_group"]
    removed = [len(set(range(a, b)) - active) for a, b in pairwise(loops["loop_rows"])]
    slots = [max(n for n, g in zip(removed, groups, strict=True) if g == group) for group in range(max(groups) + 1)]
    masks: list[list[np.ndarray]] = [[] for _ in slots]
    for c, group in zip(model.system.cuts, groups, strict=True):
        members = set(joints_of_loop(model.system, c, on_loops))
        masks[group].append(np.array([j in members for j in joints]))
    return slots, [_together(of_group, is_drive) for of_group in masks]


def _together(masks: list[np.ndarray], is_drive: np.ndarray) -> list[np.ndarray]:
    """The masks that contain a drive, and the union of all other masks."""
    driven = [m for m in masks if (m & is_drive).any()]
    return [*driven, np.any([m for m in masks if not (m & is_drive).any()] or [np.zeros(len(is_drive), bool)], axis=0)]


def _combinations(names: tuple[str, ...], changes: np.ndarray) -> tuple[Combination, ...]:
    """Independent combinations of efforts, in reduced echelon form. The combinations do not change along any direction. changes:
    changes of the efforts (directions × efforts); the largest change is 1."""
    _, sizes, basis = np.linalg.svd(changes, full_matrices=True)
    rest = basis[int(np.sum(sizes > SHARE)) :]
    out = []
    for at in range(len(names)):
        if not len(rest):
            break
        pivot = int(np.argmax(np.abs(rest[:, at])))
        if abs(rest[pivot, at]) < SHARE:
            continue
        row = rest[pivot] / rest[pivot, at]
        rest = np.delete(rest, pivot, 0)
        rest = rest - np.outer(rest[:, at], row)
        out.append(row)
    for i, row in enumerate(out):  # remove each combination's leading effort from the other combinations
        lead = int(np.argmax(np.abs(row) > SHARE))
        out[:i] = [above - above[lead] * row for above in out[:i]]
    return tuple({n: float(x) for n, x in zip(names, row, strict=True) if abs(x) > SHARE} for row in out)
