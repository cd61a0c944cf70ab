"""A host with an unusual floating-point environment: it traps exceptions, rounds upward, and flushes subnormal numbers to zero.

``python unusual_environment_host.py RUN`` runs a model for x86-64 Linux and prints the bits of outputs at the end. It sets the
environment around each call, and checks that the call leaves it unchanged. A trapped exception ends the process. Model exchange
makes short steps of Euler's method. RUN is a JSON object with these keys: ``form`` (``cs2``, ``me2``, ``cs3``, ``me3``, or the name
of a C library), ``library``, ``token``, ``resources``, ``environment`` (MXCSR), ``references`` of outputs with the number of their
``values``, numbers of ``states`` and ``indicators``."""

import ctypes
import json
import sys

run = json.loads(sys.argv[1])
form, states, indicators, values = run["form"], run["states"], run["indicators"], run["values"]
H, STEPS, SHORT, MANY, OFTEN, FLAGS, MXCSR = 0.01, 100, 1e-5, 1000, 100, 0x3F, 7
exchange, fmi = form in ("me2", "me3"), f"fmi{form[-1]}" if form in ("cs2", "me2", "cs3", "me3") else ""
loaded, libm = ctypes.CDLL(run["library"]), ctypes.CDLL("libm.so.6")
NUMBER, FLAG, TRUTH, ADDRESS, SIZE = ctypes.c_double, ctypes.c_int, ctypes.c_bool, ctypes.c_void_p, ctypes.c_size_t


def call(name, *arguments, result=FLAG):
    """Call a function of the model in the unusual environment. Its status may be a warning."""
    function = getattr(loaded, name)
    function.restype = result
    plain, unusual, after = ((ctypes.c_uint32 * 8)() for _ in range(3))
    libm.fegetenv(plain)
    unusual[:] = plain[:]
    unusual[MXCSR] = run["environment"]
    libm.fesetenv(unusual)
    got = function(*arguments)
    libm.fegetenv(after)
    libm.fesetenv(plain)
    assert (after[MXCSR] ^ unusual[MXCSR]) & ~FLAGS == 0, name
    assert result is not FLAG or got in (0, 1), (name, got)
    return got


class Events(ctypes.Structure):
    """The answer of fmi2NewDiscreteStates."""

    _fields_ = [(n, FLAG) for n in ("again", "terminate", "nominals", "values", "defined")] + [("next", NUMBER)]


def handled():
    """Handle events until no other call is requested, and return to continuous-time mode."""
    again = True
    while again:
        if fmi == "fmi2":
            told = Events()
            call("fmi2NewDiscreteStates", c, ctypes.byref(told))
            again = told.again
        else:
            answers = [TRUTH() for _ in range(5)]
            call("fmi3UpdateDiscreteStates", c, *map(ctypes.byref, answers), ctypes.byref(NUMBER()))
            again = answers[0].value
    call(f"{fmi}EnterContinuousTimeMode", c)


def numbers(name, count):
    """The numbers that a function of model exchange returns."""
    got = (NUMBER * count)()
    call(f"{fmi}{name}", c, got, SIZE(count))
    return got


def exchanged():
    """Make steps of Euler's method. Events are handled every OFTEN steps, and when an indicator changes its sign."""
    rates = "GetDerivatives" if fmi == "fmi2" else "GetContinuousStateDerivatives"
    handled()
    for k in range(1, MANY + 1):
        x, slope, before = numbers("GetContinuousStates", states), numbers(rates, states), numbers("GetEventIndicators", indicators)
        call(f"{fmi}SetTime", c, NUMBER(k * SHORT))
        call(
            f"{fmi}SetContinuousStates", c, (NUMBER * states)(*(a + SHORT * b for a, b in zip(x, slope, strict=True))), SIZE(states)
        )
        truth, yes = (FLAG, FLAG(1)) if fmi == "fmi2" else (TRUTH, TRUTH(True))
        due = truth()
        call(f"{fmi}CompletedIntegratorStep", c, yes, ctypes.byref(due), ctypes.byref(truth()))
        after = numbers("GetEventIndicators", indicators)
        if due or k % OFTEN == 0 or any((a > 0) != (b > 0) for a, b in zip(before, after, strict=True)):
            call(f"{fmi}EnterEventMode", c)
            handled()


value, which, no, null = (NUMBER * values)(), (ctypes.c_uint32 * len(run["references"]))(*run["references"]), NUMBER(0), None
token, resources = run["token"].encode(), run["resources"].encode()
if fmi == "fmi2":
    c = ADDRESS(call("fmi2Instantiate", b"i", FLAG(not exchange), token, resources, (ADDRESS * 5)(), 0, 0, result=ADDRESS))
    call("fmi2SetupExperiment", c, 0, no, no, 0, no)
    call("fmi2EnterInitializationMode", c)
    call("fmi2ExitInitializationMode", c)
    for k in range(0 if exchange else STEPS):
        call("fmi2DoStep", c, NUMBER(H * k), NUMBER(H), 1)
    if exchange:
        exchanged()
    call("fmi2GetReal", c, which, SIZE(len(which)), value)
    call("fmi2FreeInstance", c, result=None)
elif fmi == "fmi3":
    b = TRUTH(False)
    more = [null, null] if exchange else [b, b, null, SIZE(0), null, null, null]
    kind = "ModelExchange" if exchange else "CoSimulation"
    c = ADDRESS(call(f"fmi3Instantiate{kind}", b"i", token, resources, b, b, *more, result=ADDRESS))
    call("fmi3EnterInitializationMode", c, b, no, no, b, no)
    call("fmi3ExitInitializationMode", c)
    answers = [ctypes.byref(TRUTH()) for _ in range(3)]
    for k in range(0 if exchange else STEPS):
        call("fmi3DoStep", c, NUMBER(H * k), NUMBER(H), b, *answers, ctypes.byref(NUMBER()))
    if exchange:
        exchanged()
    call("fmi3GetFloat64", c, which, SIZE(len(which)), value, SIZE(values))
    call("fmi3FreeInstance", c, result=None)
else:
    memory = (NUMBER * 1_000_000)()
    call(f"{form}_init", memory)
    call(f"{form}_start", memory, no)
    for _ in range(STEPS):
        call(f"{form}_step", memory, NUMBER(H))
    value[:] = [call(f"{form}_get", memory, FLAG(k), result=NUMBER) for k in which]
print(*(x.hex() for x in value))
