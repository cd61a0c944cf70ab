"""``python -m service``: the same as ``trunnion serve``."""

import sys

import typer

from engine.basics.problems import SceneError, SimulationError
from engine.cli.extensions import lacking
from engine.cli.running import FAILED, failure_end, problems_end
from service.cli import serve


def main(arguments: list[str] | None = None) -> int:
    """Run the server until it is stopped; returns the exit code."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command("serve")(serve)
    try:
        return (
            typer.main.get_command(app).main(
                sys.argv[1:] if arguments is None else arguments, prog_name="trunnion serve", standalone_mode=False
            )
            or 0
        )
    except SceneError as e:
        return problems_end(e.problems, False)
    except SimulationError as e:
        return failure_end(str(e), False)
    except ImportError as e:
        problem = lacking(e, ["serve"])
        if problem is None:
            raise
        return problems_end([problem], False)
    except typer.Exit as e:
        return int(e.exit_code)
    except typer.Abort:
        return FAILED


if __name__ == "__main__":
    sys.exit(main())
