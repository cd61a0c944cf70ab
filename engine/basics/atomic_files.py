"""Files that are written completely or not at all, and early checks of file names."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.optional_packages import remedy, there

PARQUET = ".parquet"
WRITERS = {PARQUET: ("pyarrow", "tables"), ".mp4": ("av", "video")}
"""{suffix: (optional package that writes such files, extra that installs the package)}."""


def destination_problems(path: str | os.PathLike[str], suffixes: Sequence[str], where: str) -> list[Problem]:
    """Problems that prevent writing ``path``, such as a suffix that is not in ``suffixes``, or a folder that is not writable.
    where: the option or argument that holds the path."""
    target = Path(path)
    text = os.fspath(path)
    if target.suffix.lower() not in suffixes:
        what = f"{text!r} ends in {target.suffix!r}" if target.suffix else f"{text!r} has no suffix"
        return [Problem(where, f"{what}, so the type of the file is unknown", f"end it in {' or '.join(suffixes)}")]
    package, extra = WRITERS.get(target.suffix.lower(), ("", ""))
    if package and not there(package):
        others = [x for x in suffixes if x not in WRITERS]
        hint = f"{remedy(extra)}{f', or end it in {others[0]}' if others else ''}"
        return [Problem(where, f"{text!r} needs the package {package}, which is not installed", hint)]
    folder = target.parent
    if target.is_dir():
        return [Problem(where, f"{text!r} is a folder", "give the name of a file")]
    if not folder.is_dir():
        return [Problem(where, f"the folder {os.fspath(folder)!r} does not exist", "create the folder, or choose another")]
    if not os.access(folder, os.W_OK):
        return [Problem(where, f"the folder {os.fspath(folder)!r} cannot be written", "choose another")]
    return []


@contextmanager
def writing(path: str | os.PathLike[str], suffixes: Sequence[str], where: str = "file") -> Iterator[Path]:
    """Yield a temporary path in the folder of ``path``. At the end of the block, the temporary file is renamed to ``path``. After
    an error, the temporary file is removed.

    Raises SceneError for an unknown suffix, a folder that is not writable, or a full disk."""
    problems = destination_problems(path, suffixes, where)
    raise_problems(problems)
    try:
        with replacing(path) as work:
            yield work
    except OSError as e:
        raise SceneError([Problem(where, f"cannot write {os.fspath(path)!r}: {e.strerror or e}")]) from e


@contextmanager
def replacing(path: str | os.PathLike[str], suffix: str = "") -> Iterator[Path]:
    """Yield a temporary path in the folder of ``path``, with links resolved. The suffix is ``suffix`` or the suffix of ``path``. At
    the end of the block, the temporary file replaces ``path`` in one step. After an error, the temporary file is removed. Does not
    catch OSError."""
    target = Path(os.path.realpath(path))
    work = target.with_name(f".{target.stem[:80]}-{os.urandom(6).hex()}{suffix or target.suffix}")
    try:
        yield work
        work.replace(target)
    finally:
        with suppress(OSError):
            work.unlink(missing_ok=True)
