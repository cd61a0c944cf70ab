"""Run and time the programs of ``device_programs.py`` on an NVIDIA processor. This file needs only NumPy and the driver.

``python ensemble_run.py FOLDER [--cases N]`` loads each mechanism's program and compares the checked cases with the results from
the machine that built it. Then the script times cases whose values are drawn on this machine. It prints cases per second of wall
time of the launch, registers, and local memory. It also prints the share of threads that the processor can hold at once.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

THREADS = 128
"""Threads of a block."""
STACK_LIMIT = 10
"""Stack size of a thread (the driver's limit 0, CU_LIMIT_STACK_SIZE) as a multiple of the largest stack frame, because calls are
nested."""
PTX, CUBIN = 1, 0
"""Kinds of input of the driver's linker."""


class Device:
    """The first processor of the driver. A failing call raises RuntimeError with the driver's message."""

    def __init__(self) -> None:
        self.driver = ctypes.CDLL("libcuda.so.1")
        self.call("cuInit", 0)
        device, context = ctypes.c_int(), ctypes.c_void_p()
        self.call("cuDeviceGet", ctypes.byref(device), 0)
        self.call("cuDevicePrimaryCtxRetain", ctypes.byref(context), device)
        self.call("cuCtxSetCurrent", context)
        self.device = device

    def call(self, name: str, *arguments: Any) -> None:
        """A function of the driver."""
        status = getattr(self.driver, name)(*arguments)
        if status:
            told = ctypes.c_char_p()
            self.driver.cuGetErrorString(status, ctypes.byref(told))
            raise RuntimeError(f"{name}: {(told.value or b'').decode()} ({status})")

    def attribute(self, number: int) -> int:
        """An attribute of the processor (CUdevice_attribute)."""
        value = ctypes.c_int()
        self.call("cuDeviceGetAttribute", ctypes.byref(value), number, self.device)
        return value.value

    def linked(self, files: list[Path]) -> ctypes.c_void_p:
        """Link PTX or assembled files, and return the address of the function ``cases``."""
        link, image, size = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_size_t()
        module, function = ctypes.c_void_p(), ctypes.c_void_p()
        self.call("cuLinkCreate_v2", 0, None, None, ctypes.byref(link))
        for file in files:
            data = file.read_bytes() + b"\0"
            kind = CUBIN if file.suffix == ".cubin" else PTX
            self.call("cuLinkAddData_v2", link, kind, data, ctypes.c_size_t(len(data)), file.name.encode(), 0, None, None)
        self.call("cuLinkComplete", link, ctypes.byref(image), ctypes.byref(size))
        self.call("cuModuleLoadData", ctypes.byref(module), image)
        self.call("cuModuleGetFunction", ctypes.byref(function), module, b"cases")
        return function

    def stored(self, array: np.ndarray) -> ctypes.c_void_p:
        """A copy of an array in the processor's memory."""
        pointer = self.room(array.nbytes)
        self.call("cuMemcpyHtoD_v2", pointer, array.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(array.nbytes))
        return pointer

    def room(self, size: int) -> ctypes.c_void_p:
        """Allocate memory of the processor. size: bytes. Returns the address."""
        pointer = ctypes.c_void_p()
        self.call("cuMemAlloc_v2", ctypes.byref(pointer), ctypes.c_size_t(size))
        return pointer

    def free(self, *pointers: ctypes.c_void_p) -> None:
        """Free memory."""
        for pointer in pointers:
            self.call("cuMemFree_v2", pointer)


def made(
    device: Device, function: ctypes.c_void_p, facts: dict[str, Any], values: np.ndarray, blocks: int
) -> tuple[np.ndarray, float]:
    """Results of cases, (cases, 2 + outputs), and the wall time of the launch, s."""
    outputs = len(facts["read"])
    out = np.zeros((len(values), 2 + outputs))
    pointers = [device.stored(np.array(facts[key], dtype=np.int32)) for key in ("set", "read")]
    pointers += [device.stored(np.ascontiguousarray(values)), device.room(out.nbytes)]
    pointers.append(device.room(facts["bytes"] * blocks * THREADS))
    variables, read, given, results, structs = pointers
    arguments = [
        ctypes.c_long(len(values)), ctypes.c_int(len(facts["set"])), variables, given, ctypes.c_int(outputs), read, results,
        structs, ctypes.c_double(facts["until"]),
    ]  # fmt: skip
    table = (ctypes.c_void_p * len(arguments))(*[ctypes.cast(ctypes.byref(a), ctypes.c_void_p) for a in arguments])
    began = time.perf_counter()
    device.call("cuLaunchKernel", function, blocks, 1, 1, THREADS, 1, 1, 0, None, table, None)
    device.call("cuCtxSynchronize")
    took = time.perf_counter() - began
    device.call("cuMemcpyDtoH_v2", out.ctypes.data_as(ctypes.c_void_p), results, ctypes.c_size_t(out.nbytes))
    device.free(*pointers)
    return out, took


def compared(out: np.ndarray, expected: np.ndarray) -> str:
    """Differences of results as text: of outcomes, of numbers of events (the last output), and of other columns relative to their
    range."""
    same = out[:, 0] == expected[:, 0]
    events = out[:, -1] == expected[:, -1]
    span = np.ptp(expected[:, 1:-1], axis=0)
    apart = np.abs(out[:, 1:-1] - expected[:, 1:-1]) / np.where(span > 0, span, 1.0)
    worst, median = np.nanmax(apart), np.nanmedian(apart.max(axis=1))
    alike = f"outcomes alike {same.sum()} of {len(same)}, events {events.sum()}"
    return f"{alike}, apart by median {median:.1e}, at most {worst:.1e} of the range"


def report(device: Device, folder: Path, count: int) -> None:
    """Check and time one mechanism."""
    facts = json.loads((folder / "facts.json").read_text())
    files = sorted(folder.glob("*.cubin")) or sorted(folder.glob("*.ptx"))
    began = time.perf_counter()
    function = device.linked(files)
    linking = time.perf_counter() - began
    device.call("cuCtxSetLimit", 0, ctypes.c_size_t(STACK_LIMIT * (facts["frame"] or 8192)))
    registers, held = ctypes.c_int(), ctypes.c_int()
    device.call("cuFuncGetAttribute", ctypes.byref(registers), 4, function)
    device.call("cuOccupancyMaxActiveBlocksPerMultiprocessor", ctypes.byref(held), function, THREADS, ctypes.c_size_t(0))
    blocks = held.value * device.attribute(16)
    expected = np.load(folder / "expected.npz")
    told = compared(made(device, function, facts, expected["values"], blocks)[0], expected["out"])
    size = f"linked in {linking:.1f} s, {registers.value} registers, {blocks * THREADS} threads at once"
    print(f"{facts['name']}: {size}; {told}", flush=True)
    low, high = np.array(facts["low"]), np.array(facts["high"])
    for cases in (count // 10, count):
        out, took = made(device, function, facts, np.random.default_rng(2).uniform(low, high, (cases, len(low))), blocks)
        print(f"  {cases} cases: {took:.2f} s, {cases / took:,.0f} cases/s, ended early {int((out[:, 0] > 1).sum())}", flush=True)


def main() -> None:
    """Print the figures of all mechanisms in the folder."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("folder", type=Path)
    ask.add_argument("--cases", type=int, default=1_000_000)
    asked = ask.parse_args()
    device = Device()
    for facts in sorted(asked.folder.glob("*/facts.json")):
        report(device, facts.parent, asked.cases)


if __name__ == "__main__":
    main()
