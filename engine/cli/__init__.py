"""The command line ``trunnion``. Commands import numpy and other large packages only when they run."""

from __future__ import annotations

import atexit
import gc
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

GARBAGE = 200_000
"""Number of new objects after which Python searches for garbage. A start of the command makes 100,000 objects. With Python's
threshold of 700, the searches take a tenth of the start. With 50,000, the searches take a thirtieth."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command. Exit code: 0 done, 1 failed with a diagnosis, 2 wrong use."""
    from trunnion.basics.interrupts import held

    gc.set_threshold(GARBAGE)
    atexit.register(gc.freeze)  # Python would search all objects for garbage twice before the process ends
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # pydantic would search all installed packages for plugins
    words = list(sys.argv[1:] if arguments is None else arguments)
    with held() as interrupt:
        try:
            with interrupt.open():
                from trunnion.cli.fast_help_and_completion import stored_answer

                if (text := stored_answer(words)) is not None:
                    print(text, end="", flush=True)
                    return 0
                from trunnion.cli.entry_point import run

                return run(words)
        except KeyboardInterrupt:  # Ctrl-C was pressed before the command began or while the command ended
            return 1
