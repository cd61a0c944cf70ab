"""A Python program that traps floating-point exceptions, rounds upward and flushes subnormal numbers to zero."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

HOST = """
import contextlib, ctypes, trunnion
from trunnion.simulation.runtime_interface.c_signatures import SIGNATURES, library

MXCSR, TRAPS, UNUSUAL = 7, 0x1900, 0xd840
libm = ctypes.CDLL("libm.so.6")


@contextlib.contextmanager
def environment(word):
    plain, unusual, after = ((ctypes.c_uint32 * 8)() for _ in range(3))
    libm.fegetenv(plain)
    unusual[:] = plain[:]
    unusual[MXCSR] = word
    libm.fesetenv(unusual)
    yield
    libm.fegetenv(after)
    libm.fesetenv(plain)
    assert (after[MXCSR] ^ unusual[MXCSR]) & ~0x3f == 0, "the environment is changed"


def in_environment(function):
    def call(*arguments):
        with environment(UNUSUAL):
            return function(*arguments)
    return call


def run(kernel):
    return trunnion.simulate("spherical_pendulum", until=1.0, kernel=kernel).data.tobytes()


kernels = ("compiled", "parts")
plain = [run(k) for k in kernels]
with environment(TRAPS):
    assert [run(k) for k in kernels] == plain, "trapped: other bits"
lib = library()
for name in SIGNATURES:
    setattr(lib, name, in_environment(getattr(lib, name)))
assert [run(k) for k in kernels] == plain, "rounded upward: other bits"
"""


@pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="sets a register of x86-64")
def test_a_program_that_traps_exceptions_and_rounds_upward_gets_the_same_bits_and_keeps_its_habits() -> None:
    """Python itself computes in the environment of the program. Therefore only the calls of the runtime round upward in this
    test."""
    done = subprocess.run([sys.executable, "-c", HOST], capture_output=True, text=True, check=False)
    assert done.returncode == 0, (done.returncode, done.stderr)
