"""System libraries and versions that a shared library needs, read from the file, for 64-bit ELF, Mach-O and PE."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ELF_MACHINES = {62: "x86_64", 183: "aarch64"}
MACH_MACHINES = {0x01000007: "x86_64", 0x0100000C: "aarch64"}
PE_MACHINES = {0x8664: "x86_64", 0xAA64: "aarch64"}


@dataclass(frozen=True)
class Needs:
    """system: "linux", "macos" or "windows". libraries: names of the libraries that it loads. minimum: versions of the system that
    its symbols (Linux) or its header (macOS) require."""

    system: str
    processor: str
    libraries: frozenset[str]
    minimum: frozenset[tuple[int, ...]]


def needs(file: Path) -> Needs:
    """Needs of a library, read from the bytes of its file. Raises ValueError for any other format."""
    data = file.read_bytes()
    if data[:4] == b"\x7fELF":
        return _elf(data)
    if data[:4] == b"\xcf\xfa\xed\xfe":
        return _mach(data)
    if data[:2] == b"MZ":
        return _pe(data)
    raise ValueError(f"{file.name} is not a shared library of 64 bits")


def text_at(data: bytes, at: int) -> str:
    """The text at an offset, up to its null byte."""
    return data[at : data.index(b"\0", at)].decode()


def _elf(data: bytes) -> Needs:
    start, size, count = struct.unpack_from("<Q", data, 40)[0], *struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, start + i * size) for i in range(count)]
    libraries, versions = set(), set()
    for _, kind, _, _, at, length, link, info, _, _ in sections:
        strings = sections[link][4]
        if kind == 6:  # the section of dynamic entries
            tags = struct.iter_unpack("<qQ", data[at : at + length])
            libraries |= {text_at(data, strings + value) for tag, value in tags if tag == 1}
        elif kind == 0x6FFFFFFE:  # the section of required versions
            versions |= set(_elf_versions(data, at, strings, info))
    return Needs("linux", ELF_MACHINES[struct.unpack_from("<H", data, 18)[0]], frozenset(libraries), frozenset(versions))


def _elf_versions(data: bytes, at: int, strings: int, count: int) -> Iterator[tuple[int, ...]]:
    """The versions GLIBC_… of a section of required versions."""
    for _ in range(count):
        _, entries, _, first, following = struct.unpack_from("<HHIII", data, at)
        entry = at + first
        for _ in range(entries):
            _, _, _, name, step = struct.unpack_from("<IHHII", data, entry)
            yield tuple(map(int, text_at(data, strings + name).removeprefix("GLIBC_").split(".")))
            entry += step
        at += following


def _mach(data: bytes) -> Needs:
    processor, commands = struct.unpack_from("<I", data, 4)[0], struct.unpack_from("<I", data, 16)[0]
    libraries, versions, at = set(), set(), 32
    for _ in range(commands):
        command, size = struct.unpack_from("<II", data, at)
        if command == 0xC:  # the command names a library that the loader must load
            libraries.add(text_at(data, at + struct.unpack_from("<I", data, at + 8)[0]))
        elif command == 0x32:  # the command gives the version of the system for which the library was built
            packed = struct.unpack_from("<I", data, at + 12)[0]
            versions.add((packed >> 16, packed >> 8 & 0xFF))
        at += size
    return Needs("macos", MACH_MACHINES[processor], frozenset(libraries), frozenset(versions))


def _pe(data: bytes) -> Needs:
    header = struct.unpack_from("<I", data, 60)[0]
    machine, count, optional = *struct.unpack_from("<HH", data, header + 4), struct.unpack_from("<H", data, header + 20)[0]
    tables = header + 24 + optional
    sections = [struct.unpack_from("<IIII", data, tables + 40 * i + 8) for i in range(count)]

    def offset(address: int) -> int:
        return next(raw + address - start for size, start, length, raw in sections if start <= address < start + max(size, length))

    libraries, at = set(), struct.unpack_from("<I", data, header + 24 + 112 + 8)[0]
    entry = offset(at) if at else len(data)
    while at and (name := struct.unpack_from("<I", data, entry + 12)[0]):
        libraries.add(text_at(data, offset(name)).lower())
        entry += 20
    return Needs("windows", PE_MACHINES[machine], frozenset(libraries), frozenset())
