"""Runs a command, reports its problems, failures or defect, and chooses the exit code."""

from __future__ import annotations

import os
import sys

import typer

from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.optional_packages import Missing, brings, extra_of, remedy
from trunnion.basics.renamed_words import deprecation_notes
from trunnion.cli.command_group import COMMAND
from trunnion.cli.command_registry import extra_of_command
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED, error_lines, failure_end, problems_end

INTERRUPTED = 130
"""Value that newer versions of typer return after Ctrl-C. Older versions raise Abort."""
USAGE_ERROR: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")  # type: ignore[assignment]
"""Exception that typer raises for invalid arguments (typer's own copy of click's class, or click's class)."""


def run(arguments: list[str]) -> int:
    """Run the command that the arguments name, and return its exit code. Deprecated words are reported on standard error."""
    with deprecation_notes() as notes:
        code = run_command(arguments)
    error_lines(notes)
    return code


def run_command(arguments: list[str]) -> int:
    """Run the command that the arguments name, and return its exit code."""
    given = arguments[: arguments.index("--")] if "--" in arguments else arguments
    as_json, verbose = "--json" in given, any(a in ("-v", "--verbose") for a in given)
    try:
        code = COMMAND.main(arguments, prog_name="trunnion", standalone_mode=False)
        if code == INTERRUPTED:
            raise KeyboardInterrupt
    except SceneError as e:
        return problems_end(e.problems, as_json)
    except USAGE_ERROR as e:
        return problems_end([usage_problem(e)], as_json)
    except SimulationError as e:
        return failure_end(str(e), as_json)
    except ImportError as e:
        problem = missing_package(e, arguments)
        return problems_end([problem], as_json) if problem else failure_end(defect_text(e, verbose), as_json)
    except (KeyboardInterrupt, typer.Abort):
        return failure_end("cancelled before the first results", as_json)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115  # nothing reads our output any more
        return FAILED
    except Exception as e:  # noqa: BLE001  # every other exception is a defect of Trunnion
        return failure_end(defect_text(e, verbose), as_json)
    return code if isinstance(code, int) else DONE


def usage_problem(error: Exception) -> Problem:
    """The problem that typer found, with the command, the mistake and the remedy."""
    text = getattr(error, "format_message", lambda: str(error))().strip()
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "") or "trunnion"
    what, _, hint = text.partition(" Did you mean ")
    return Problem(command, what.rstrip("."), f"did you mean {hint}" if hint else f"see {command} --help")


def missing_package(error: ImportError, words: list[str]) -> Problem | None:
    """The problem of a missing package that an extra installs. None if no extra installs the package. The missing package is then a
    defect."""
    command = next((w for w in words if not w.startswith("-")), "")
    own, module = extra_of_command(command), error.name or ""
    extra = own if brings(own, module) else error.extra if isinstance(error, Missing) else extra_of(module)
    if not extra:
        return None
    what = f"needs the package {module.partition('.')[0]}, which is not installed"
    return Problem(f"trunnion {command}".rstrip(), what, remedy(extra))


def defect_text(error: Exception, verbose: bool) -> str:
    """A short report of a defect or, with ``verbose``, the traceback."""
    from trunnion.basics.version import version
    from trunnion.kernel.compilation.c_compiler import CompilerError

    if isinstance(error, CompilerError):
        return str(error)
    if verbose:
        import traceback

        return "".join(traceback.format_exception(error))
    frames = []
    at = error.__traceback__
    while at is not None:
        frames.append((os.path.basename(at.tb_frame.f_code.co_filename), at.tb_lineno, at.tb_frame.f_code.co_name))
        at = at.tb_next
    declared = next((f"{file}:{line}" for file, line, name in reversed(frames) if name == "<module>"), "")
    if declared:  # the error arose while a module of the package was imported
        return f"{declared}: cannot be imported: {error}\n    → correct this declaration, or install Trunnion again"
    where = f" ({frames[-1][0]}:{frames[-1][1]})" if frames else ""
    return (
        f"internal error: {type(error).__name__}: {error}{where}\n"
        f"This is a defect of Trunnion {version()}. Please report it with the scene and this text; -v shows more."
    )
