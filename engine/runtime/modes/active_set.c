/* Modes of all pairs at rest (theory, "Deciding modes"). A pair may stick if the friction that rest needs is within its capacity. A
 * pair may slip if its friction then opposes its acceleration. The search starts with all pairs stuck, and repeatedly changes the
 * mode that violates its condition most (the largest misfit). If this search fails, another search starts from other modes.
 * Finally, all combinations of the modes of a few pairs are tried. */
#include "modes/modes.h"

/* Largest number of pairs for which all mode combinations are tried: 3 modes per pair, 2 for pairs with several components. */
#define ENUMERATE_MAX 8
/* multiplications (half a second): limit of the one-by-one search, if there are more than ENUMERATE_MAX pairs */
#define MANY_WORK 6e8
#define NEARBY_WORK 60     /* Newton iterations: limit of the search through neighbouring modes; usually enough for ten mode changes */
#define ENUMERATE_WORK 100000 /* Newton iterations (a fifth of a second): limit of the search over all combinations */
#define ONSET_SWEEPS 20    /* largest number of iterations on the directions of several pairs that start to slide together */
/* in units of length · rate²: two solutions whose accelerations differ by more are different; far above round-off, far below
 * typical motion */
#define DIFFERENT 1e-6

/* Solve for the multipliers in the modes in force, with onset directions for pairs of several components. near: whether to accept
 * only directions near the present ones. Returns 0 on failure; *idle then receives the pair without a direction, or −1. */
static int tr_solve_with_onsets(tr_sim *s, const int *rest, int n, int near, int *idle) {
  int several = 0;
  *idle = -1;
  for (int q = 0; q < n; ++q) several += tr_is_sliding(s, rest[q]) && tr_pair_of(s, rest[q])->nrates > 1;
  for (int sweep = 0; several && sweep < (several > 1 ? ONSET_SWEEPS : 1); ++sweep)
    for (int q = 0; q < n; ++q)
      if (tr_is_sliding(s, rest[q]) && tr_pair_of(s, rest[q])->nrates > 1 && !tr_find_onset(s, rest[q], near)) {
        *idle = rest[q];
        return 0;
      }
  return tr_solve_in_modes(s);
}

/* Whether stored loads may hold the stuck pairs. The search for stored loads takes many solutions. In a long impulse step, loads
 * are therefore stored only for pairs at rest at its start; pairs that move there usually reverse. */
static int tr_may_store_loads(tr_sim *s, const int *rest, int n) {
  int still = !(s->moreau.h > s->moreau.decides);
  for (int q = 0; q < n && !still; ++q)
    if (tr_is_stuck(s, rest[q]) && !tr_is_at_rest(s, rest[q])) return 0;
  return 1;
}

static int tr_resolve_misfits(tr_sim *s, const int *rest, int n) {
  const int impulses = s->moreau.h > 0.0;
  int classed = !impulses; /* in impulse steps, classes are found only when a mode changes */
  for (int it = 0; it < DECISION_STEPS; ++it) {
    int worst;
    if (!tr_solve_with_onsets(s, rest, n, impulses && it == 0, &worst)) {
      /* the sharing rule may have no root for pairs that other loads hold */
      if (worst < 0 && tr_may_store_loads(s, rest, n) && tr_stick_by_stored_loads(s, rest, n)) return tr_stick_idle_pairs(s, rest, n);
      if (worst < 0 || !impulses) return 0;
      if (!classed) tr_find_coupled_pairs(s), classed = 1;
      tr_let_stick(s, rest, n, worst);
      continue;
    }
    worst = tr_find_worst_misfit(s, rest, n);
    if (worst < 0) return tr_is_valid_decision(s, rest, n) && tr_stick_idle_pairs(s, rest, n);
    if (!classed) tr_find_coupled_pairs(s), classed = 1;
    if (!tr_is_sliding(s, worst) && tr_may_store_loads(s, rest, n) && tr_stick_by_stored_loads(s, rest, n)) return tr_stick_idle_pairs(s, rest, n);
    if (!tr_is_sliding(s, worst)) tr_let_slip(s, worst); else tr_let_stick(s, rest, n, worst);
  }
  return 0;
}

/* Collect one pair of each class of coupled pairs, and each uncoupled pair, in `apart`. Returns their number. */
static int tr_collect_independent(const tr_sim *s, const int *rest, int n, int *apart) {
  int count = 0;
  for (int q = 0; q < n; ++q) {
    int first = 1;
    for (int p = 0; p < q; ++p) first &= !tr_are_coupled(s, rest[p], rest[q]);
    if (first) apart[count++] = rest[q];
  }
  return count;
}

static int tr_are_many_pairs(const tr_sim *s, const int *rest, int n) {
  int apart[n + 1];
  return n > ENUMERATE_MAX && tr_collect_independent(s, rest, n, apart) > ENUMERATE_MAX;
}

/* Number of modes to try for pair i. A pair on a line has 3 (stuck, and both directions); other pairs have 2 (stuck, and sliding in
 * a direction found from a guess). */
static int tr_mode_count(const tr_sim *s, int i) { return tr_pair_of(s, i)->nrates == 1 || tr_pair_classes(s)[i] ? 3 : 2; }

/* Apply mode combination number `code`. Each of the `count` pairs in `apart` stands for its class, or for itself if count = n.
 * guess: direction (3 components) for each pair in `apart`. */
static void tr_set_combination(tr_sim *s, const int *rest, int n, const int *apart, int count, int code, const double *guess) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  for (int u = 0; u < count; ++u) {
    const int i = apart[u], ways = tr_mode_count(s, i), way = code % ways;
    tr_mode *m = tr_mode_of(s, i);
    code /= ways;
    if (!way) continue;
    if (tr_pair_classes(s)[i]) {
      tr_let_class_slip(s, i, way == 2 ? -1.0 : 1.0, count < n);
      continue;
    }
    m->flag = TR_SLIPS;
    if (ways == 3) m->direction[0] = way == 2 ? -1.0 : 1.0;
    else memcpy(m->direction, guess + 3 * u, sizeof(double) * 3);
  }
}

static int tr_stuck_count(const tr_sim *s, const int *rest, int n) {
  int count = 0;
  for (int q = 0; q < n; ++q) count += tr_is_stuck(s, rest[q]);
  return count;
}

/* Try all combinations of modes: of classes or, with `single`, of single pairs. Returns the number of combinations that satisfy all
 * laws and differ in their accelerations, at most `most`. Of these combinations, the one with the most pairs that stick stays in
 * force. Returns 0 if there are too many combinations to try. */
static int tr_try_all_combinations(tr_sim *s, const int *rest, int n, int single, int most) {
  const tr_kernel *k = s->k;
  int total = 1, found = 0, stuck = -1, apart[n + 1], count = tr_collect_independent(s, rest, n, apart);
  if (single) memcpy(apart, rest, sizeof(int) * n), count = n;
  const long work = s->stats.newton_iterations + ENUMERATE_WORK;
  double *eta = TR_A(s, z) + k->active, known[k->neta + 1], kept[k->neta + 1], guess[3 * n + 1];
  tr_mode modes[k->nsliders + 1];
  if (count > ENUMERATE_MAX) return 0;
  for (int u = 0; u < count; ++u) {
    total *= tr_mode_count(s, apart[u]);
    memcpy(guess + 3 * u, tr_mode_of(s, apart[u])->direction, sizeof(double) * 3);
  }
  for (int code = 0; code < total && found < most && s->stats.newton_iterations < work && !s->ask.cancelled; ++code) {
    tr_set_combination(s, rest, n, apart, count, code, guess);
    memset(eta, 0, sizeof(double) * k->neta);
    int idle, ok = tr_solve_with_onsets(s, rest, n, 0, &idle);
    for (int q = 0; q < n && ok; ++q) ok = tr_mode_misfit(s, rest[q]) <= 0.0;
    if (!ok || !tr_is_valid_decision(s, rest, n)) continue;
    double gap = 0.0;
    for (int i = 0; i < k->neta; ++i) {
      double acc = tr_freedom_acceleration(s, i);
      if (found) gap = fmax(gap, fabs(acc - known[i]) * TR_A(s, lever)[i]);
      else known[i] = acc;
    }
    if (found && gap <= DIFFERENT * tr_speed_unit(s) * s->set.rate) continue;
    ++found;
    if (tr_stuck_count(s, rest, n) <= stuck) continue;
    stuck = tr_stuck_count(s, rest, n);
    tr_save_modes(s, modes), memcpy(kept, eta, sizeof kept);
  }
  if (!found) return 0;
  tr_restore_modes(s, modes), memcpy(eta, kept, sizeof(double) * k->neta);
  tr_solve_in_modes(s);
  return found;
}

/* Search from the modes in force, then with all pairs stuck, then with all pairs slipping. released: pair just released, with its
 * direction in its mode; −1: no pair. old: initial η of Newton's method. */
static int tr_decide_one_by_one(tr_sim *s, const int *rest, int n, int released, const double *old) {
  double *eta = TR_A(s, z) + s->k->active;
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = released >= 0 && tr_are_coupled(s, rest[q], released) ? TR_SLIPS : TR_STUCK;
  if (tr_resolve_misfits(s, rest, n)) return 1;
  if (released >= 0) {
    memcpy(eta, old, sizeof(double) * s->k->neta);
    for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
    if (tr_resolve_misfits(s, rest, n)) return 1;
  }
  memcpy(eta, old, sizeof(double) * s->k->neta);
  for (int q = 0; q < n; ++q) tr_let_slip(s, rest[q]);
  return tr_resolve_misfits(s, rest, n);
}

/* Search one by one along the recursion, for one-component pairs of a tree. An event among many pairs at rest usually changes few
 * modes. A few passes over the bodies then cost less than the matrices of all pairs. Restores modes and η, and returns 0, on
 * failure or beyond NEARBY_WORK. */
static int tr_decide_nearby(tr_sim *s, const int *rest, int n, int released) {
  const tr_kernel *k = s->k;
  double eta[k->neta + 1];
  tr_mode modes[k->nsliders + 1];
  if (!k->begin || k->active) return 0;
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_pair_of(s, i)->nrates > 1) return 0;
  tr_save_modes(s, modes), memcpy(eta, TR_A(s, z), sizeof(double) * k->neta);
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = rest[q] == released ? TR_SLIPS : TR_STUCK;
  s->friction.work = s->stats.newton_iterations + s->stats.creeps + NEARBY_WORK;
  const int found = tr_resolve_misfits(s, rest, n);
  s->friction.work = 0;
  if (!found) tr_restore_modes(s, modes), memcpy(TR_A(s, z), eta, sizeof(double) * k->neta);
  return found;
}

/* Like tr_decide_one_by_one, for many pairs. Tries neighbouring modes, then all pairs at once, then one pair after another within
 * MANY_WORK. */
static int tr_decide_many(tr_sim *s, const int *rest, int n, int released, const double *old) {
  const tr_mode slips = *tr_mode_of(s, released >= 0 ? released : 0);
  double *eta = TR_A(s, z) + s->k->active;
  if (tr_decide_nearby(s, rest, n, released) || tr_decide_by_cones(s, rest, n) || tr_decide_by_prediction(s, rest, n)) return 1;
  s->friction.work = s->stats.newton_iterations + s->stats.creeps + (long)(MANY_WORK / pow(s->k->neta, 3.0));
  int found = tr_resolve_misfits(s, rest, n);
  if (!found) {
    memcpy(eta, old, sizeof(double) * s->k->neta);
    if (released >= 0) *tr_mode_of(s, released) = slips;
    found = tr_decide_one_by_one(s, rest, n, released, old);
  }
  s->friction.work = 0;
  return found;
}

/* Release the class of the pair `released`, if the class shared its load by the sharing rule. One freedom moves all pairs of the
 * class. Each pair has reached its capacity against this motion, so all can slide. (Other distributions of the load could hold the
 * class a little longer. Slow creep does not lead to such distributions, because creep loads each pair against the motion.) Returns
 * 0 if sliding violates a law. */
static int tr_release_class(tr_sim *s, const int *rest, int n, int released) {
  int idle, apart[n + 1];
  if (released < 0 || !s->friction.shared || s->friction.stored || tr_collect_independent(s, rest, n, apart) > 1) return 0;
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_SLIPS;
  return tr_solve_with_onsets(s, rest, n, 0, &idle) && tr_find_worst_misfit(s, rest, n) < 0 && tr_is_valid_decision(s, rest, n);
}

static int tr_decide_modes(tr_sim *s, const int *rest, int n, int released) {
  double *eta = TR_A(s, z) + s->k->active, old[s->k->neta + 1];
  const int many = tr_are_many_pairs(s, rest, n);
  tr_mode start[s->k->nsliders + 1];
  tr_save_modes(s, start);
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->tilt = 0.0;
  memcpy(old, eta, sizeof(double) * s->k->neta);
  s->friction.undecided = 0;
  if (tr_release_class(s, rest, n, released)) return 1;
  memcpy(eta, old, sizeof(double) * s->k->neta);
  const int shares = s->friction.shared;
  if (released >= 0 && shares && tr_slide_by_yielding(s, rest, n, released, start, 1)) return 1;
  for (s->friction.stored = TR_STORES_NONE; released >= 0 && shares && s->friction.stored <= TR_STORES_PLACED; ++s->friction.stored) {
    if (s->friction.stored == TR_STORES_PLACED && tr_hold_by_yielding(s, rest, n, released, start)) return 2;
    if (s->friction.stored == TR_STORES_PLACED && tr_slide_by_yielding(s, rest, n, released, start, 0)) return 1;
    memcpy(eta, old, sizeof(double) * s->k->neta);
    if (tr_hold_by_resharing(s, rest, n)) return 2;
    memcpy(eta, old, sizeof(double) * s->k->neta);
  }
  s->friction.stored = TR_STORES_NONE;
  if (many) return !(s->friction.undecided = !tr_decide_many(s, rest, n, released, old));
  if (tr_decide_one_by_one(s, rest, n, released, old) || tr_decide_by_cones(s, rest, n) || tr_try_all_combinations(s, rest, n, 0, 1) > 0) return 1;
  /* where a class begins to slide, some of its pairs may yield a moment earlier than the others */
  return released >= 0 && tr_try_all_combinations(s, rest, n, 1, 1) > 0;
}

static void tr_prefer_sticking(tr_sim *s, double t, const int *rest, int n, int released, int most) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  double z[k->active + k->neta + 1];
  if (n > most || s->bound.evaluations) return;
  for (int q = 0; q < n; ++q)
    if (tr_pair_of(s, rest[q])->nrates > 1) return;
  tr_save_modes(s, modes);
  memcpy(z, TR_A(s, z), sizeof(double) * (k->active + k->neta));
  const int several = tr_try_all_combinations(s, rest, n, 0, 2) > 1, stuck = tr_stuck_count(s, rest, n);
  if (several && s->audit.open_t < 0.0) s->audit.open_t = t, s->audit.open_pair = rest[0];
  tr_mode best[k->nsliders + 1];
  tr_save_modes(s, best), tr_restore_modes(s, modes);
  if (several && released < 0 && stuck > tr_stuck_count(s, rest, n)) {
    tr_restore_modes(s, best);
  } else {
    memcpy(TR_A(s, z), z, sizeof(double) * (k->active + k->neta));
  }
  s->step.recursive = 0;
  tr_set_row_kinds(s);
}
