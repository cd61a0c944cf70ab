"""Readers of triangle meshes: STL, OBJ, and MuJoCo's MSH."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from trunnion.importers.xml_reader import is_file

LARGEST = 200_000_000
"""Largest size of a mesh file in bytes."""
ABOVE = 4
"""Number of parent folders of a robot file in which a named package is searched."""
STL = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("more", "<u2")])


class Unreadable(ValueError):
    """A mesh cannot be read. The text of the exception is the reason."""


def triangles(path: Path) -> np.ndarray:
    """Corners of a mesh's triangles (n×3×3), in the units of the file. Raises Unreadable if the file is too large or damaged, or if
    its format is unknown."""
    if path.stat().st_size > LARGEST:
        raise Unreadable(f"it is larger than {LARGEST // 1_000_000} MB")
    content, kind = path.read_bytes(), path.suffix.lower()
    if kind not in READERS:
        raise Unreadable(f"{kind or 'a file without suffix'} is not one of {', '.join(READERS)}")
    try:
        return READERS[kind](content)
    except (ValueError, IndexError, UnicodeDecodeError) as e:
        raise Unreadable(f"it is damaged: {e}") from e


def _stl(content: bytes) -> np.ndarray:
    count = int.from_bytes(content[80:84], "little")
    if len(content) == 84 + STL.itemsize * count:
        return np.frombuffer(content, STL, count, 84)["points"].astype(float)
    words = content.decode("ascii").split()
    corners = [[float(x) for x in words[i + 1 : i + 4]] for i, word in enumerate(words) if word == "vertex"]
    return np.array(corners, float).reshape(-1, 3, 3)


def _obj(content: bytes) -> np.ndarray:
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for line in content.decode("utf-8", "replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            at = [int(w.split("/")[0]) for w in words[1:]]
            ring = [i - 1 if i > 0 else len(vertices) + i for i in at]
            faces += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
    return np.array(vertices, float)[np.array(faces, int).reshape(-1, 3)]


def _msh(content: bytes) -> np.ndarray:
    """Triangles of MuJoCo's format: counts of vertices, normals, texture coordinates and faces, then the data in this order."""
    nv, nn, nt, nf = np.frombuffer(content, "<i4", 4)
    points = np.frombuffer(content, "<f4", 3 * nv, 16).reshape(-1, 3).astype(float)
    faces = np.frombuffer(content, "<i4", 3 * nf, 16 + 4 * (3 * nv + 3 * nn + 2 * nt)).reshape(-1, 3)
    return points[faces]


READERS = {".stl": _stl, ".obj": _obj, ".msh": _msh}


def found(folder: Path, name: str) -> Path | None:
    """Path of the mesh that a file in ``folder`` names; None if there is no such mesh. ``name`` is relative to ``folder``. With
    package:// or model://, the parent folders are searched, too."""
    plain = name.split("://", 1)[-1]
    _, _, inside = plain.partition("/")
    around = [folder, *list(folder.parents)[:ABOVE]] if "://" in name else [folder]
    tries = [base / part for base in around for part in (plain, inside) if part]
    return next((p for p in tries if p.suffix.lower() in READERS and is_file(p)), None)
