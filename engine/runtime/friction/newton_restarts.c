/* Restarts of Newton's method: continuation with growing friction, then random starts. These restarts are the last attempt before a
 * run ends, when the usual starts (the last friction, zero, a ball's tilt) have failed. */
#include "friction/friction.h"

#define PART_FIRST 0.25 /* relative to the full friction: first step of the continuation */
#define PART_GROWS 1.5 /* factor on the continuation's step after a success; a failure halves the step */
#define PART_LEAST 1e-3 /* smallest step of the continuation */
#define CHANCES 24 /* number of random starts; their scale is the friction under the loads without friction */
/* relative to the scale of random starts: if the friction from Newton's method is larger, the iteration has diverged */
#define FAR 1e6

static int tr_is_on_branches(const tr_sim *s) {
  TR_NEED(s, TR_HAS_LAW);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    const tr_sliding *v = tr_sliding_of(s, i);
    int flag = tr_mode_flag(tr_mode_of(s, i));
    if (pair->kind == TR_KIND_KINK && (flag == TR_SATURATED) != (fabs(v->speed) > v->border)) return 0;
    if (pair->kind == TR_KIND_SET && pair->cone && flag != TR_STUCK && (flag == TR_CONE) != (v->cone < 0.0)) return 0;
  }
  return 1;
}

/* If possible, replace the unstable root in eta by a stable root on the branches of the modes. Newton's method starts from the
 * frictions at the start of the step, then from zero. */
static void tr_prefer_stable_root(tr_sim *s, double *eta) {
  const int e = s->k->neta;
  double found[e];
  memcpy(found, eta, sizeof found);
  for (int start = 0; start < 2; ++start) {
    if (start) memset(eta, 0, sizeof found);
    else memcpy(eta, TR_A(s, zold) + s->k->active, sizeof found);
    if (tr_newton_with_sense(s, eta) && !tr_is_unstable_root(s) && tr_is_on_branches(s)) return;
  }
  memcpy(eta, found, sizeof found);
  tr_newton_with_sense(s, eta);
}

static double tr_next_random(unsigned *seed) {
  *seed = *seed * 1664525u + 1013904223u;
  return (double)(*seed >> 8) / 8388608.0 - 1.0;
}

static int tr_newton_by_growing_friction(tr_sim *s, double *eta) {
  int e = s->k->neta, ok;
  double last[e], part = 0.0, step = PART_FIRST;
  memset(eta, 0, sizeof last);
  s->friction.eased = 1.0;
  ok = tr_newton(s, eta);
  while (ok && part < 1.0) {
    double next = fmin(part + step, 1.0);
    memcpy(last, eta, sizeof last);
    s->friction.eased = 1.0 - next;
    if (tr_newton(s, eta)) part = next, step *= PART_GROWS;
    else memcpy(eta, last, sizeof last), step *= 0.5, ok = step > PART_LEAST;
  }
  s->friction.eased = 0.0;
  return ok;
}

static void tr_estimate_frictions(tr_sim *s, double *size) {
  const tr_kernel *k = s->k;
  double none[k->neta];
  memset(none, 0, sizeof none);
  tr_evaluate_laws(s, none);
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double most = NO_LOAD;
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) most = fmax(most, fabs(TR_A(s, law)[j]));
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) size[j] = most;
  }
}

static void tr_random_start(const tr_sim *s, const double *size, int which, unsigned *seed, double *eta) {
  double reach = which ? pow(3.0, which % 4 - 1.0) : 0.0;
  for (int i = 0; i < s->k->neta; ++i) eta[i] = reach * size[i] * tr_next_random(seed);
}

/* Whether eta is small enough to be a root. Afterwards, the laws' values belong to eta. */
static int tr_is_of_root_size(tr_sim *s, const double *size, const double *eta) {
  double most = 0.0, load = 0.0;
  for (int i = 0; i < s->k->neta; ++i) most = fmax(most, fabs(eta[i])), load = fmax(load, size[i]);
  tr_evaluate_laws(s, eta);
  return most <= FAR * load;
}

static int tr_is_root(tr_sim *s, const double *size, const double *eta) { return tr_is_of_root_size(s, size, eta) && tr_is_on_branches(s); }

/* Whether the root would be on the branches of the modes if all sliding balls inside their cones were spinning. Later decisions let
 * these balls spin (``events/event_handling.c``, ``events/initial_modes.c``), starting from this root. */
static int tr_is_root_with_spinning_balls(tr_sim *s) {
  tr_mode modes[s->k->nsliders + 1];
  tr_save_modes(s, modes);
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set_valued(s, i) && tr_is_sliding_ball(s, i) && tr_sliding_of(s, i)->cone < 0.0) tr_mode_of(s, i)->flag = TR_CONE;
  int fits = tr_is_on_branches(s);
  tr_restore_modes(s, modes);
  return fits;
}

/* Find η on the branches of the modes from all starts of this file. If there is none, accept a root at which balls would have to
 * spin. Returns 1 on success. */
static int tr_newton_from_anywhere(tr_sim *s, double *eta) {
  double size[s->k->neta], spinning[s->k->neta];
  int spins = 0;
  unsigned seed = 12345u;
  tr_estimate_frictions(s, size);
  for (int start = 0; start <= CHANCES; ++start) { /* start 0 is the continuation */
    if (start) tr_random_start(s, size, start, &seed, eta);
    if (!(start ? tr_newton(s, eta) : tr_newton_by_growing_friction(s, eta))) continue;
    if (!tr_is_of_root_size(s, size, eta)) continue;
    if (tr_is_on_branches(s)) return 1;
    if (!spins && tr_is_root_with_spinning_balls(s)) memcpy(spinning, eta, sizeof spinning), spins = 1;
  }
  if (spins) memcpy(eta, spinning, sizeof spinning), tr_evaluate_laws(s, eta);
  return spins;
}
