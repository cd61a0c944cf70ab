"""Makes commands from functions. The module adds ``--verbose``, the options of run settings, a common help format, and the old
names of renamed options."""

from __future__ import annotations

import inspect
import logging
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from trunnion.basics.renamed_words import current_options
from trunnion.basics.setting_declarations import Setting, offered
from trunnion.cli.options import completion
from trunnion.cli.options.option_declarations import SettingWords, repeatable

OPEN = {"ignore_unknown_options": True, "allow_extra_args": True}
"""Context settings with which click passes unknown words to the command. The command reports unknown words together with all other
problems."""
VERBOSE = typer.Option("-v", "--verbose", help="Print the log to standard error, with the details of internal errors.")


class DeclaredCommand(TyperCommand):
    """A command with the common help format. The command also accepts the old names of renamed options."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words after translating renamed options."""
        known = {o for p in self.params for o in (*p.opts, *p.secondary_opts)}
        take_as_given(self.get_params(ctx))
        return super().parse_args(ctx, current_options(args, known))

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments, then options."""
        for title, kind in (("Arguments", "argument"), ("Options", "option")):
            parameters: list[Any] = self.get_params(ctx)
            shown = [p for p in parameters if p.param_type_name == kind and not p.hidden]
            if shown:
                with formatter.section(title):
                    formatter.write_dl([(spelling(p), meaning(p)) for p in shown])


class AsGiven:
    """Takes the place of typer's conversion of texts and flags. That conversion would import pydantic and change nothing."""

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The value of an argument or option: a list for a repeatable option, None for an option that is not given."""
        return list(value or ()) if param.multiple else value


class GivenOnly:
    """Takes the place of typer's conversion of an option to a number. The class makes typer's conversion only if the option is
    given."""

    def __init__(self, make: Callable[[], Any]):
        self._make = make

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The number; None if the option is not given."""
        return None if value is None else self._make().coerce(value, param=param, ctx=ctx)


def take_as_given(parameters: Sequence[Any]) -> None:
    """Remove typer's conversion of arguments and options whose values are texts or flags. Earlier versions of typer have no such
    conversion."""
    for p in parameters:
        kind = getattr(getattr(p, "type_descriptor", None), "annotation", None)
        if kind in (str, list[str]) or (kind is bool and not p.envvar):
            p.get_runtime_param = AsGiven
        elif kind in (float, int) and not p.multiple:
            p.get_runtime_param = partial(GivenOnly, p.get_runtime_param)


def spelling(p: Any) -> str:
    """The text by which a user writes an argument, or an option with its value."""
    if p.param_type_name == "argument":
        return str(p.metavar)
    names = ", ".join(sorted(p.opts, key=len)) + "".join(f" / {o}" for o in p.secondary_opts)
    return names if p.is_flag else f"{names} {p.metavar}"


def meaning(p: Any) -> str:
    """The help of an argument or option, followed by notes: repeatable, default, environment variable."""
    notes = ["repeatable"] if getattr(p, "multiple", False) else []
    default = p.show_default if isinstance(p.show_default, str) else p.default
    if p.secondary_opts:
        default = (p.opts if default else p.secondary_opts)[0]
    if isinstance(default, str | int | float) and not isinstance(default, bool) and default != "":
        notes.append(f"default: {default}")
    if p.envvar:
        notes.append(f"environment: {p.envvar}")
    text = p.help or ""
    text = text.format_map(completion.registry_words()) if "{" in text else text
    return text + (f" ({'; '.join(notes)})" if notes else "")


def click_command(name: str, function: Callable[..., Any]) -> Any:
    """The click command of a function. name: the words after ``trunnion``. A parameter ``settings`` receives the values of all
    run settings that the command offers. A parameter ``ctx`` receives the words that click does not recognise."""
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    unknown = OPEN if "ctx" in inspect.signature(function).parameters else {}
    app.command(name.split()[-1], cls=DeclaredCommand, context_settings=unknown)(with_common_options(name, function))
    return typer.main.get_command(app)


def with_common_options(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with ``--verbose``, and with one option for each run setting in place of its parameter ``settings``."""
    who = f"trunnion {name}"
    options = [option_of(s, who) for s in offered(who)]
    declared = inspect.signature(function, eval_str=True).parameters
    if ("settings" in declared) != bool(options):
        raise ValueError(f"{who}: a command has the parameter `settings` if and only if settings name the command in `offered`")
    parameters: list[inspect.Parameter] = []
    for p in declared.values():
        parameters += options if p.name == "settings" else [p]
    parameters.append(keyword("verbose", bool, VERBOSE, False))

    def called(**given: Any) -> Any:
        if given.pop("verbose"):
            log_to_stderr()
        if options:
            given["settings"] = SettingWords(who, {o.name: given.pop(o.name) for o in options})
        return function(**given)

    parameters = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in parameters]
    called.__doc__ = function.__doc__
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {p.name: p.annotation for p in parameters}
    return called


def option_of(s: Setting, who: str) -> inspect.Parameter:
    """The option of a run setting for a command that offers this setting."""
    name, several = f"--{s.name.replace('_', '-')}", who in s.several
    complete = completion.registered(s.words) if s.words else None
    declare: Any = repeatable if several else typer.Option
    option = declare(name, metavar=s.metavar, help=s.text, show_default=s.default_at(who), autocompletion=complete)
    kind: Any = list[str] if several else str | None
    return keyword(s.name, kind, option, inspect.Parameter.empty if several else None)


def keyword(name: str, kind: Any, option: Any, default: Any) -> inspect.Parameter:
    """A keyword parameter of the command's function, with its option."""
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, option])


def log_to_stderr() -> None:
    """Print the engine's log on standard error."""
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(name)s: %(message)s")
    logging.getLogger("trunnion").setLevel(logging.DEBUG)
