"""Other accounts of the machine cannot read the files that a server stores, even in a folder that existed before."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from tests.service.http_servers import SMALL, Served
from trunnion.cli import main


def modes(folder: Path) -> dict[str, int]:
    """The rights of the files and folders below a folder, and of the folder itself."""
    return {str(f.relative_to(folder)): f.stat().st_mode & 0o777 for f in (folder, *folder.rglob("*"))}


def test_everything_that_a_server_and_its_workers_write_is_closed(served: Served) -> None:
    assert served.ended(served.submit(SMALL))["state"] == "done"
    found = modes(served.data)
    assert any(name.endswith(".parquet") for name in found)
    assert {name: mode for name, mode in found.items() if mode & 0o077} == {}


@pytest.mark.parametrize("mode", [0o755, 0o700])
def test_in_a_folder_that_existed_the_servers_files_are_closed_and_one_warning_closes_the_folder(
    mode: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    data = tmp_path / "my data"
    for folder in (data, data / "results", data / "other"):
        folder.mkdir()
        folder.chmod(0o755)
    (data / "webhook.secret").write_text("x")
    (data / "webhook.secret").chmod(0o644)
    data.chmod(mode)
    with caplog.at_level(logging.WARNING, "trunnion.service"):
        assert main(["serve", "--data", str(data), "--new-key", "me:admin"]) == 0
    found = modes(data)
    assert [found[name] for name in ("trunnion.db", "webhook.secret", "results", "other")] == [0o600, 0o600, 0o700, 0o755]
    told = [r.getMessage() for r in caplog.records if "chmod" in r.getMessage()]
    assert len(told) == (mode == 0o755)
    assert all(text.endswith(f"chmod go-rwx '{data}'") for text in told)
