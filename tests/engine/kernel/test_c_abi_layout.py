"""Each number and layout that C and Python share is stated only once. C lays out data as Python reads the data, and no other code
repeats the numbers."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import pytest

from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.shared_libraries import RUNTIME, write_headers
from trunnion.runtime.abi import Status, c_header, run_records
from trunnion.runtime.abi.c_header import number, records
from trunnion.runtime.abi.kernel_records import KERNEL, PAIR
from trunnion.runtime.abi.record_definition import Record
from trunnion.scene import load_scene
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl

NATIVE = RUNTIME.parents[1] / "fmu" / "native"
SOURCES = sorted([*RUNTIME.rglob("*.[ch]"), *NATIVE.rglob("*.[ch]")])
BARE = {
    "a numbered field of a pair or an element": r"\b(?:sl|el|ell)\[\d\]|tr_pair_of\([^)]*\)\[",
    "a stride of a record": r"\b(?:4|7|9|10|24|32) \* (?:i|m|input|slider|k->|s->|pair->)|\[3 \* (?:i|m|ml)(?: \+ \d)?\]",
    "a flag compared with a half": r"[<>]=? ?[01]\.5\b(?! \*)",
    "a sentinel": r"== [2-9]\.0\b|pending(?:\.kind)? [!=]= \d|return [23]\.0;",
    "an array by its number": r"tr_array\([^,]*, \d",
    "a bare status": r"status (?:==|>=|!=) [1-9]",
}
"""Patterns of code that repeats a layout or a number."""


def test_the_compiler_lays_records_out_as_python_reads_them(tmp_path: Path) -> None:
    write_headers(tmp_path)
    lines = ['#include <stddef.h>\n#include "tr_abi.h"']
    for r in records():
        lines.append(f'_Static_assert(sizeof({r.tag}) == {ctypes.sizeof(r.ctype)}, "{r.tag}");')
        lines += [f'_Static_assert(offsetof({r.tag}, {n}) == {getattr(r.ctype, n).offset}, "{r.tag}.{n}");' for n in r.names]
    assert len(lines) > 200
    (tmp_path / "layout.c").write_text("\n".join(lines))
    c_compiler.build_library([tmp_path / "layout.c"], tmp_path / "layout.so", [tmp_path], library_cache.cache_folder())


def test_numpy_reads_records_of_doubles_as_ctypes_does() -> None:
    plain = [r for r in records() if {f.base for f in r.fields} <= {"double", "tr_turn", "tr_last"}]
    assert len(plain) > 12
    for r in plain:
        assert r.dtype.itemsize == ctypes.sizeof(r.ctype), r.tag
        assert [r.at(n) * 8 for n in r.names] == [getattr(r.ctype, n).offset for n in r.names]


def test_the_number_follows_the_layout_and_not_the_words(monkeypatch: pytest.MonkeyPatch) -> None:
    def numbered(mode: Record) -> int:
        c_header.body.cache_clear(), number.cache_clear()
        monkeypatch.setattr(run_records, "MODE", mode)
        return number()

    def mode(first: str, tilt: str) -> Record:
        return Record("tr_mode", "Mode.", f"double {first} : words\ndouble direction[3]\ndouble {tilt} : of a ball")

    before = number()
    same, renamed, other = (numbered(mode(*x)) for x in (("flag", "tilt"), ("state", "tilt"), ("flag", "tilt[2]")))
    monkeypatch.undo()
    c_header.body.cache_clear(), number.cache_clear()
    assert same == before == number()
    assert len({before, renamed, other}) == 3


def test_a_kernel_of_another_number_is_refused() -> None:
    model = Model(load_scene("simple_pendulum"))
    table = KERNEL.ctype.from_address(model.kernel.address("kernel"))
    copy = KERNEL.ctype.from_buffer_copy(table)
    memory = (ctypes.c_double * (model.block.bytes // 8 + 4))()
    outputs, sizes = model.kernel.address("outputs"), model.block._sizes
    at, lib = ctypes.addressof(memory), model.block.lib
    assert lib.tr_init(at, ctypes.addressof(copy), outputs, None, *sizes)
    copy.abi += 1
    assert not lib.tr_init(at, ctypes.addressof(copy), outputs, None, *sizes)


def test_a_row_with_a_field_missing_or_unknown_is_refused() -> None:
    given = dict.fromkeys(PAIR.names, 0)
    assert PAIR.row(**given) == (0,) * len(PAIR.names)
    with pytest.raises(TypeError, match="tr_pair: fields that do not match: cone"):
        PAIR.row(**{k: v for k, v in given.items() if k != "cone"})
    with pytest.raises(TypeError, match="colour"):
        PAIR.row(**given, colour=1)


@pytest.mark.default_cases(5)
@pytest.mark.parametrize("what", BARE)
def test_no_c_file_knows_a_layout_a_second_time(what: str) -> None:
    found = [
        f"{file.name}:{i}: {line.strip()}"
        for file in SOURCES
        for i, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(BARE[what], re.sub(r"/\*.*?\*/", "", line))
    ]
    assert not found, "\n".join(found)


def test_statistics_have_a_counter_for_every_method_and_events_a_name() -> None:
    model = Model(load_scene("simple_pendulum"))
    assert set(bl.METHODS) - {"auto"} <= set(model.block.statistics())
    assert bl.OK == Status.OK == 0
