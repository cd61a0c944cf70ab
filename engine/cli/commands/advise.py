"""``trunnion advise``."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.options.argument_reader import SCENES, ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Scene, SettingWords, columns_option, file_option
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import print_answer, table

if TYPE_CHECKING:
    from trunnion.analysis.advice.model_advice import Advice, Rung


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    error: Annotated[str | None, typer.Option(metavar="E", help="Largest relative error of the outputs, such as 1e-3.")] = None,
    norm: Annotated[str | None, typer.Option(metavar="N", help="How errors are measured: rms or max.", show_default="rms")] = None,
    repeat: Annotated[int, typer.Option(metavar="N", help="Number of times each timed run is repeated.")] = 7,
    changes: Changes,
    outputs: Annotated[list[str], columns_option("Columns whose error must stay within --error, such as 'slider.position[1]'.")],
    save: Annotated[str | None, file_option(".yaml", what="Write the reduced scene")] = None,
    as_json: Json = False,
) -> int:
    """Find the simplest model, method and tolerance whose outputs stay within an error; print the errors of all models tried."""
    from trunnion.analysis.advice.model_advice import advise
    from trunnion.analysis.work_precision.error_measure import NORMS
    from trunnion.analysis.work_precision.machine_description import pin_to_one_core
    from trunnion.basics.atomic_files import writing
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.scene.file_format.yaml_writer import scene_to_yaml

    reader = ArgumentReader()
    largest = relative_error(error, reader)
    until = settings.values(reader)["until"]
    measure = reader.choice(norm, NORMS, "--norm") or "rms"
    path = reader.destination(save, SCENES)
    loaded = reader.scene(scene, ctx, changes)
    reader.check_columns(loaded, outputs)
    if not outputs:
        reader.add("--outputs", "no column is given", "name the important columns, for example --outputs 'slider.position[1]'")
    loaded = reader.checked(loaded)
    assert largest is not None
    with pin_to_one_core(), ProgressBar(f"advise {loaded.name}") as bar:
        advice = advise(loaded, largest, tuple(outputs), until, measure, repeat, progress=bar.show_part)
    written: list[Path] = []
    if path is not None and advice.scene is not None:
        with writing(path, SCENES) as work:
            work.write_text(scene_to_yaml(advice.scene), encoding="utf-8")
        written.append(path)
    return print_answer(as_json, DONE if advice.chosen else FAILED, document(advice), lines(loaded.name, advice), written)


def relative_error(text: str | None, reader: ArgumentReader) -> float | None:
    """The error that ``--error`` gives. Mistakes are added to ``reader``."""
    if text is None:
        reader.add("--error", "is not given", "give the largest relative error of the outputs, for example --error 1e-3")
        return None
    value = reader.quantity(text, "1", "--error")
    if value is not None and not 1e-9 <= value < 1:
        reader.add("--error", f"{text} is out of range", "write a relative error between 1e-9 and 1, for example 1e-3")
    return value


def document(a: Advice) -> dict[str, Any]:
    """The advice as plain data."""
    from trunnion.scene.file_format.yaml_writer import scene_to_dict

    return {
        "error": a.error, "measure": a.measure.describe(),
        "reference": {"made_by": a.reference.made_by, "error": a.reference.error},
        "influences": [asdict(i) for i in a.influences], "rungs": [asdict(r) | {"model": r.describe()} for r in a.rungs],
        "chosen": a.rungs.index(a.chosen) if a.chosen else None, "scene": scene_to_dict(a.scene) if a.scene else None,
        "notes": list(a.notes),
    }  # fmt: skip


def lines(name: str, a: Advice) -> list[str]:
    """The models that were tried, as text."""
    out = [f"{name}: {a.measure.describe()}", f"reference: {a.reference.made_by}, whose results differ by {a.reference.error:.1e}"]
    if a.influences:
        rows = [(i.joint, f"{i.predicted:.1e}" if math.isfinite(i.predicted) else "unknown") for i in a.influences]
        out += ["", *table(("joint", "change of the outputs without the friction of the joint (first order)"), rows)]
    head = ("  rung", "model's error", "total", "median ms", "cheapest setting")
    out += ["", *table(head, [row(r, r is a.chosen) for r in a.rungs])]
    if a.chosen and a.chosen.setting:
        s = a.chosen.setting
        part = f" (integration alone: {s.integration:.1e})" if math.isfinite(s.integration) else ""
        reached = f"error {s.error:.1e}{part} in {1e3 * s.median:.3g} ms"
        out += ["", f"advice: {a.chosen.describe()}; method {s.method}, rtol {s.rtol:.0e}: {reached}"]
    else:
        out += ["", f"no model reaches error {a.error:g}: run the full scene with a tighter tolerance, or allow a larger error"]
    return [*out, *a.notes]


def row(r: Rung, chosen: bool) -> tuple[str, ...]:
    """A model that was tried, as a row of the table."""
    name = ("→ " if chosen else "  ") + r.describe()
    own = f"{r.model_error:.1e}{' by sensitivity' if r.predicted else ''}" if math.isfinite(r.model_error) else r.outcome
    if r.setting is None:
        return (name, own, "", "", "")
    s = r.setting
    return (name, own, f"{s.error:.1e}", f"{1e3 * s.median:.3f}", f"{s.method}, rtol {s.rtol:.0e}")
