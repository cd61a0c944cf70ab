"""The python flavour in a host that is not Python: a C program that loads libpython."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest
from fmpy import extract, read_model_description

from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host
from tests.fmu.native.test_c_hosts import built

SOURCE = Path(__file__).with_name("embedded_python_host.c")


def pythons() -> list[tuple[str, Path]]:
    """(home, its libpython) of this Python, and of other installed Python versions from 3.9 on."""
    own = Path(sys.base_prefix)
    homes = {own, *own.parent.glob("3.*")} if own.name.startswith("3.") else {own}
    found = {f.name: (str(home), f) for home in sorted(homes) for f in home.glob("lib/libpython3.*.so.1.0")}
    return [found[name] for name in found if int(re.sub(r"\D", "", name.split(".")[1])) >= 9]


@pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="loads the linux64 library")
@pytest.mark.skipif(not pythons(), reason="no Python here has a shared library")
def test_a_host_that_is_not_python_ends_when_it_is_done(tmp_path: Path) -> None:
    """The test uses every available libpython. At the end of the process, some versions wait for the thread in which the module
    ``threading`` was imported."""
    file = exported("spherical_pendulum", "python")
    folder = Path(extract(str(file), str(tmp_path / "fmu")))
    host = built("x86_64-linux-gnu.2.17", tmp_path / "host", SOURCE)
    library = next((folder / "binaries" / "linux64").glob("spherical_pendulum.so"))
    told = [library, read_model_description(file).guid, (folder / "resources").as_uri(), "3"]
    inside = Host(file)
    expected = inside.run(0.0, 100, 0.01, inside.all_outputs()[0])[-1][0]
    for home, preloaded in pythons():
        env = dict(os.environ, LD_PRELOAD=str(preloaded), PYTHONHOME=home)
        env.pop("PYTHONPATH", None)
        done = subprocess.run([host, *told], capture_output=True, text=True, check=False, env=env, timeout=60)
        assert (done.returncode, done.stderr) == (0, ""), preloaded.name
        assert float(done.stdout) == expected, "the same bits"
