"""The stability gallery as a table: the engine's results on both sides of each threshold, and results of other programs. The script
measures SciPy (regularised law, closed forms, our equations without our integrators) and MuJoCo, if installed.

``python -m tests.benchmarks.stability_gallery.gallery_table`` prints the table; with ``--write`` it also writes the scenes and the
README of ``models/stability``."""

from __future__ import annotations

import importlib
import importlib.util
import sys

from tests.stability.gallery import ROWS
from tests.stability.gallery_entry import EDGE, Edge, Row
from trunnion.scene import models_dir
from trunnion.scene.file_format.yaml_writer import scene_to_yaml

COUNT = "forty"
BEYOND = "If this is a threshold, the numbers are one part in a million beyond it."
PEERS = {"SciPy": "scipy", "MuJoCo": "mujoco"}
HEAD = """# Stability gallery

This page lists {count} situations in which methods for mechanisms with friction fail. Each situation has a scene that you can run:

    python3 -m venv .venv && . .venv/bin/activate && pip install -q .
    trunnion simulate models/stability/01_zero_speed.yaml

Most scenes have a threshold that is known in closed form, such as the steepest angle at which a pendulum still holds. The test runs
such a scene twice, one part in a million below the threshold and one part above, and both answers must be right. The table has the
threshold and **both answers**, or the one answer of a scene without threshold. The numbers in each file are just beyond the first
threshold of its row. A [test](../../tests/stability/test_gallery.py) checks all answers, also with the world turned at random and
in other units of length, mass and time. *Right* means that the run is done, with energy balanced to 1e-5 and loops closed to 1e-9.

Results *in italics* come from {peers}, with their defaults unless noted. The script that writes this table measured
these results: `python -m tests.benchmarks.stability_gallery.gallery_table --write`. "Regularised" is friction that
grows with speed up to v_eps. MuJoCo's joints have a constant friction loss, which does not depend on the load. In these scenes, the
friction loss has the right value for the start.

| | where methods fail | scene | threshold: below / beyond it, here | elsewhere |
|---|---|---|---|---|
"""


def said(edge: Edge) -> str:
    """Table cells of an edge: the threshold, and the engine's verdicts on both sides of it."""
    return f"{edge.at}: " + " / ".join(f"**{edge.verdict(edge.scene(b))}**" for b, _ in edge.sides)


def elsewhere(row: Row, peers: dict) -> str:
    """Table cell for other programs: the measured statement, or else the statement that the row contains."""
    found = []
    for name, sides in peers.items():
        for side in (s for s in sides if row.number in s.STATEMENTS):
            who = "" if row.number in getattr(side, "BY_ITSELF", ()) else f"{name}: "
            found.append(f"*{who}{side.STATEMENTS[row.number]()}*")
    return "<br>".join(found) or row.elsewhere


def installed() -> dict:
    """The modules that measure installed programs, by name."""
    out = {}
    for name, package in PEERS.items():
        if importlib.util.find_spec(package) is None:
            print(f"{name} is skipped: not installed (pip install {package})", file=sys.stderr)
        else:
            out[name] = [
                importlib.import_module(f"tests.benchmarks.stability_gallery.{package}_{part}")
                for part in ("results_rows_1_to_21", "results_rows_23_to_28")
            ]
    return out


def main(write: bool) -> None:
    """Print the table; with ``write``, also write the scenes and the README."""
    lines, folder, peers = [], models_dir() / "stability", installed()
    for row in ROWS:
        file = f"{row.number:02d}_{row.name}.yaml"
        here = "<br>".join(said(e) for e in row.edges)
        lines.append(f"| {row.number} | {row.title} | [{row.name}]({file}) | {here} | {elsewhere(row, peers)} |")
        if write:
            title = f"# {row.number}. {row.title}: {row.edges[0].at}. {BEYOND}\n"
            (folder / file).write_text(title + scene_to_yaml(row.edges[0].scene(EDGE)), encoding="utf-8")
    text = HEAD.replace("{count}", COUNT).replace("{peers}", " and ".join(peers) or "others") + "\n".join(lines) + "\n"
    print(text)
    if write:
        (folder / "README.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main("--write" in sys.argv)
