"""Builds wheels for several platforms on one machine: ``python -m trunnion.packaging.platform_wheels -o FOLDER [PLATFORM ...]``.

The compiler compiles for each platform on any other platform. Equal sources give equal bytes in each build. The file
``SHA256SUMS`` beside the wheels has their checksums."""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
from pathlib import Path

from trunnion.kernel.compilation.c_compiler import MACHINES

ROOT = Path(__file__).resolve().parents[2]
BUILD = "import sys; sys.path.insert(0, 'engine/packaging'); import build_backend; print(build_backend.build_wheel(sys.argv[1]))"
EPOCH = "315532800"
"""Time of all files in a wheel (SOURCE_DATE_EPOCH). The value is 1980-01-01, the earliest time that an archive can hold."""
SUMS = "SHA256SUMS"


def build(platform: str, folder: Path) -> Path:
    """Build the wheel for a platform (a key of ``MACHINES``) in a folder. Returns the path of the wheel."""
    env = dict(os.environ, TRUNNION_PLATFORM=platform, TRUNNION_PREBUILD="1", SOURCE_DATE_EPOCH=EPOCH)
    words = [sys.executable, "-c", BUILD, str(folder.resolve())]
    done = subprocess.run(words, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True, check=True, umask=0o022)
    return folder / done.stdout.split()[-1]


def write_checksums(folder: Path) -> None:
    """Write the checksums of all wheels of a folder, in the form that ``sha256sum -c`` reads."""
    wheels = sorted(folder.glob("*.whl"))
    (folder / SUMS).write_text("".join(f"{hashlib.sha256(w.read_bytes()).hexdigest()}  {w.name}\n" for w in wheels))


def main() -> None:
    """Build the wheels of the named platforms (by default, all platforms), and write their checksums."""
    asked = argparse.ArgumentParser(prog="python -m trunnion.packaging.platform_wheels", description=main.__doc__)
    asked.add_argument("-o", dest="folder", type=Path, required=True, help="folder of the wheels")
    asked.add_argument("platforms", nargs="*", metavar="PLATFORM", help=f"default: {' '.join(MACHINES)}")
    given = asked.parse_args()
    unknown = sorted(set(given.platforms) - set(MACHINES))
    if unknown:
        asked.error(f"unknown platforms: {', '.join(unknown)}; choose from {', '.join(MACHINES)}")
    given.folder.mkdir(parents=True, exist_ok=True)
    for platform in given.platforms or MACHINES:
        wheel = build(platform, given.folder)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
    write_checksums(given.folder)


if __name__ == "__main__":
    main()
