"""Every command is declared. If a package that a command needs is missing, the command reports it with a pip command."""

from __future__ import annotations

import sys
import types
from pathlib import Path

import pytest

import trunnion
from trunnion.cli import main
from trunnion.cli.command_declaration import click_command
from trunnion.cli.command_registry import COMMANDS, GROUPS, function_of


def test_every_command_of_the_registry_is_listed_declared_and_sorted_into_a_known_group() -> None:
    for name in COMMANDS:
        assert click_command(name, function_of(name)).help, name
        assert " " not in name or name.split()[0] in GROUPS, name


@pytest.mark.parametrize("package", ["sqlalchemy", "fastapi", "uvicorn", "distributed"])
def test_a_server_without_its_packages_names_the_line_that_installs_them(
    package: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plain installation contains the command; an extra installs the packages that the command needs."""
    for name in [m for m in sys.modules if m.startswith("trunnion.service") or m.partition(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    assert main(["serve", "--port", "0", "--data", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert f"needs {package}, which is not installed" in err
    assert "pip install 'trunnion[service]'" in err
    assert "defect" not in err


def test_conversion_to_pandas_without_pandas_names_the_line_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    run = trunnion.simulate("spherical_pendulum", until=0.1)
    swept = trunnion.sweep("spherical_pendulum", {"joints.ball.friction.mu": [0.2]}, until=0.1)
    monkeypatch.setitem(sys.modules, "pandas", None)
    for table in (run, swept):
        with pytest.raises(ImportError, match=r"pip install 'trunnion\[pandas\]'"):
            table.to_pandas()


def test_a_package_that_no_extra_brings_is_a_defect(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    module = types.ModuleType("guest_with_a_gap")

    def go() -> None:
        """Import a package that does not exist."""
        import package_nobody_has  # type: ignore[import-not-found]  # noqa: F401

    module.go = go  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "guest_with_a_gap", module)
    monkeypatch.setitem(COMMANDS, "greet", "guest_with_a_gap:go")
    assert main(["greet"]) == 1
    assert "defect of Trunnion" in capsys.readouterr().err
