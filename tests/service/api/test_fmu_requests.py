"""POST /v1/fmus gives the FMU that ``trunnion.fmu.scene_export`` writes."""

from __future__ import annotations

import io
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tests.service.http_servers import InProcess, unstarted
from trunnion.service.basics.server_settings import Limits, Settings


def test_an_fmu_is_exported_and_downloaded(server: InProcess) -> None:
    pytest.importorskip("trunnion.fmu.scene_export", reason="this checkout has no FMU exporter")
    answer = server.post("/v1/fmus", {"scene": "spherical_pendulum", "flavour": "python"})
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/vnd.fmi.fmu"
    assert "modelDescription.xml" in zipfile.ZipFile(io.BytesIO(answer.content)).namelist()
    assert not list(server.service.settings.data.glob("fmu-*"))


@pytest.mark.slow
def test_fmi_3_can_be_requested_and_unsupported_options_are_reported(server: InProcess) -> None:
    answer = server.post("/v1/fmus", {"scene": "spherical_pendulum", "fmi": 3})
    assert answer.status_code == 200, answer.text
    with zipfile.ZipFile(io.BytesIO(answer.content)) as z:
        assert b'fmiVersion="3.0"' in z.read("modelDescription.xml")
        assert any(n.startswith("binaries/x86_64-linux/") for n in z.namelist()) or not any("linux" in n for n in z.namelist())
    refused = server.post("/v1/fmus", {"scene": "spherical_pendulum", "fmi": 3, "flavour": "python"})
    assert refused.status_code == 422
    assert "pythonfmu writes FMI 2.0 only" in refused.text
    assert server.post("/v1/fmus", {"scene": "spherical_pendulum", "fmi": 4}).status_code == 422


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
def test_an_fmu_that_needs_too_much_memory_is_given_up(tmp_path: Path) -> None:
    with unstarted(Settings(tmp_path, limits=Limits(memory=1e8))) as s:  # twice this is too little to load the exporter
        answer = s.post("/v1/fmus", {"scene": "spherical_pendulum"})
        assert (answer.status_code, answer.json()["problems"][0]["where"]) == (422, "body")
        assert not any(c.process.is_alive() for c in s.service.exports.workers if c.process)


def test_a_server_without_the_fmu_package_names_it(server: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    async def gone(*given: Any, **more: Any) -> Any:
        raise ImportError("trunnion.fmu.scene_export")

    monkeypatch.setattr(server.service.exports, "ask", gone)
    answer = server.post("/v1/fmus", {"scene": "spherical_pendulum"})
    assert answer.status_code == 501
    assert "trunnion[fmu]" in answer.json()["problems"][0]["hint"]
