"""Commands of other packages: found by entry point, loaded only when invoked, missed with a pip line."""

from __future__ import annotations

import sys
import types
from importlib.metadata import EntryPoint

import pytest
import typer

from engine.cli import extensions, main


@pytest.fixture
def guests(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Two commands of a package that counts what happens to it: a function and a typer app."""
    calls = {"plain": 0, "app": 0}
    module = types.ModuleType("guest_package")

    def plain(name: str, times: int = 1) -> None:
        calls["plain"] += times
        typer.echo(f"hello {name}")

    app = typer.Typer()

    @app.command()
    def start(port: int = 80) -> None:
        calls["app"] = port

    @app.command()
    def fail() -> None:
        raise typer.Exit(1)

    module.plain, module.app = plain, app  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "guest_package", module)
    found = {n: EntryPoint(n, f"guest_package:{t}", extensions.GROUP) for n, t in (("greet", "plain"), ("serve", "app"))}
    found["fmu"] = EntryPoint("fmu", "package_that_is_not_there:app", extensions.GROUP)
    monkeypatch.setattr(extensions, "registered", lambda: found)
    return calls


def test_a_function_becomes_a_command(guests: dict[str, int], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["greet", "you", "--times", "3"]) == 0
    assert guests["plain"] == 3
    assert "hello you" in capsys.readouterr().out


def test_a_typer_app_becomes_a_group_with_its_own_exit_codes(guests: dict[str, int]) -> None:
    assert main(["serve", "start", "--port", "8080"]) == 0
    assert guests["app"] == 8080
    assert main(["serve", "fail"]) == 1


def test_help_lists_foreign_commands_without_loading_them(
    guests: dict[str, int], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "guest_package")
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert "greet" in out
    assert "serve" in out


def test_a_registered_command_that_cannot_be_loaded_names_its_extra(
    guests: dict[str, int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fmu", "x"]) == 2
    assert "pip install 'trunnion[fmu]'" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["fmu", "serve", "jobs"])
def test_a_command_that_is_not_installed_prints_its_pip_line(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extensions, "registered", dict)
    assert main([name, "anything"]) == 2
    assert f"pip install 'trunnion[{extensions.EXTRAS[name][0]}]'" in capsys.readouterr().err
