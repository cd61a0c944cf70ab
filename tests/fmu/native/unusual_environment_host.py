"""A host with an unusual floating-point environment: it traps exceptions, rounds upward, and flushes subnormal numbers to zero.

``python unusual_environment_host.py FORM LIBRARY GUID ENVIRONMENT`` runs a model for x86-64 Linux. It sets the environment (MXCSR,
hexadecimal) around each call, and checks that the call leaves it unchanged. It prints the bits of the first three outputs, which
are a vector. FORM is 2 or 3 (co-simulation by this version of FMI), or the name of a C library. A trapped exception ends the
process."""

import ctypes
import sys

form, library, guid, environment = sys.argv[1:]
H, FLAGS, MXCSR, SIZE = 0.01, 0x3F, 7, 3
times = [H * k for k in range(100)]
loaded, libm = ctypes.CDLL(library), ctypes.CDLL("libm.so.6")
NUMBER, FLAG, ADDRESS = ctypes.c_double, ctypes.c_int, ctypes.c_void_p


def call(name, *arguments, result=ctypes.c_int):
    """Call a function of the model in the unusual environment."""
    function = getattr(loaded, name)
    function.restype = result
    plain, unusual, after = ((ctypes.c_uint32 * 8)() for _ in range(3))
    libm.fegetenv(plain)
    unusual[:] = plain[:]
    unusual[MXCSR] = int(environment, 16)
    libm.fesetenv(unusual)
    got = function(*arguments)
    libm.fegetenv(after)
    libm.fesetenv(plain)
    assert (after[MXCSR] ^ unusual[MXCSR]) & ~FLAGS == 0, name
    assert result is not ctypes.c_int or got == 0, name
    return got


value, which, no = (NUMBER * SIZE)(), (ctypes.c_uint32 * SIZE)(*range(SIZE)), NUMBER(0.0)
if form == "2":
    c = ADDRESS(call("fmi2Instantiate", b"i", 1, guid.encode(), None, (ADDRESS * 5)(), 0, 0, result=ADDRESS))
    call("fmi2SetupExperiment", c, 0, no, no, 0, no)
    call("fmi2EnterInitializationMode", c)
    call("fmi2ExitInitializationMode", c)
    for t in times:
        call("fmi2DoStep", c, NUMBER(t), NUMBER(H), 1)
    call("fmi2GetReal", c, which, ctypes.c_size_t(SIZE), value)
    call("fmi2FreeInstance", c, result=None)
elif form == "3":
    flag, b, n = FLAG(0), ctypes.c_bool(False), ctypes.c_size_t
    c = call("fmi3InstantiateCoSimulation", b"i", guid.encode(), None, b, b, b, b, None, n(0), None, None, None, result=ADDRESS)
    c = ADDRESS(c)
    call("fmi3EnterInitializationMode", c, b, no, no, b, no)
    call("fmi3ExitInitializationMode", c)
    answers = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
    for t in times:
        call("fmi3DoStep", c, NUMBER(t), NUMBER(H), b, *answers, ctypes.byref(NUMBER()))
    call("fmi3GetFloat64", c, which, n(1), value, n(SIZE))
    call("fmi3FreeInstance", c, result=None)
else:
    memory = (NUMBER * 100_000)()
    call(f"{form}_init", memory)
    call(f"{form}_start", memory, no)
    for _ in times:
        call(f"{form}_step", memory, NUMBER(H))
    value[:] = [call(f"{form}_get", memory, FLAG(k), result=NUMBER) for k in which]
print(*(x.hex() for x in value))
