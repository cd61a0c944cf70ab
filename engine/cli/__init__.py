"""The command line: ``trunnion`` (see ``app`` for its commands). Nothing heavy is imported before it is needed."""

from __future__ import annotations

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code: 0 done, 1 failed with a diagnosis, 2 wrong use."""
    from engine.basics.interrupts import held

    with held() as interrupt:
        try:
            with interrupt.open():
                from engine.cli.entry import run

                return run(list(sys.argv[1:] if arguments is None else arguments))
        except KeyboardInterrupt:  # pressed before there was a command, or as it ended
            return 1
