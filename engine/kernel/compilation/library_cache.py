"""The kernel cache holds compiled libraries, by a digest of everything that determines them. The size of the cache is bounded, and
concurrent builds are safe. An entry is a folder ``<kind>-<key>``. The folder is written under a temporary name, and renamed when it
is complete. If two processes build the same entry, both succeed, and one copy is discarded. The compiler's shared cache (``zig-…``,
and ``zig`` of older versions) is pruned like an entry. If the shared cache is pruned during a build, the build continues without
it. """

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from platformdirs import user_cache_path

MAX_BYTES = 512 * 1024 * 1024
STALE_SECONDS = 3600.0
RECENT_SECONDS = 60.0
"""An entry is not pruned within this time, s, after its last use, because a process may be about to load the entry."""
COMPILER_SECONDS = 600.0
"""The compiler's cache is not pruned within this time, s, after the last start of a build. Builds take less time."""


def cache_folder() -> Path:
    """The folder of the cache, created with mode 0700. The folder is TRUNNION_CACHE or, without this variable, the user's cache
    folder of the platform. If that folder is not writable, the result is a private temporary folder."""
    chosen = os.environ.get("TRUNNION_CACHE")
    try:
        home = Path(chosen) if chosen else user_cache_path("trunnion", appauthor=False)
        home.mkdir(parents=True, exist_ok=True, mode=0o700)
        if not os.access(home, os.W_OK):
            raise OSError
    except (OSError, RuntimeError):
        home = _private_temporary()
    return home


def _private_temporary() -> Path:
    """A folder for this process alone. Everyone can write to the parent folder, so the name is random and cannot be guessed."""
    global _temporary
    if _temporary is None:
        _temporary = Path(tempfile.mkdtemp(prefix="trunnion-"))
    return _temporary


_temporary: Path | None = None


def digest(*parts: str | bytes) -> str:
    """The key of an entry: a digest of everything that determines the content of the entry."""
    h = hashlib.sha256()
    for p in parts:
        data = p.encode() if isinstance(p, str) else p
        h.update(len(data).to_bytes(8, "little"))
        h.update(data)
    return h.hexdigest()[:32]


def digest_of_files(root: Path, folders: Sequence[str], suffixes: tuple[str, ...]) -> str:
    """Digest of the content of all files with these suffixes in folders below ``root``, in the order of their paths. The result is
    stored under the names, sizes, inode numbers and times of all files, so that unchanged files are not read again."""
    files = [e for folder in folders for e in _files(os.path.join(root, folder), suffixes)]
    found = sorted((e.path.split(os.sep), e.path, e.stat()) for e in files)  # the same order on all systems
    state = ((path, s.st_size, s.st_ino, s.st_mtime_ns, s.st_ctime_ns) for _, path, s in found)

    def make(folder: Path) -> None:
        (folder / "digest").write_text(digest(*(Path(path).read_bytes() for _, path, _ in found)))

    return (entry(f"sources-{digest(repr([*state]))}", make)[0] / "digest").read_text()


def _files(folder: str, suffixes: tuple[str, ...]) -> Iterator[os.DirEntry[str]]:
    """The files with these suffixes in a folder and the folders below it."""
    with os.scandir(folder) as entries:
        for e in entries:
            if e.name == "__pycache__":
                continue
            if e.is_dir():
                yield from _files(e.path, suffixes)
            elif e.name.endswith(suffixes):
                yield e


def entry(name: str, make: Callable[[Path], None]) -> tuple[Path, bool]:
    """Folder of the entry ``name``. If the entry is missing, ``make(folder)`` fills a new folder. Returns the folder, and whether
    this call made the folder."""
    home = cache_folder()
    folder = home / name
    if (folder / "complete").exists():
        with suppress(OSError):
            os.utime(folder)
        return folder, False
    work = Path(tempfile.mkdtemp(prefix=f".{name}-", dir=home))
    try:
        make(work)
        (work / "complete").touch()
        with suppress(OSError):
            work.rename(folder)
        if not (folder / "complete").exists():
            shutil.rmtree(folder, ignore_errors=True)
            work.rename(folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    _prune_now_and_then(home)
    return folder, True


def _prune_now_and_then(home: Path) -> None:
    """Prune the cache at most once per ``RECENT_SECONDS`` in this process. Entries younger than this time are never pruned. Reading
    thousands of entries takes longer than a small build."""
    now = time.monotonic()
    if now - _pruned.get(home, -RECENT_SECONDS) >= RECENT_SECONDS:
        _pruned[home] = now
        prune(home)


_pruned: dict[Path, float] = {}
"""For each cache folder, the time of the last pruning by this process (monotonic clock, s)."""


def prune(home: Path, max_bytes: int = MAX_BYTES) -> None:
    """Remove abandoned work folders. Then remove the least recently used entries until the rest fits into ``max_bytes``."""
    now = time.time()
    entries: list[tuple[float, int, Path]] = []
    for path in home.iterdir():
        with suppress(OSError):
            if path.name.startswith(".") and path.is_dir():
                if now - path.stat().st_mtime > STALE_SECONDS:
                    shutil.rmtree(path, ignore_errors=True)
            elif (path / "complete").exists() or _is_compilers(path):
                entries.append((path.stat().st_mtime, _size(path), path))
    total = sum(size for _, size, _ in entries)
    for used, size, path in sorted(entries):
        if total <= max_bytes:
            break
        if now - used > (COMPILER_SECONDS if _is_compilers(path) else RECENT_SECONDS):
            _remove(path)
            total -= size


def _is_compilers(path: Path) -> bool:
    """Whether the path is a cache of the compiler. A link to such a cache does not count."""
    return path.name.partition("-")[0] == "zig" and path.is_dir() and not path.is_symlink()


def _size(path: Path) -> int:
    """Bytes of all files in a folder. A file that disappears during the count does not count."""
    total = 0
    with suppress(OSError), os.scandir(path) as found:  # os.walk takes a quarter of the time of rglob
        for f in found:
            with suppress(OSError):
                total += _size(Path(f.path)) if f.is_dir(follow_symlinks=False) else f.stat().st_size if f.is_file() else 0
    return total


def _remove(path: Path) -> None:
    """Rename a folder, then delete it. The new name ensures that no process finds a partly deleted folder."""
    trash = path.with_name(f".{path.name}-{os.getpid()}-{time.monotonic_ns()}")
    with suppress(OSError):
        path.rename(trash)
        shutil.rmtree(trash, ignore_errors=True)
