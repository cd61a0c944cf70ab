"""Commands of other packages: an entry point names them, the program loads them only when invoked, and a missing one is reported
with a pip command."""

from __future__ import annotations

import sys
import types
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
import typer

import trunnion
from trunnion.cli import command_group, command_plugins, main
from trunnion.cli.command_declaration import click_command
from trunnion.cli.command_registry import COMMANDS, GROUPS, function_of


@pytest.fixture
def guests(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Two commands of a package that counts its own loads and calls: a function and a typer app."""
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
    found = {n: EntryPoint(n, f"guest_package:{t}", command_plugins.GROUP) for n, t in (("greet", "plain"), ("host", "app"))}
    found["gone"] = EntryPoint("gone", "package_that_is_not_there:app", command_plugins.GROUP)
    for holder in (command_plugins, command_group):
        monkeypatch.setattr(holder, "registered", lambda: found)
    return calls


def test_a_function_becomes_a_command(guests: dict[str, int], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["greet", "you", "--times", "3"]) == 0
    assert guests["plain"] == 3
    assert "hello you" in capsys.readouterr().out


def test_a_typer_app_becomes_a_group_with_its_own_exit_codes(guests: dict[str, int]) -> None:
    assert main(["host", "start", "--port", "8080"]) == 0
    assert guests["app"] == 8080
    assert main(["host", "fail"]) == 1


def test_help_lists_foreign_commands_without_loading_them(
    guests: dict[str, int], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "guest_package")
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert "greet" in out
    assert "host" in out


def test_a_registered_command_that_cannot_be_loaded_names_its_package(
    guests: dict[str, int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["gone", "x"]) == 2
    assert "repair the package of package_that_is_not_there:app" in capsys.readouterr().err


def test_every_command_of_the_registry_is_listed_declared_and_sorted_into_a_known_group() -> None:
    for name in COMMANDS:
        assert click_command(name, function_of(name)).help, name
        assert " " not in name or name.split()[0] in GROUPS, name


@pytest.mark.parametrize("package", ["sqlalchemy", "fastapi", "uvicorn", "distributed"])
def test_a_server_without_its_packages_says_which_line_brings_them(
    package: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command exists in the plain installation; the packages that it needs come with the extra."""
    for name in [m for m in sys.modules if m.startswith("trunnion.service") or m.partition(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    assert main(["serve", "--port", "0", "--data", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert f"needs {package}, which is not installed" in err
    assert "pip install 'trunnion[service]'" in err
    assert "defect" not in err


def test_to_pandas_without_pandas_says_which_line_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    run = trunnion.simulate("spherical_pendulum", until=0.1)
    swept = trunnion.sweep("spherical_pendulum", {"joints.ball.friction.mu": [0.2]}, until=0.1)
    monkeypatch.setitem(sys.modules, "pandas", None)
    for table in (run, swept):
        with pytest.raises(ImportError, match=r"pip install 'trunnion\[pandas\]'"):
            table.to_pandas()


def test_a_package_that_no_extra_brings_is_a_defect(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    found = {"greet": EntryPoint("greet", "guest_with_a_gap:go", command_plugins.GROUP)}
    for holder in (command_plugins, command_group):
        monkeypatch.setattr(holder, "registered", lambda: found)
    module = types.ModuleType("guest_with_a_gap")

    def go() -> None:
        import package_nobody_has  # type: ignore[import-not-found]  # noqa: F401

    module.go = go  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "guest_with_a_gap", module)
    assert main(["greet"]) == 1
    assert "defect of Trunnion" in capsys.readouterr().err
