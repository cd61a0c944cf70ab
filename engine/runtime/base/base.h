/* Stage `base`: the block and its arrays, small linear algebra, signals, calls of the kernel. */
#ifndef TR_BASE_H
#define TR_BASE_H
#include "base/accessors.h"
#include "base/map_block_offsets.h"
#include "base/dense_linalg.h"
#include "base/method_tables.h"
#include "base/stick_rule.h"
#include "base/tolerances.h"
#include "base/unilateral_contact.h"
#include "base/vectors.h"

/* Factorised least-squares problem: minimise |κ + N x| over x (r). N is m×r. */
typedef struct tr_least_squares {
  int m, r, rank;
  const double *N;
  double *L, *d, *g;
  int *perm, *lo, *hi;
} tr_least_squares;

/* Adapt the maps of the current state to the open and closed contacts: remove the row of each open contact. Called after every
 * evaluation of raw maps. */
static void tr_apply_contacts(tr_sim *s);

/* Residuals h (2·rows) of the loops at y: of positions, then of rates; 0 for open contacts. Requires the signals. */
static void tr_evaluate_closure(tr_sim *s, const double *y, double *h);

/* Gap, m, and rate of the gap, m/s, of every joint that only pushes, open or closed, at the state y. Requires the signals. */
static void tr_evaluate_gaps(tr_sim *s, const double *y, double *gap, double *rate);

/* Second time derivative of the gap of contact c at the present solution, m/s². forces: 1 includes applied forces, 0 counts
 * multipliers alone. Requires maps. */
static double tr_gap_acceleration(const tr_sim *s, int c, int forces);

/* Append the powers evaluated last to ẏ (dy): powers of the works that columns need, then the audit's two sums of powers. */
static inline void tr_append_powers(const tr_sim *s, double *dy) {
  const tr_kernel *k = s->k;
  const double *power = TR_A(s, power);
  double *out = dy + s->ny, taken = 0.0, given = 0.0;
  for (int i = 0; i < s->nworks; ++i) out[i] = power[i];
  for (int i = 0; i < k->ntaken; ++i) taken += power[i];
  for (int i = k->ntaken; i < k->npowers; ++i) given += power[i];
  out[s->nworks] = taken, out[s->nworks + 1] = given;
}

/* Evaluate ẏ (dy) and the powers at the current state y with the multipliers z. Requires raw maps. */
static inline void tr_evaluate_stage2(tr_sim *s, const double *y, const double *z, double *dy) {
  TR_NEED(s, TR_HAS_MAPS);
  s->k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, dy, TR_A(s, power));
  tr_append_powers(s, dy);
}

/* Factorise the least-squares problem of the directions N (m×r). `work` has tr_least_squares_doubles(r) doubles and must
 * outlive the result. */
static tr_least_squares tr_least_squares_factor(int m, int r, const double *N, double *work);

/* Solve for x, and replace kappa by the residual κ + N x. With `more` (r doubles, or a null pointer), solve Nᵀ(κ + N x) + more = 0
 * instead. */
static void tr_least_squares_solve(const tr_least_squares *q, double *kappa, const double *more, double *x);

/* Evaluate an external input u at time t. A motion q that follows u may start at a distance e = q − u, with the relative rate ė.
 * The motion then approaches u with critical damping: q = u + (e + (ė + ω e) τ) exp(−ω τ), where τ is the time since the start. */
static void tr_evaluate_input(const tr_input *in, double t, double ts, tr_signal *out);

/* Number of external inputs, which are the first tables. */
static int tr_input_count(const tr_sim *s);

/* Whether an input has a maximum or minimum between two times, s. Only inputs with a second derivative can have such a point. */
static int tr_has_input_turn(const tr_sim *s, double from, double to);

/* Time of the first break of the signals after t, s; INFINITY if there is none. */
double tr_break_after(const tr_sim *s, double t);

/* For a run that starts at t, set the last break and the next break. */
static void tr_begin_breaks(tr_sim *s, double t);

/* Pass all breaks up to and including time t. Returns whether there were any breaks. */
static int tr_pass_breaks(tr_sim *s, double t);

/* Form the raw maps of the current state, unless they exist already. */
static void tr_form_maps(tr_sim *s);

/* Change of rates dv (nv) by impulses δλ (dlam) and δη (deta, or a null pointer) at the current state y. `response`: for each
 * friction, the acceleration that a unit of this friction causes in its own freedom. `again`: whether the previous call was at the
 * same state. If so, the ẏ without impulses that the previous call stored is reused. */
static void tr_rates_by_impulses(tr_sim *s, const double *y, const double *dlam, const double *deta, const double *response, int again, double *dv);

/* Store y and the time of the signals as the current state. Requires a kernel with recursion. */
static void tr_store_current_state(tr_sim *s, const double *y);

/* Whether (t, y) is the current state; its rates are then known. Returns 0 if the kernel has no recursion. */
static int tr_is_current_state(const tr_sim *s, double t, const double *y);

/* Make y the current state by the kernel's function `begin`, which starts the recursion and forms no maps. Later functions form
 * maps on demand. Requires the signals. */
static void tr_begin_recursion(tr_sim *s, const double *y, double *dy);

/* Make y the current state and evaluate its maps. With recursive friction, later functions form maps on demand. ẏ is evaluated only
 * if the mechanism has no multipliers. Requires the signals. */
static void tr_evaluate_maps(tr_sim *s, const double *y);

/* Evaluate the block's signals at time t. */
static inline void tr_set_time(tr_sim *s, double t);

/* Set the signals of time t, then call tr_evaluate_maps. */
static inline void tr_evaluate_maps_at(tr_sim *s, double t, const double *y) { tr_set_time(s, t), tr_evaluate_maps(s, y); }

/* Potential energy at y, J, for latches. Returns 0 in mechanisms without latches. */
static double tr_potential_energy(const tr_sim *s, const double *y);
#endif
