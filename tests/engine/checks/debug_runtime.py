"""A debug build of the runtime, which tests use in place of the normal build. It has functions that give access to internal
data."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.shared_libraries import RUNTIME, runtime_key, write_headers, written_entries
from trunnion.simulation.runtime_interface import c_signatures

SOURCE = """#include "runtime.c"
/* Reads what pair 0 can hold, which nobody has asked for at this state. */
double tr_wrong(tr_sim *s) { TR_SPOILT(s, TR_HAS_CAPACITY); return tr_friction_ratio(s, 0); }

/* Decide the modes of the pairs at rest in the state `y`: through neighbouring modes along the recursion, or by the cone equations.
 * eta: frictions. flags: modes. Returns 0 if this way finds no modes. */
int tr_decide_one_way(tr_sim *s, int by_cones, double *eta, double *flags) {
  int rest[s->k->nsliders + 1];
  tr_mode modes[s->k->nsliders + 1];
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  const int n = tr_collect_pairs_at_rest(s, -1, rest);
  tr_save_modes(s, modes);
  memset(TR_A(s, z), 0, sizeof(double) * tr_z_length(s));
  const int found = by_cones ? tr_decide_by_cones(s, rest, n) : tr_decide_nearby(s, rest, n, -1);
  memcpy(eta, TR_A(s, z) + s->k->active, sizeof(double) * s->k->neta);
  for (int i = 0; i < s->k->nsliders; ++i) flags[i] = tr_mode_flag(tr_mode_of(s, i));
  tr_restore_modes(s, modes);
  return found;
}

/* Evaluate the state `y` along the recursion. Returns how far Newton's method with maps then moves the frictions, relative to the
 * largest; −1 if maps were used at once. */
double tr_gap_to_maps(tr_sim *s) {
  double *eta = TR_A(s, z) + s->k->active, along[s->k->neta + 1], gap = 0.0, size = 0.0;
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) || !s->step.recursive) return -1.0;
  memcpy(along, eta, sizeof(double) * s->k->neta);
  tr_form_all_maps(s);
  if (!tr_newton(s, eta)) return INFINITY;
  for (int i = 0; i < s->k->neta; ++i) gap = fmax(gap, fabs(eta[i] - along[i])), size = fmax(size, fabs(along[i]));
  return gap / size;
}
"""


def built() -> Path:
    """The debug build."""

    def make(folder: Path) -> None:
        write_headers(folder)
        (folder / "debug.c").write_text(SOURCE)
        to = folder / f"debug{c_compiler.library_suffix()}"
        flags = ("-DTR_DEBUG", *c_compiler.QUICK)
        sources = [folder / "debug.c", written_entries(folder)]
        c_compiler.build_library(sources, to, [RUNTIME, folder], library_cache.cache_folder(), flags)

    folder, _ = library_cache.entry(f"debug-{library_cache.digest(runtime_key(), SOURCE)}", make)
    return folder / f"debug{c_compiler.library_suffix()}"


@contextmanager
def in_place_of_the_runtime() -> Iterator[ctypes.CDLL]:
    """Use the debug build for all blocks that are made within this context."""
    monkeypatch = pytest.MonkeyPatch()
    made = ctypes.CDLL(str(built()))
    made.tr_failed_check.restype = ctypes.c_long
    monkeypatch.setattr(c_signatures, "runtime", lambda: made)
    c_signatures.library.cache_clear()
    made.tr_forget_checks()
    try:
        yield made
    finally:
        monkeypatch.undo()
        c_signatures.library.cache_clear()
