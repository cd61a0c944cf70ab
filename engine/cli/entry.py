"""What stands around every command: its words are run, and whatever goes wrong is told as what it is."""

from __future__ import annotations

import os
import sys

import typer

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.cli import extensions
from engine.cli.finding import app
from engine.cli.running import DONE, FAILED, failure_end, problems_end

INTERRUPTED = 130
"""What newer versions of typer return for a command that Ctrl-C ended; older ones raise Abort."""
USAGE_ERROR: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")  # type: ignore[assignment]
"""What typer raises for arguments it cannot take (its own copy of click's class, or click's)."""
FLAGS = {"json": ("--json",), "verbose": ("-v", "--verbose")}


def run(arguments: list[str]) -> int:
    """Run the command that the arguments name; its exit code."""
    given = arguments[: arguments.index("--")] if "--" in arguments else arguments
    as_json, verbose = (any(a in names for a in given) for names in FLAGS.values())
    try:
        code = typer.main.get_command(app).main(arguments, prog_name="trunnion", standalone_mode=False)
        if code == INTERRUPTED:
            raise KeyboardInterrupt
    except SceneError as e:
        return problems_end(e.problems, as_json)
    except USAGE_ERROR as e:
        return problems_end([usage_problem(e)], as_json)
    except SimulationError as e:
        return failure_end(str(e), as_json)
    except ImportError as e:
        problem = extensions.lacking(e, arguments)
        return problems_end([problem], as_json) if problem else failure_end(defect_text(e, verbose), as_json)
    except (KeyboardInterrupt, typer.Abort):
        return failure_end("stopped: interrupted before there were results", as_json)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115  # the reader of our output is gone: nothing more can be said
        return FAILED
    except Exception as e:  # noqa: BLE001  # the last line of defence: a defect of ours is told as one
        return failure_end(defect_text(e, verbose), as_json)
    return code if isinstance(code, int) else DONE


def usage_problem(error: Exception) -> Problem:
    """Typer's complaint as a problem: which argument, what is wrong."""
    text = getattr(error, "format_message", lambda: str(error))().strip()
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "") or "trunnion"
    what, _, hint = text.partition(" Did you mean ")
    return Problem(command, what.rstrip("."), f"did you mean {hint}" if hint else f"see {command} --help")


def defect_text(error: Exception, verbose: bool) -> str:
    """A short report of a defect; the traceback only when asked for."""
    from engine.basics.version import version
    from engine.kernel.compiler import CompilerError

    if isinstance(error, CompilerError):
        return str(error)
    if verbose:
        import traceback

        return "".join(traceback.format_exception(error))
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    where = f" ({os.path.basename(frame.tb_frame.f_code.co_filename)}:{frame.tb_lineno})" if frame else ""
    return (
        f"internal error: {type(error).__name__}: {error}{where}\n"
        f"This is a defect of Trunnion {version()}. Please report it with the scene and this text; -v shows more."
    )
