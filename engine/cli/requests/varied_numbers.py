"""Numbers that cases vary: the words of ``--vary`` and ``--sample``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from trunnion.cli.options import completion
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import repeatable

MU = "joints.ball.friction.mu"
Vary = Annotated[
    list[str],
    repeatable(
        "--vary", metavar="PATH=VALUES", autocompletion=completion.assignments,
        help="Values of a number: first:last:count, or a,b,c; several numbers give all combinations.",
    ),
]  # fmt: skip
Sample = Annotated[
    list[str],
    repeatable(
        "--sample", metavar="PATH=SPREAD", autocompletion=completion.assignments,
        help="Distribution of a number: low:high, 'normal(mean, deviation)', 'lognormal(mean, deviation)' or "
        "'triangular(low, mode, high)'.",
    ),
]  # fmt: skip
Seed = Annotated[int, typer.Option("--seed", metavar="S", help="Seed of the sample; the same seed gives the same cases.")]
Sampling = Annotated[
    str,
    typer.Option(
        "--sampling", metavar="HOW",
        help="Method of sampling: latin, random, sobol, or saltelli (for Sobol indices; 2 × numbers + 2 cases for each point).",
    ),
]  # fmt: skip


def values_by_path(texts: Sequence[str], where: str, reader: ArgumentReader) -> dict[str, str]:
    """{path: values} from words PATH=VALUES."""
    return reader.named_values(texts, where, "PATH=VALUES", f"{MU}=0.1:0.6:26, or =0.1,0.2")


def bounds_by_path(texts: Sequence[str], reader: ArgumentReader) -> dict[str, list[str]]:
    """{path: [low, high]} from the words PATH=LOW:HIGH of ``--vary``."""
    out: dict[str, list[str]] = {}
    for path, text in values_by_path(texts, "--vary", reader).items():
        ends = [part.strip() for part in text.split(":")]
        if len(ends) == 2 and all(ends):
            out[path] = ends
        else:
            reader.add("--vary", f"{path}={text} is not PATH=LOW:HIGH", f"for example {MU}=0.1:0.6")
    return out


def spreads_by_path(texts: Sequence[str], reader: ArgumentReader) -> dict[str, list[str] | str]:
    """{path: [low, high], or the text of a distribution} from the words of ``--sample``."""
    out: dict[str, list[str] | str] = {}
    for path, text in values_by_path(texts, "--sample", reader).items():
        ends = [part.strip() for part in text.split(":")]
        if "(" in text or (len(ends) == 2 and all(ends)):
            out[path] = text if "(" in text else ends
        else:
            what = f"{path}={text} is neither PATH=LOW:HIGH nor a distribution"
            reader.add("--sample", what, f"for example {MU}=0.1:0.6, or ='normal(0.3, 0.05)'")
    return out
