"""The runtime library with the signatures of its functions."""

from __future__ import annotations

import ctypes
from functools import lru_cache

from trunnion.kernel.shared_libraries import GUARDED, runtime
from trunnion.runtime.abi.batch_records import BATCH

TYPES = {"p": ctypes.c_void_p, "i": ctypes.c_int, "d": ctypes.c_double, "l": ctypes.c_long, "z": ctypes.c_size_t, "-": None}
SIGNATURES = {
    "tr_size": "zpppiii", "tr_init": "ippppiii", "tr_array": "ppi", "tr_signals": "-pidp", "tr_set_parameters": "-p",
    "tr_configure": "-pp", "tr_assemble": "ipdpp", "tr_start": "ipdddp", "tr_advance": "ipdlplp", "tr_reach_bounded": "ipdp",
    "tr_row": "ipp", "tr_evaluate": "ippp", "tr_attach_jacobian": "ipppi", "tr_derivatives": "ipp", "tr_directional": "ipppppp",
    "tr_redundancy": "ipp", "tr_open_columns": "ipp", "tr_diagnose_friction": "ipp", "tr_gap": "-pp", "tr_fail_row": "ipp",
    "tr_verify": "ipi", "tr_roots": "ip", "tr_certify_run": "-pp", "tr_audit_end": "-p", "tr_judge": "-pp", "tr_hold_all": "ipp",
    "tr_ask": "-pp", "tr_watch_pulls": "-pippp", "tr_time": "dp", "tr_statistics": "pp", "tr_integrate_rows": "-ipipippp",
    "tr_bin_around": "-ilppdpip", "tr_events_take": "ip", "tr_batch_run": "ipl", "tr_batch_end": "-pi", "tr_batch_size": "z",
    "tr_ensemble_begin": "-p",
    "tr_record_steps": "ipdiplppppppppp", "tr_impact_length": "zp", "tr_tangents_work": "zp", "tr_evaluate_tangents": "ippdpppp",
    "tr_march_tangents": "ippippzppppppp", "tr_cross_event": "ippdpppppppp",
    "tr_ensemble_run": "ipl", "tr_ensemble_drop": "-pi", "tr_ensemble_resume": "-p",
}  # fmt: skip
"""{function: type of its result, then types of its arguments, as keys of TYPES}."""


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The runtime library with declared signatures. Raises RuntimeError if the size of its batch record differs from the size in
    Python."""
    lib = runtime()
    for name, codes in SIGNATURES.items():
        function = getattr(lib, GUARDED + name)
        function.restype, function.argtypes = TYPES[codes[0]], [TYPES[a] for a in codes[1:]]
        setattr(lib, name, function)
    if lib.tr_batch_size() != ctypes.sizeof(BATCH.ctype):
        raise RuntimeError("the runtime library belongs to another version of Trunnion: delete the cache of kernels")
    return lib
