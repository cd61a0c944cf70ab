"""``trunnion chart``: words to a choice, the measurements, the files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, print_json

if TYPE_CHECKING:
    from engine.chart import Study


@dataclass(frozen=True)
class ChartWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any]
    folder: str | None = None
    changes: Sequence[str] = ()
    v_eps: Sequence[str] = ()
    outputs: Sequence[str] = ()
    norm: str | None = None
    repeats: int = 7
    samples: int = 100
    fixed: bool = True
    peers: bool = True
    scaling: bool = False
    as_json: bool = False
    verbose: bool = False


def chart_command(wish: ChartWish) -> int:
    """Measure the chart and write its files; the exit code."""
    from engine.chart import chart, write
    from engine.chart.files import folder_of
    from engine.chart.machine import one_core
    from engine.cli.meter import Meter
    from engine.cli.simulating import talk

    talk(wish.verbose)
    if wish.scaling:
        from engine.cli.scaling import scaling_command

        return scaling_command(wish)
    scene, arguments = understood(wish)
    folder_of(wish.folder or "")
    with one_core(), Meter(f"chart {scene.name}") as meter:
        study = chart(scene, _choice(arguments), meter.tell)
    files = [str(p) for p in write(study, wish.folder or "")]
    if wish.as_json:
        from engine.chart.page import content
        from engine.simulation.tables import finite

        print_json({"exit_code": DONE, **finite(content(study)), "files": files})
    else:
        print_lines(summary(study, files))
    return DONE


def print_lines(lines: Sequence[str]) -> None:
    """Print lines, without colours where standard output is no terminal."""
    import sys

    from engine.cli.summary import plain
    from engine.cli.terminal import coloured

    for line in lines:
        print(line if coloured(sys.stdout) else plain(line))


def _choice(arguments: dict[str, Any]):
    from engine.chart import Choice

    return Choice(**arguments)


def understood(wish: ChartWish):
    """(scene, arguments of Choice) of the options; SceneError with every problem among them."""
    from engine.chart.measures import NORMS
    from engine.cli.simulating import loaded, unknown_outputs

    found = Findings()
    source = options.one_scene(wish.scene, found)
    changes = options.assignments(wish.changes, found)
    if wish.folder is None:
        found.add("-o", "no folder is given", "for example -o charts")
    elif options.names_columns(wish.folder):
        found.add("-o", f"{wish.folder!r} is not the name of a folder", options.ASK)
    if wish.repeats < 1:
        found.add("--repeat", f"{wish.repeats} repeats cannot be measured", "at least 1; 7 is a good start")
    if wish.samples < 1:
        found.add("--samples", f"{wish.samples} samples cannot be compared", "at least 1; 100 is a good start")
    chosen = options.settings("trunnion chart", wish.settings, found)
    arguments = {
        "methods": chosen["method"], "rtols": chosen["rtol"], "laws": chosen["law"], "until": chosen["until"],
        "v_eps": tuple(v for t in wish.v_eps if (v := _speed(t, found)) is not None),
        "outputs": tuple(wish.outputs),
        "norm": options.choice(wish.norm, NORMS, "--norm", found) or "max",
        "samples": wish.samples, "repeats": wish.repeats, "fixed": wish.fixed, "peers": wish.peers,
    }  # fmt: skip
    scene = loaded(source, changes, None, found)
    if scene is not None:
        found.problems += unknown_outputs(scene, wish.outputs)
    found.end()
    assert scene is not None
    return scene, arguments


def _speed(text: str, found: Findings) -> float | None:
    value = options.quantity(text, "m/s", "--v-eps", found)
    if value is not None and value <= 0:
        found.add("--v-eps", f"{text} is not a positive speed", 'for example "1e-4 m/s"')
        return None
    return value


def summary(study: Study, files: Sequence[str]) -> list[str]:
    """What was found, in lines: references, the fastest setting at each error, peers, failures, files."""
    from engine.chart.curves import verdict
    from engine.chart.files import reference_lines
    from engine.chart.points import front
    from engine.cli.summary import table

    lines = [f"{study.scene.name}: {len(study.points)} settings, 0 to {study.until:g} s"]
    lines += reference_lines(study)
    best = front(p for p in study.ours() if p.variant == study.exact)
    rows = [(f"{p.error:.1e}", f"{1e3 * p.minimum:.3f}", f"{1e3 * p.median:.3f}", f"{p.method}, {p.setting}") for p in best]
    lines += ["", f"fastest at each error{f' ({study.exact})' if study.exact.law else ''}:"]
    lines += table(("error", "min ms", "median ms", "setting"), rows)
    lines += ["", *verdict(study)] if study.theirs() else []
    lines += [f"{name}: {text}" for name, _, text in study.peers]
    failed = [p for p in study.points if not p.ok]
    lines += [f"{len(failed)} settings failed (crosses in the chart; named in chart.csv)"] if failed else []
    return [*lines, *study.notes, "", *(f"wrote {f}" for f in files)]
