"""``check`` asks a question about sliding contacts that stay on a long part although the other part is as short as their
distance."""

from __future__ import annotations

from typing import Any

import pytest

from trunnion.scene.checks.sliding_contact_ends import contact_end_notes
from trunnion.scene.scene_loader import scene_from_dict

AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}


def slide(axis: str, rail: float | None, carriage: float, half_length: float, **joint: Any) -> dict[str, Any]:
    """A carriage on a rail, or on the ground if ``rail`` is None. Lengths along the axis, m; all cross-sections are 20 mm wide."""

    def bar(length: float) -> dict[str, Any]:
        return {"box": [length if e else 0.02 for e in AXES[axis]], "density": 7800}

    guide = {"type": "prismatic", "axis": axis, "inboard": "rail" if rail else "ground", "outboard": "carriage", **joint}
    guide["friction"] = {"mu": 0.1, "half_length": half_length, "half_width": 0.01, "half_height": 0.01}
    bodies = {"carriage": bar(carriage)} | ({"rail": bar(rail)} if rail else {})
    joints = {"guide": guide} | ({"foot": {"type": "fixed", "inboard": "ground", "outboard": "rail"}} if rail else {})
    return {"schema": 1, "bodies": bodies, "joints": joints}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("rail", [None, 1.0])
def test_contacts_on_the_long_part_are_asked_about_until_ends_is_given(axis: str, rail: float | None) -> None:
    (note,) = contact_end_notes(scene_from_dict(slide(axis, rail, 0.2, 0.1)))
    assert note.startswith("joints.guide: the contacts stay at two places of " + ("rail" if rail else "ground"))
    assert "ends: outboard" in note
    for ends in ("inboard", "outboard"):
        assert not contact_end_notes(scene_from_dict(slide(axis, rail, 0.2, 0.1, ends=ends)))


@pytest.mark.parametrize(("rail", "carriage", "half_length", "pin"), [
    (1.0, 0.2, 0.1, "outboard"),  # the short part carries the contacts
    (0.2, 0.2, 0.1, "inboard"),  # equal lengths
    (1.0, 0.9, 0.1, "inboard"),  # neither part is short
])  # fmt: skip
def test_other_guides_are_not_asked_about(rail: float, carriage: float, half_length: float, pin: str) -> None:
    assert not contact_end_notes(scene_from_dict(slide("x", rail, carriage, half_length, pin=pin)))
