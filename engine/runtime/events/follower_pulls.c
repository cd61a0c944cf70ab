/* First instants at which forces of followers without friction become pulls, for a host that watches them (``hosts/api.c``). */
#include "events/events.h"

/* relative to the largest force so far: a force that is smaller at an end of the step may become a pull inside the step */
#define PULL_SMALL 0.2
#define PULL_SETTLED 1e-14 /* fraction of the step: a shorter interval is round-off */
#define PULL_MOST 60     /* largest number of iterations of the search; every third iteration is a bisection */

/* Force of watched follower i at the fraction `at` of the step, positive for a push. NaN if the state cannot be evaluated. */
static double tr_push_inside(tr_sim *s, int i, double at) {
  double *y = TR_A(s, yout);
  tr_evaluate_dense(s, at, y);
  if (s->k->nquat) tr_normalise_quaternions(s, y);
  return tr_rhs(s, s->step.t0 + at * s->step.size, y, TR_A(s, dy)) ? s->pulls.sense[i] * TR_A(s, z)[s->pulls.slot[i]] : NAN;
}

/* Fraction of the step in a…b at which the force of follower i becomes a pull. fa > 0, fb < 0: forces at a and b. */
static double tr_find_pull(tr_sim *s, int i, double a, double fa, double b, double fb) {
  for (int it = 0; it < PULL_MOST && b - a > PULL_SETTLED; ++it) {
    const double secant = a + (b - a) * fa / (fa - fb), m = it % 3 == 2 || !(secant > a && secant < b) ? 0.5 * (a + b) : secant;
    const double f = tr_push_inside(s, i, m);
    if (!isfinite(f)) break;
    if (f < 0.0) b = m, fb = f;
    else a = m, fa = f;
  }
  return b;
}

/* Search the step up to the fraction `end`, quarter by quarter, for a pull of follower i. now: force at `end`. */
static void tr_search_pull(tr_sim *s, int i, double end, double now) {
  double a = 0.0, fa = tr_push_inside(s, i, 0.0);
  if (fa < 0.0) s->pulls.time[i] = s->step.t0; /* the force jumped at the last event */
  for (int q = 1; q <= 4 && fa >= 0.0; ++q) {
    const double b = 0.25 * q * end, fb = q < 4 ? tr_push_inside(s, i, b) : now;
    if (fb < 0.0) {
      s->pulls.time[i] = s->step.t0 + s->step.size * tr_find_pull(s, i, a, fa, b, fb);
      return;
    }
    a = b, fa = fb;
  }
}

static void tr_watch_step_pulls(tr_sim *s, double end) {
  const tr_pulls *w = &s->pulls;
  double kept[tr_solution_size(s)];
  int moved = 0;
  if (!w->count) return;
  tr_save_solution(s, kept);
  for (int i = 0; i < w->count; ++i) {
    if (!isnan(w->time[i])) continue;
    double now = w->sense[i] * TR_A(s, z)[w->slot[i]];
    if (end < 1.0 && tr_ensure_dense(s)) now = tr_push_inside(s, i, end), moved = 1;
    w->peak[i] = fmax(w->peak[i], now);
    if (fmin(now, w->last[i]) < PULL_SMALL * w->peak[i] && tr_ensure_dense(s)) tr_search_pull(s, i, end, now), moved = 1;
    w->last[i] = now;
    if (moved) tr_restore_solution(s, kept);
  }
}
