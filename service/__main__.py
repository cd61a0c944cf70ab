"""``python -m trunnion.service`` does the same as ``trunnion serve``."""

import sys

from trunnion.cli import main as trunnion


def main(arguments: list[str] | None = None) -> int:
    """Run the server until it receives the signal to end. Returns the exit code."""
    return trunnion(["serve", *(sys.argv[1:] if arguments is None else arguments)])


if __name__ == "__main__":
    sys.exit(main())
