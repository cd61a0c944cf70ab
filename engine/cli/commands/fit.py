"""``trunnion fit``."""

from __future__ import annotations

from typing import Any

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Plot, Scene
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import print_answer
from trunnion.cli.requests.fit_request import Column, Compare, Data, Level, Noise, Own, Trials, VaryPrior, read_fit_request


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    data: Data,
    vary: VaryPrior,
    own: Own,
    column: Column,
    noise: Noise,
    level: Level = "0.95",
    compare: Compare,
    trials: Trials,
    changes: Changes,
    plot: Plot = None,
    as_json: Json = False,
) -> int:
    """Estimate parameters and their intervals from measured curves; compare friction laws; rank further experiments."""
    from trunnion.analysis.fits.experiment_design import propose
    from trunnion.analysis.fits.model_comparison import compare as compare_laws
    from trunnion.analysis.fits.parameter_estimation import fit
    from trunnion.cli.output.fit_report import draw, lines, proposal_lines
    from trunnion.cli.output.progress_bars import ProgressBar

    reader = ArgumentReader()
    picture = reader.picture(plot)
    loaded = reader.scene(scene, ctx, changes)
    request = read_fit_request(
        loaded, reader, data=data, vary=vary, own=own, column=column, noise=noise, level=level, compare=compare, trials=trials
    )
    loaded = reader.checked(loaded)
    extra = request.arguments()
    with ProgressBar("fit"):
        evidence = compare_laws(loaded, request.candidates, request.shared, **extra) if request.candidates else None
        best = evidence.best.fit if evidence else fit(loaded, request.shared, **extra)
        assert best is not None
        ranked = propose(best, request.trials) if request.trials else ()
    if picture is not None:
        draw(best, picture)
    more: dict[str, Any] = {"compared": evidence.document()} if evidence else {}
    more |= {"experiments": [p.document() for p in ranked]} if ranked else {}
    document = {"problems": [], **best.document(), **more, "unused": request.unused}
    text = [*lines(loaded.name, best, evidence), *proposal_lines(ranked, best)]
    text += [f"not used: {', '.join(request.unused)}"] if request.unused else []
    return print_answer(as_json, DONE if best.converged else FAILED, document, text, [picture])
