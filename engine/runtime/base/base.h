/* Stage `base`: the block and its arrays, small linear algebra, signals, calls of the kernel. */
#ifndef TR_BASE_H
#define TR_BASE_H
#include "base/accessors.h"
#include "base/affine_maps.h"
#include "base/dense_linalg.h"
#include "base/method_tables.h"
#include "base/stick_rule.h"
#include "base/tolerances.h"
#include "base/vectors.h"

/* Factorised least squares: |κ + N x| is smallest over x (r); N is m×r. */
typedef struct tr_least_squares {
  int m, r, rank;
  const double *N;
  double *L, *d, *g;
  int *perm, *lo, *hi;
} tr_least_squares;

/* Append the powers just evaluated to ẏ (dy): those of columns' works, then the sums of the audit. */
static inline void tr_append_powers(const tr_sim *s, double *dy) {
  const tr_kernel *k = s->k;
  const double *power = TR_A(s, power);
  double *out = dy + s->ny, sum[2] = {0.0, 0.0};
  if (!s->naudit) return;
  for (int i = 0; i < s->nworks; ++i) out[i] = power[i];
  for (int i = 0; i < k->npowers; ++i) sum[i >= k->ntaken] += power[i];
  out[s->nworks] = sum[0], out[s->nworks + 1] = sum[1];
}

/* ẏ (dy) with powers at the current state y, for the multipliers z. Requires raw maps. */
static inline void tr_evaluate_stage2(tr_sim *s, const double *y, const double *z, double *dy) {
  TR_NEED(s, TR_HAS_MAPS);
  s->k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, dy, TR_A(s, power));
  tr_append_powers(s, dy);
}

/* Factorise for the directions N (m×r). `work` has tr_least_squares_doubles(r) numbers and must outlive the result. */
static tr_least_squares tr_least_squares_factor(int m, int r, const double *N, double *work);

/* The best x; kappa becomes the residual κ + N x. more (r numbers, or 0): solve Nᵀ(κ + N x) + more = 0 instead. */
static void tr_least_squares_solve(const tr_least_squares *q, double *kappa, const double *more, double *x);

/* Orthonormalise the directions N (m×r) by Gram and Schmidt, twice. Dependent directions become zero. */
static void tr_orthonormalise(int m, int r, double *N);

/* External input at t since its communication point. A motion that follows the input may start off by a gap e with the rate ė;
 * it closes the gap with critical damping: q = u + (e + (ė + ω e) τ) exp(−ω τ). */
static void tr_evaluate_input(const tr_input *in, double t, tr_signal *out);

/* Number of external inputs, which are the first tables. */
static int tr_input_count(const tr_sim *s);

/* The first break of the signals after t, s; INFINITY: none. */
double tr_break_after(const tr_sim *s, double t);

/* Form the raw maps of the current state, unless they are formed. */
static void tr_form_maps(tr_sim *s);

/* Change of rates δv (nv) by impulses [δλ | δη] at the current state y. deta may be 0. response: effect of a unit of each η on
 * its own freedom. again: the last impulses were applied at this state too. */
static void tr_rates_by_impulses(tr_sim *s, const double *y, const double *dlam, const double *deta, const double *response, int again, double *dv);

/* Make y the current state by the recursion alone; maps are formed on demand. Requires the signals. */
static void tr_begin_recursion(tr_sim *s, const double *y, double *dy);

/* Make y the current state: evaluate its maps, or with recursive friction form them on demand. Requires the signals. ẏ is
 * evaluated only if there are no multipliers. */
static void tr_evaluate_maps(tr_sim *s, const double *y);

/* Evaluate the block's signals at time t. */
static inline void tr_set_time(tr_sim *s, double t);

/* tr_evaluate_maps at time t, with the signals of t. */
static inline void tr_evaluate_maps_at(tr_sim *s, double t, const double *y) { tr_set_time(s, t), tr_evaluate_maps(s, y); }

/* Potential energy at y, J; 0 if the audit does not need it. */
static double tr_potential_energy(const tr_sim *s, const double *y);
#endif
