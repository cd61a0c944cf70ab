"""Commands of other packages: found by entry point, loaded only when invoked, missed with a pip line."""

from __future__ import annotations

import sys
import types
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
import typer

import engine
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


@pytest.mark.parametrize("package", ["sqlalchemy", "fastapi", "uvicorn", "distributed"])
def test_a_server_without_its_packages_says_which_line_brings_them(
    package: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command is there with the plain installation; the packages it needs come with the extra."""
    for name in [m for m in sys.modules if m.partition(".")[0] in ("service", package)]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(extensions, "registered", lambda: {"serve": EntryPoint("serve", "service.cli:serve", extensions.GROUP)})
    assert main(["serve", "--port", "0", "--data", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert f"needs {package}, which is not installed" in err
    assert "pip install 'trunnion[service]'" in err
    assert "defect" not in err


def test_to_pandas_without_pandas_says_which_line_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    run = engine.simulate("spherical_pendulum", until=0.1)
    swept = engine.sweep("spherical_pendulum", {"joints.ball.friction.mu": [0.2]}, until=0.1)
    monkeypatch.setitem(sys.modules, "pandas", None)
    for table in (run, swept):
        with pytest.raises(ImportError, match=r"pip install 'trunnion\[pandas\]'"):
            table.to_pandas()


def test_a_package_that_no_extra_brings_is_a_defect(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(extensions, "registered", lambda: {"greet": EntryPoint("greet", "guest_with_a_gap:go", extensions.GROUP)})
    module = types.ModuleType("guest_with_a_gap")

    def go() -> None:
        import package_nobody_has  # type: ignore[import-not-found]  # noqa: F401

    module.go = go  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "guest_with_a_gap", module)
    assert main(["greet"]) == 1
    assert "defect of Trunnion" in capsys.readouterr().err
