"""A damaged file gives a scene, or an error that names the place. No damage causes another exception."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from tests.importers import test_freecad_asmt, test_sdf
from tests.importers.test_mjcf import BALL, CLASSES, FOUR_BAR
from tests.importers.test_urdf_and_meshes import URDF
from trunnion.basics.errors import SceneError
from trunnion.importers import scene_of

ODD = ("", "nan", "inf", "1e400", "0", "-1", "x", "0 0 0", "1 2", "1e29", "0 0 0 0", "1" * 400, "\N{SNOWMAN}")
CLOSED = '<connect body1="coupler" body2="rocker" anchor="0.5 0 0.1"/><weld body1="crank" relpose="0 0 0 1 0 0 0"/>'
TEXTS = {
    "arm.urdf": URDF, "arm.sdf": f'<sdf version="1.9">{test_sdf.ARM}</sdf>',
    "frames.sdf": f'<sdf version="1.9">{test_sdf.FRAMES}</sdf>',
    "classes.xml": f"<mujoco>{CLASSES.format(BALL)}</mujoco>", "bar.xml": f"<mujoco>{FOUR_BAR.format(CLOSED)}</mujoco>",
}  # fmt: skip
TRIES = 40


def damaged(text: str, rng: random.Random) -> str:
    """An XML file with one change: a number, a text, an element removed or duplicated."""
    what = rng.choice((r'"([^"]*)"', r">([^<>]+)<", r"<\w+[^<>]*/>", r"<\w+[^<>]*/>"))
    found = list(re.finditer(what, text))
    if not found:
        return text
    m = rng.choice(found)
    if m.re.groups:
        return text[: m.start(1)] + rng.choice(ODD) + text[m.end(1) :]
    return text[: m.start()] + m.group() * rng.choice((0, 2)) + text[m.end() :]


def damaged_lines(text: str, rng: random.Random) -> str:
    """An indented text in which one line is changed, removed or moved."""
    lines = text.split("\n")
    k = rng.randrange(len(lines))
    depth = re.match(r"\t*", lines[k]).group()  # type: ignore[union-attr]
    lines[k : k + 1] = rng.choice(([], [depth + rng.choice(ODD)], ["\t" + lines[k]], [lines[k], rng.choice(lines)]))
    return "\n".join(lines)


def told(file: Path) -> bool:
    """True if a file is refused with a message."""
    try:
        scene_of(file)
    except SceneError as e:
        return all(p.what for p in e.problems)
    return False


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", TEXTS)
def test_damaged_xml_is_taken_over_or_refused(name: str, tmp_path: Path) -> None:
    refused = 0
    for seed in range(TRIES):
        rng = random.Random(f"{name} {seed}")
        text = TEXTS[name]
        for _ in range(rng.randint(1, 3)):
            text = damaged(text, rng)
        (tmp_path / name).write_text(text, encoding="utf-8")
        refused += told(tmp_path / name)
    assert refused > 0


def test_damaged_text_is_taken_over_or_refused(tmp_path: Path) -> None:
    test_freecad_asmt.arm(tmp_path)
    whole, refused = (tmp_path / "assembly.asmt").read_text(), 0
    for seed in range(2 * TRIES):
        (tmp_path / "damaged.asmt").write_text(damaged_lines(whole, random.Random(seed)), encoding="utf-8")
        refused += told(tmp_path / "damaged.asmt")
    assert 0 < refused < 2 * TRIES
