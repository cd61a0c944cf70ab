/* Staying on the constraint manifold: quaternion length, loop closure of positions and velocities.
 *
 * The correction is the smallest in the mass metric: δv = M⁻¹Gᵀ δλ, obtained as a difference of two stage-2 evaluations. */
#include "tr.h"

#define NO_IMPULSE 1e-250 /* largest multiplier of impulses that move nothing: its inverse, scaled up, is still a number */
#define CLOSED 4e-15      /* of the length (rad), of length · rate: round-off of a closed loop */
#define OPEN_LOOP 1e-8    /* of the length (rad): what is left after all iterations is no round-off: the loops cannot be closed */
#define SHRINKS 0.2       /* of the residual before: an iteration that leaves more has come to round-off */
#define NEAR_CLOSED 1e-8  /* the same, of many loops: what a correction leaves of so little, the square, is round-off; maps serve for the rates too */
#define CLOSE_MAX 12      /* iterations of the positions: quadratic from anywhere a step can end */
#define CLOSE_BOUNDED 3   /* the same in a bounded step */
#define CLOSE_RATES_MAX 3 /* of the rates, which are linear */

/* Quaternions of y back to unit length. */
static void tr_normalize(const tr_sim *s, double *y) {
  for (int i = 0; i < s->k->nquat; ++i) {
    double *e = y + s->k->quat[i];
    double n = 1.0 / sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    for (int j = 0; j < 4; ++j) e[j] *= n;
  }
}

/* The larger, or what is not a number (fmax would drop it). */
static inline double tr_most(double a, double b) { return b <= a || a != a ? a : b; }

/* Largest residual of the active rows, scaled: positions by length, rates by length·rate (turns: 1, rate). */
static void tr_residual(const tr_sim *s, const double *h, double *position, double *velocity) {
  const tr_kernel *k = s->k;
  *position = *velocity = 0.0;
  for (int i = 0; i < k->active; ++i) {
    int r = k->active_rows[i];
    double unit = tr_row_unit(s, r);
    *position = tr_most(*position, fabs(h[r]) / unit);
    *velocity = tr_most(*velocity, fabs(h[k->rows + r]) / (unit * s->set.rate));
  }
}

/* δv (nv) caused by impulses [δλ | δη] at the state whose stage 1 is in place. deta may be 0; response: what a unit of each η does to
 * its own freedom; again: the last ones were given there too. */
static void tr_impulse(tr_sim *s, const double *y, const double *dlam, const double *deta, const double *response, int again, double *dv) {
  const tr_kernel *k = s->k;
  int a = k->active, e = deta ? k->neta : 0, n = tr_width(s);
  double z[a + k->neta + 1], big = 0.0, *f = TR_A(s, dy), *base = TR_A(s, unmoved);
  for (int i = 0; i < a; ++i) big = fmax(big, fabs(dlam[i]));
  for (int i = 0; i < e; ++i) big = fmax(big, fabs(deta[i]));
  double up = big > NO_IMPULSE ? 1.0 / big : 0.0;
  memset(z, 0, sizeof z);
  tr_form_maps(s);
  if (!again) {
    k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, f, TR_A(s, power));
    memcpy(base, f, sizeof(double) * n);
  }
  double size = 0.0;
  for (int i = 0; i < k->nv; ++i) size = fmax(size, fabs(base[k->nq + i]));
  /* scale so that the difference is not lost in the bias: 1/d² is the acceleration a unit multiplier causes along its own row */
  const double *d = TR_A(s, d);
  double gain = 0.0;
  for (int i = 0; i < a; ++i) gain = fmax(gain, fabs(dlam[i]) * up / (d[i] * d[i]));
  for (int i = 0; i < e; ++i) gain = fmax(gain, fabs(deta[i] * response[i]) * up);
  double f1 = gain > 0.0 ? up * fmax(1.0, size / gain) : up;
  for (int i = 0; i < a; ++i) z[i] = dlam[i] * f1;
  for (int i = 0; i < e; ++i) z[a + i] = deta[i] * f1;
  k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, f, TR_A(s, power));
  for (int i = 0; i < k->nv; ++i) dv[i] = f1 > 0.0 ? (f[k->nq + i] - base[k->nq + i]) / f1 : 0.0;
}

/* One correction of the active rows' residual h, positions or rates: δv (nv) = M⁻¹Gᵀ δλ at the state y; again: with the maps and the factor of
 * a state so near that this takes nothing from it. */
static void tr_correction(tr_sim *s, const double *y, const double *h, int again, double *dv) {
  const tr_kernel *k = s->k;
  int a = k->active;
  double b[a], dlam[a];
  if (!again) {
    tr_maps_of(s, y);
    if (!tr_narrow_ideal(s)) tr_factor(s);
  }
  if (s->loops.apart > 0.0) {
    for (int i = 0; i < a; ++i) b[i] = h[k->active_rows[i]];
    k->shift(TR_A(s, c), TR_A(s, w), b, dv);
    return;
  }
  for (int i = 0; i < a; ++i) b[i] = -h[k->active_rows[i]];
  tr_solve_S(s, b, dlam);
  tr_impulse(s, y, dlam, 0, 0, again, dv);
}

static void tr_hold_still(tr_sim *s, double *y);

/* Whether loops are so many that one correction is to do. */
static inline int tr_many_loops(const tr_sim *s) { return s->k->nfill || s->k->shift; }

/* Bring y at time t back onto the manifold, pairs at rest at rest. 1 on success (or nothing to do), 0 when the loops stay open. */
static int tr_project(tr_sim *s, double t, double *y) {
  const tr_kernel *k = s->k;
  if (k->nquat) tr_normalize(s, y);
  if (k->active == 0 || !s->set.project) return 1;
  const double *x = TR_A(s, x), *c = TR_A(s, c) + k->c_closure;
  double *h = TR_A(s, h_res), pos, vel, before = INFINITY, dv[k->nv], dq[k->nq + 4];
  const int most = s->bound.evaluations ? CLOSE_BOUNDED : CLOSE_MAX;
  tr_set_time(s, t);
  for (int it = 0; it < most; ++it) {
    k->closure(x, y, c, h);
    tr_residual(s, h, &pos, &vel);
    if (!(pos < INFINITY)) {
      s->step.trouble = TR_FAIL_NOT_FINITE;
      return 0;
    }
    if (pos <= CLOSED || (it > 1 && pos > SHRINKS * before) || (tr_many_loops(s) && before <= NEAR_CLOSED)) break;
    before = pos;
    tr_correction(s, y, h, 0, dv);
    k->qdot(y, dv, TR_A(s, c), dq);
    for (int i = 0; i < k->nq; ++i) y[i] += dq[i];
    if (k->nquat) tr_normalize(s, y);
    s->stats.projections++;
  }
  s->audit.gap = pos;
  if (pos > OPEN_LOOP) {
    s->step.trouble = TR_FAIL_CLOSURE;
    return 0;
  }
  for (int it = 0; it < CLOSE_RATES_MAX && vel > CLOSED; ++it) {
    double was = vel;
    tr_correction(s, y, h + k->rows, tr_many_loops(s) && before <= NEAR_CLOSED, dv);
    for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
    k->closure(x, y, c, h);
    tr_residual(s, h, &pos, &vel);
    if (vel > SHRINKS * was || (tr_many_loops(s) && was <= NEAR_CLOSED)) break;
  }
  if (s->friction.still) tr_hold_still(s, y);
  return 1;
}
