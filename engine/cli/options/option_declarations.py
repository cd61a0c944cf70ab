"""Arguments and options of several commands, and the values that a command receives for the settings of a run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.cli.options import completion

if TYPE_CHECKING:
    from trunnion.cli.options.argument_reader import ArgumentReader

repeatable: Any = partial(typer.Option, default_factory=list)
"""Declares an option that may be given several times. The function receives a list, which is empty if the option is not given."""


@dataclass(frozen=True)
class SettingWords:
    """The words that a user gave for the run settings of a command. who: the command. words: the word of each setting, None if not
    given."""

    who: str
    words: Mapping[str, Any]

    def values(self, reader: ArgumentReader) -> dict[str, Any]:
        """SI values by name, None if not given. Mistakes are added to ``reader``."""
        from trunnion.simulation.settings.run_settings import settings_read

        values, problems = settings_read(self.who, self.words, lambda name: f"--{name.replace('_', '-')}")
        reader.problems += problems
        return values


Scene = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENE", help="A scene file, a folder with a scene.yaml, or a bundled model.", autocompletion=completion.scenes
    ),
]
Changes = Annotated[
    list[str],
    repeatable("--set", metavar="PATH=VALUE", help="Change a number of the scene.", autocompletion=completion.assignments),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")]
Plot = Annotated[str | None, typer.Option("--plot", metavar="FILE", help="Write a picture: .png, .svg or .pdf.")]
Animation = Annotated[str | None, typer.Option("--animate", metavar="FILE", help="Write an animation: .html, .gif, .webp or .mp4.")]
Workers = Annotated[
    int | None, typer.Option("--workers", metavar="N", min=1, help="Number of threads.", show_default="one per core")
]


def columns_option(text: str, show_default: str | bool = True) -> Any:
    """The option ``--outputs``, which selects columns. text: help of the option."""
    return repeatable("--outputs", metavar="PATTERN", help=text, show_default=show_default, autocompletion=completion.outputs)


def file_option(*suffixes: str, what: str = "Write a table") -> Any:
    """The option ``-o`` for the file that a command writes. what: text of the help. suffixes: suffixes of the file formats."""
    return typer.Option("-o", "--output", metavar="FILE", help=f"{what}: {' or '.join(suffixes)}.")


Outputs = Annotated[list[str], columns_option("Compute, write and show only these columns, such as 'ball.*'.")]
Table = Annotated[str | None, file_option(".csv", ".parquet")]
CsvTable = Annotated[str | None, file_option(".csv")]
REDUCE = "Result of each case: max, min, mean or final value of columns; first time or count of an event."
Reduce = Annotated[list[str], repeatable("--reduce", metavar="KIND:WHAT", help=REDUCE)]
