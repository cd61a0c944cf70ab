"""Writer of the FMU file, a zip archive whose bytes depend only on its contents."""

from __future__ import annotations

import zipfile
from pathlib import Path

from trunnion.basics.atomic_files import replacing

FIRST = ("modelDescription.xml", "model.png")
MOMENT = (1980, 1, 1, 0, 0, 0)


def write(target: Path, contents: dict[str, bytes]) -> None:
    """Write the archive to a temporary file and move it to its place, so that no reader sees an incomplete file."""
    order = [*(n for n in FIRST if n in contents), *sorted(n for n in contents if n not in FIRST)]
    with replacing(target) as work, zipfile.ZipFile(work, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as z:
        for name in order:
            info = zipfile.ZipInfo(name, MOMENT)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3
            info.external_attr = (0o755 if name.endswith((".so", ".dll", ".dylib")) else 0o644) << 16
            z.writestr(info, contents[name])
