/* Deciding the modes of all pairs at rest together.
 *
 * All are tried as stuck, and only the worst violator is turned, until none is left; failing that, from other starts and, for few pairs,
 * through all combinations. A pair sticks while the friction it needs stays within what it can hold; it slips when friction then opposes
 * its acceleration. */
#include "modes.h"

#define DECIDE_MAX 40      /* pairs turned from one start: a search that has not ended by then goes round in circles */
#define ENUMERATE_MAX 8    /* pairs whose combinations (3 each, 2 of several components) are all tried when the search fails, */
#define MANY_WORK 6e8      /* multiplications (half a second) for the search by turns among more of them, where what was foreseen does not hold */
#define ENUMERATE_WORK 100000 /* as long as they take no more iterations of Newton's method than this (a fifth of a second) */
#define ONSET_SWEEPS 20    /* over the directions of several pairs that start to slide together */
#define ANSWERS_AT_START 4 /* pairs at rest at the start whose combinations (3 each) are all tried to say whether there is one answer */
#define NO_SPEED 1e-15     /* of the speed unit: round-off of rates that have been made nothing; over a short step it is much as an acceleration */
#define ANSWERS_LATER 2    /* and at every later decision, which has to be quick */
#define DIFFERENT 1e-6     /* of length · rate²: accelerations by which two answers differ; far above round-off, far below a motion's own */

/* Turn a stuck pair into one that slips the way its friction pulls (or, where its motion is prescribed, the way it accelerates); and with it
 * all that are bound to it. */
static void tr_let_slip(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active + pair->eta0, *arm = TR_A(s, arm) + pair->eta0;
  tr_mode *m = tr_mode_of(s, i);
  int prescribed = tr_row_kinds(s)[pair->eta0] == TR_ROW_FREE || tr_contradicts(s, pair->eta0);
  if (tr_bound(s)[i]) {
    double way = 0.0;
    for (int q = 0; q < s->k->nsliders; ++q)
      for (int e = tr_pair_of(s, q)->eta0; e < tr_pair_of(s, q)->eta0 + tr_pair_of(s, q)->neta && tr_bound_to(s, q, i); ++e)
        way += TR_A(s, line)[e] * (prescribed ? tr_freedom_acceleration(s, e) : TR_A(s, z)[s->k->active + e]);
    tr_slip_along(s, i, way);
    return;
  }
  m->flag = TR_SLIPS;
  for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
  if (pair->nrates == 1)
    m->direction[0] = (prescribed ? tr_freedom_acceleration(s, pair->eta0) : eta[0]) < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < pair->nrates; ++j) m->direction[j] = prescribed ? tr_freedom_acceleration(s, pair->eta0 + j) : eta[j] / (arm[j] * arm[j]);
}

/* Stop pair i, and with it all of the pairs `rest` that are bound to it. */
static void tr_let_stick(tr_sim *s, const int *rest, int n, int i) {
  for (int q = 0; q < n; ++q)
    if (tr_bound_to(s, rest[q], i)) tr_mode_of(s, rest[q])->flag = TR_STUCK;
}

/* The acceleration that is none; in a step of impulses what makes a speed that is none, too. */
static double tr_no_acceleration(const tr_sim *s) {
  return s->moreau.h > 0.0 ? fmax(TOL_RESOLVE, NO_SPEED / (s->moreau.h * s->set.rate)) : TOL_RESOLVE;
}

/* How far pair i (at rest) is from satisfying its mode, after tr_solve_modes; > 0: it does not. */
static double tr_misfit(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const tr_mode *m = tr_mode_of(s, i);
  double acc[3], unit = tr_speed_unit(s) * s->set.rate, along = 0.0, worst = -1.0;
  if (tr_flag(m) != TR_STUCK) {
    tr_pair_acceleration(s, i, acc);
    for (int j = 0; j < pair->nrates; ++j) along += acc[j] * m->direction[j] * TR_A(s, arm)[pair->eta0 + j];
    if (pair->nrates == 1) return -along / (unit * TR_A(s, arm)[pair->eta0]) - TOL_RESOLVE;
    for (int j = 0; j < pair->nrates; ++j) worst = fmax(worst, fabs(acc[j]));
    return worst <= tr_faint(s, i) || along > 0.0 ? -1.0 : 1.0;
  }
  for (int j = 0; j < pair->neta; ++j)
    if (tr_contradicts(s, pair->eta0 + j))
      worst = fmax(worst, fabs(tr_freedom_acceleration(s, pair->eta0 + j)) * TR_A(s, arm)[pair->eta0 + j] / unit - tr_no_acceleration(s));
  return fmax(worst, tr_ratio(s, i) - 1.0 - TOL_RESOLVE);
}

/* Multipliers in the modes in force, with the onset directions of pairs of several components that start to slide; `near`: only where they are
 * near those in force. A pair for which there is none is told in *idle. */
static int tr_solve_onsets(tr_sim *s, const int *rest, int n, int near, int *idle) {
  int several = 0;
  *idle = -1;
  for (int q = 0; q < n; ++q) several += tr_slides(s, rest[q]) && tr_pair_of(s, rest[q])->nrates > 1;
  for (int sweep = 0; several && sweep < (several > 1 ? ONSET_SWEEPS : 1); ++sweep)
    for (int q = 0; q < n; ++q)
      if (tr_slides(s, rest[q]) && tr_pair_of(s, rest[q])->nrates > 1 && !tr_onset(s, rest[q], near)) {
        *idle = rest[q];
        return 0;
      }
  return tr_solve_modes(s);
}

/* The worst misfit of the pairs `rest` (n) in the modes in force; -1: none. After tr_solve_modes. */
static int tr_worst_misfit(tr_sim *s, const int *rest, int n) {
  double most = 0.0;
  int worst = -1;
  for (int q = 0; q < n; ++q) {
    double v = tr_misfit(s, rest[q]);
    if (!(v <= most)) most = v, worst = rest[q];
  }
  return worst;
}

#include "anew.c"
#include "idle.c"

/* From the modes in force: turn the worst misfit until there is none. In a step of impulses what slides when it begins goes on much as it does,
 * or sticks; other directions are for what cannot stick. */
static int tr_settle_from(tr_sim *s, const int *rest, int n) {
  const int impulses = s->moreau.h > 0.0;
  for (int it = 0; it < DECIDE_MAX; ++it) {
    int worst;
    if (!tr_solve_onsets(s, rest, n, impulses && it == 0, &worst)) {
      if (worst < 0 || !impulses) return 0;
      tr_let_stick(s, rest, n, worst);
      continue;
    }
    worst = tr_worst_misfit(s, rest, n);
    if (worst < 0) return tr_holds(s, rest, n) && tr_hold_idle(s, rest, n);
    if (!tr_slides(s, worst) && tr_stick_by_kept(s, rest, n)) return tr_hold_idle(s, rest, n);
    if (!tr_slides(s, worst)) tr_let_slip(s, worst); else tr_let_stick(s, rest, n, worst);
  }
  return 0;
}

#include "together.c"
#include "at_once.c"

/* Of the pairs at rest those that are decided by themselves: one of each class. Their number. */
static int tr_decided_apart(const tr_sim *s, const int *rest, int n, int *apart) {
  int count = 0;
  for (int q = 0; q < n; ++q) {
    int first = 1;
    for (int p = 0; p < q; ++p) first &= !tr_bound_to(s, rest[p], rest[q]);
    if (first) apart[count++] = rest[q];
  }
  return count;
}

/* Whether the pairs at rest are too many for a search one by one, or through all combinations. */
static int tr_are_many(const tr_sim *s, const int *rest, int n) {
  int apart[n + 1];
  return n > ENUMERATE_MAX && tr_decided_apart(s, rest, n, apart) > ENUMERATE_MAX;
}

/* In how many ways pair i may rest or start: two along its line, each way; where it has none, the one that is found from a guess. */
static int tr_ways(const tr_sim *s, int i) { return tr_pair_of(s, i)->nrates == 1 || tr_bound(s)[i] ? 3 : 2; }

/* Put the combination `code` of the pairs at rest in force: each that is decided by itself (`apart`, count) sticks, or slips one way or the
 * other, and with it its class; one of several components without a line sticks, or slips the way that is found from its `guess`. */
static void tr_put_combination(tr_sim *s, const int *rest, int n, const int *apart, int count, int code, const double *guess) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  for (int u = 0; u < count; ++u) {
    const int i = apart[u], ways = tr_ways(s, i), way = code % ways;
    tr_mode *m = tr_mode_of(s, i);
    code /= ways;
    if (!way) continue;
    if (tr_bound(s)[i]) {
      tr_slip_along(s, i, way == 2 ? -1.0 : 1.0);
      continue;
    }
    m->flag = TR_SLIPS;
    if (ways == 3) m->direction[0] = way == 2 ? -1.0 : 1.0;
    else memcpy(m->direction, guess + 3 * u, sizeof(double) * 3);
  }
}

/* All combinations of the pairs at rest. Returns how many satisfy everything and accelerate differently, `most` at most; the first of
 * them is left in force. */
static int tr_enumerate(tr_sim *s, const int *rest, int n, int most) {
  const tr_kernel *k = s->k;
  int total = 1, found = 0, apart[n + 1], count = tr_decided_apart(s, rest, n, apart);
  const long work = s->stats.newton_iterations + ENUMERATE_WORK;
  double *eta = TR_A(s, z) + k->active, known[k->neta + 1], first[k->neta + 1], guess[3 * n + 1];
  tr_mode modes[k->nsliders + 1];
  if (count > ENUMERATE_MAX) return 0;
  for (int u = 0; u < count; ++u) {
    total *= tr_ways(s, apart[u]);
    memcpy(guess + 3 * u, tr_mode_of(s, apart[u])->direction, sizeof(double) * 3);
  }
  for (int code = 0; code < total && found < most && s->stats.newton_iterations < work && !s->ask.stop; ++code) {
    tr_put_combination(s, rest, n, apart, count, code, guess);
    memset(eta, 0, sizeof(double) * k->neta);
    int idle, ok = tr_solve_onsets(s, rest, n, 0, &idle);
    for (int q = 0; q < n && ok; ++q) ok = tr_misfit(s, rest[q]) <= 0.0;
    if (!ok || !tr_holds(s, rest, n)) continue;
    double gap = 0.0;
    for (int i = 0; i < k->neta; ++i) {
      double acc = tr_freedom_acceleration(s, i);
      if (found) gap = fmax(gap, fabs(acc - known[i]) * TR_A(s, arm)[i]);
      else known[i] = acc;
    }
    if (found == 0) tr_keep_modes(s, modes), memcpy(first, eta, sizeof first);
    if (found == 0 || gap > DIFFERENT * tr_speed_unit(s) * s->set.rate) ++found;
  }
  if (!found) return 0;
  tr_put_modes(s, modes), memcpy(eta, first, sizeof(double) * k->neta);
  tr_solve_modes(s);
  return found;
}

/* Modes of the pairs at rest from those in force, with ``released`` (its mode says how it slips; -1: none) let go, turned one by one. old: η
 * where Newton's iteration begins. */
static int tr_decide_by_turns(tr_sim *s, const int *rest, int n, int released, const double *old) {
  double *eta = TR_A(s, z) + s->k->active;
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = released >= 0 && tr_bound_to(s, rest[q], released) ? TR_SLIPS : TR_STUCK;
  if (tr_settle_from(s, rest, n)) return 1;
  if (released >= 0) {
    memcpy(eta, old, sizeof(double) * s->k->neta);
    for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
    if (tr_settle_from(s, rest, n)) return 1;
  }
  memcpy(eta, old, sizeof(double) * s->k->neta);
  for (int q = 0; q < n; ++q) tr_let_slip(s, rest[q]);
  return tr_settle_from(s, rest, n);
}

/* The same of many pairs: all at once, or failing that by turns for as long as the work allows. */
static int tr_decide_many(tr_sim *s, const int *rest, int n, int released, const double *old) {
  const tr_mode slips = *tr_mode_of(s, released >= 0 ? released : 0);
  double *eta = TR_A(s, z) + s->k->active;
  if (tr_settle_at_once(s, rest, n) || tr_settle_together(s, rest, n)) return 1;
  s->friction.work = s->stats.newton_iterations + s->stats.creeps + (long)(MANY_WORK / pow(s->k->neta, 3.0));
  int found = tr_settle_from(s, rest, n);
  if (!found) {
    memcpy(eta, old, sizeof(double) * s->k->neta);
    if (released >= 0) *tr_mode_of(s, released) = slips;
    found = tr_decide_by_turns(s, rest, n, released, old);
  }
  s->friction.work = 0;
  return found;
}

/* Modes of the pairs at rest at the state whose maps are in place. ``released``: the pair that has just been let go (its mode says
 * how it slips), or −1. 1 when found, 2 when all hold on and only share their load anew. */
static int tr_decide(tr_sim *s, const int *rest, int n, int released) {
  double *eta = TR_A(s, z) + s->k->active, old[s->k->neta + 1];
  const int many = tr_are_many(s, rest, n);
  memcpy(old, eta, sizeof(double) * s->k->neta);
  s->friction.undecided = 0;
  const int shares = s->friction.shares;
  for (s->friction.kept = TR_KEEPS_NONE; released >= 0 && shares && s->friction.kept <= TR_KEEPS_PLACED; ++s->friction.kept) {
    if (tr_hold_anew(s, rest, n)) return 2;
    memcpy(eta, old, sizeof(double) * s->k->neta);
  }
  s->friction.kept = TR_KEEPS_NONE;
  if (many) return !(s->friction.undecided = !tr_decide_many(s, rest, n, released, old));
  return tr_decide_by_turns(s, rest, n, released, old) || tr_settle_at_once(s, rest, n) || tr_enumerate(s, rest, n, 1) > 0;
}

/* Note when other modes of these pairs, `most` of them at most, would have done as well: then the motion is not determined by the law. */
static void tr_note_answers(tr_sim *s, double t, const int *rest, int n, int most) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  double z[k->active + k->neta + 1];
  if (n > most || s->audit.open_t >= 0.0 || s->bound.evaluations) return;
  for (int q = 0; q < n; ++q)
    if (tr_pair_of(s, rest[q])->nrates > 1) return;
  tr_keep_modes(s, modes);
  memcpy(z, TR_A(s, z), sizeof(double) * (k->active + k->neta));
  if (tr_enumerate(s, rest, n, 2) > 1) s->audit.open_t = t, s->audit.open_pair = rest[0];
  tr_put_modes(s, modes);
  memcpy(TR_A(s, z), z, sizeof(double) * (k->active + k->neta));
  s->step.along = 0;
  tr_note_modes(s);
}
