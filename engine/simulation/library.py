"""The runtime as a library: the signatures of the functions that a block calls."""

from __future__ import annotations

import ctypes
from functools import lru_cache

from engine.kernel.library import runtime


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The runtime library, with the signatures of its functions declared."""
    lib = runtime()
    p, i, d, long = ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_long
    lib.tr_size.argtypes, lib.tr_size.restype = [p, p, p, i, i, i], ctypes.c_size_t
    lib.tr_init.argtypes, lib.tr_init.restype = [p, p, p, p, i, i, i], i
    lib.tr_array.argtypes, lib.tr_array.restype = [p, i], p
    lib.tr_signals.argtypes, lib.tr_signals.restype = [p, i, d, p], None
    lib.tr_set_parameters.argtypes, lib.tr_set_parameters.restype = [p], None
    lib.tr_configure.argtypes, lib.tr_configure.restype = [p, p], None
    lib.tr_assemble.argtypes, lib.tr_assemble.restype = [p, d, p, p], i
    lib.tr_start.argtypes, lib.tr_start.restype = [p, d, d, d, p], i
    lib.tr_advance.argtypes, lib.tr_advance.restype = [p, d, long, p, long, p], i
    lib.tr_reach_bounded.argtypes, lib.tr_reach_bounded.restype = [p, d, p], i
    lib.tr_row.argtypes, lib.tr_row.restype = [p, p], i
    lib.tr_evaluate.argtypes, lib.tr_evaluate.restype = [p, p, p], i
    lib.tr_attach_jacobian.argtypes, lib.tr_attach_jacobian.restype = [p, p, p, i], i
    lib.tr_derivatives.argtypes, lib.tr_derivatives.restype = [p, p], i
    lib.tr_directional.argtypes, lib.tr_directional.restype = [p, p, p, p, p, p], i
    lib.tr_redundancy.argtypes, lib.tr_redundancy.restype = [p, p], i
    lib.tr_why.argtypes, lib.tr_why.restype = [p, p], i
    lib.tr_gap.argtypes, lib.tr_gap.restype = [p, p], None
    lib.tr_fail_row.argtypes, lib.tr_fail_row.restype = [p, p], i
    lib.tr_verify.argtypes, lib.tr_verify.restype = [p, i], i
    lib.tr_roots.argtypes, lib.tr_roots.restype = [p], i
    lib.tr_certify_run.argtypes, lib.tr_certify_run.restype = [p, p], None
    lib.tr_audit_end.argtypes, lib.tr_audit_end.restype = [p], None
    lib.tr_judge.argtypes, lib.tr_judge.restype = [p, p], None
    lib.tr_hold_all.argtypes, lib.tr_hold_all.restype = [p, p], i
    lib.tr_ask.argtypes, lib.tr_ask.restype = [p, p], None
    lib.tr_time.argtypes, lib.tr_time.restype = [p], d
    lib.tr_statistics.argtypes, lib.tr_statistics.restype = [p], p
    lib.tr_integral.argtypes, lib.tr_integral.restype = [i, p, i, p, i, p, p, p], None
    lib.tr_around.argtypes, lib.tr_around.restype = [i, long, p, p, d, p, i, p], None
    lib.tr_events_take.argtypes, lib.tr_events_take.restype = [p], i
    return lib
