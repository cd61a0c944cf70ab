/* Offsets of the blocks in `maps`, which stage 1 of a kernel writes (``engine/kernel/units/stepping_unit.py``). All blocks are
 * column-major.
 *
 * Let a be the number of active rows of λ, e the number of frictions η, and n the number of reaction components. The blocks have
 * this order:
 *  - S (a×a; with nS < a², in blocks: tr_loop_matrix), Se (a×e), g0 (a) of S λ + Se η + g0 = 0 (90);
 *  - N0 (n), Nl (n×a), Ne (n×e) of N = N0 + Nl λ + Ne η (103); rates of the frictional freedoms;
 *  - if some law is set-valued, Q0 (e), Ql (e×a), Qe (e×e) of the accelerations of these freedoms, q̈ = Q0 + Ql λ + Qe η;
 *  - in the redundant variant, κ0, κl, κe of the scaled reactions. */
#ifndef TR_MAPS_H
#define TR_MAPS_H
#include "base/simulation.h"

static inline const double *map_Se(const tr_kernel *k, const double *m) { return m + k->nS; }
static inline const double *map_g0(const tr_kernel *k, const double *m) { return map_Se(k, m) + k->active * k->neta; }
static inline const double *map_N0(const tr_kernel *k, const double *m) { return map_g0(k, m) + k->active; }
static inline const double *map_Nl(const tr_kernel *k, const double *m) { return map_N0(k, m) + k->nn; }
static inline const double *map_Ne(const tr_kernel *k, const double *m) { return map_Nl(k, m) + k->nn * k->active; }
static inline const double *map_rates(const tr_kernel *k, const double *m) { return map_Ne(k, m) + k->nn * k->neta; }
static inline const double *map_Q0(const tr_kernel *k, const double *m) { return map_rates(k, m) + k->nrates; }
static inline const double *map_Ql(const tr_kernel *k, const double *m) { return map_Q0(k, m) + k->neta; }
static inline const double *map_Qe(const tr_kernel *k, const double *m) { return map_Ql(k, m) + k->neta * k->active; }
/* The maps of the scaled reactions. Q0, Ql and Qe precede them, but exist only with set-valued laws. */
static inline const double *map_kappa(const tr_kernel *k, const double *m) {
  return map_Q0(k, m) + (k->sets ? k->neta * (1 + k->active + k->neta) : 0);
}
#endif
