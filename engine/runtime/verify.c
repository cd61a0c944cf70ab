/* Whether what is taken for an answer is one: the modes in force and the multipliers in place, held against what the kernel says about the
 * state and nothing else. No residual, no rank, no eliminated map of the code that found the answer is used here, so that a mistake there
 * is seen. Asked of every decision and of the end of every accepted step (METHOD, "Answers are checked"). */
#include "answer.c"

/* By how much a law may be broken. Equations are measured against the sum of the sizes of what cancels in them: round-off of a solution
 * is 1e-14 of it, but near a singular position of a loop a pivot p is given up, which leaves its root, at most 3e-5 (``loops.c``). */
#define LOOP_OPENS 1e-4
#define FAINT_OPENING 1e-7 /* of length · rate² (rate²): a row of nothing else has no size of its own to be measured by */
#define REST_MOVES 1e-4
#define STANDS 1e-11       /* of the speed unit times the rate: no acceleration at all (as TOL_RESOLVE), where nothing is there to cancel */
#define LAW_MISSED 1e-6    /* of what a law's answer is made of: near a ball's cone half of the digits are left */
#define CONE_BROKEN 1e-7   /* of the friction ratio; pairs are let go at 1e-10 */
#define BRANCH_MISSED 1e-6 /* of a kink's speed, of (sine)² of a ball's tilt */
#define POWER_GIVEN 1e-6   /* of friction times speed: so much may be against the others of a pair's components */
#define AT_REST_SPEED 1e-11 /* of the speed unit: has no direction */
#define CREEPS 1e-7        /* of the speed unit: what closing loops leaves of the speed of a held pair, or lets one on a cut joint gather, */
#define CREEPS_PART 10.0   /* and of the tolerance */
#define START_BACKWARDS 1e-6 /* of the accelerations that cancel: a pair that starts may be so near to not starting */
#define SLOW_TURNS 1e-10   /* of the speed unit: slower sliding of several components may turn by more than a right angle (as NEAR_MISS) */
#define FAINT_START 1e-5   /* of what cancels: less acceleration has no direction (as FAINT_RATIO) */
#define FRICTION_NOTHING 1e-12 /* of the load: no friction at all */
#define NOTHING_HELD 1e-290 /* N: friction of nothing */
#define STOP_MISSED 1e-9   /* of the length, or rad: how deep an open stop, or how far off a pressed one, may be */

/* Speed of a pair at rest that is none, m/s: what closing the loops leaves of it. */
static inline double tr_creep(const tr_sim *s) { return fmax(CREEPS, CREEPS_PART * s->set.rtol) * tr_speed_unit(s); }

/* Whether row i of the loops has just been given up, because the mechanism passes a singular position: the one thing asked of the code
 * that found the answer. No λ carries such a row there, and for a moment it is off by more than any bound of its own size. */
static int tr_given_up(const tr_sim *s, int i) {
  const int *perm = (const int *)TR_A(s, perm);
  if (s->loops.rank_now >= s->loops.rank) return 0;
  for (int q = s->loops.rank_now; q < s->k->active; ++q)
    if (perm[q] == i) return 1;
  return 0;
}

/* What may be left of row i of the loops besides a part of its size. */
static inline double tr_faint_opening(const tr_sim *s, int i) {
  return FAINT_OPENING * tr_row_unit(s, s->k->active_rows[i]) * s->set.rate * s->set.rate;
}

/* Whether the loops' equations are met as exactly as they usually are: to a part of the first of what cancels in each alone. */
static int tr_loops_closed(const tr_sim *s, const double *maps, const double *z) {
  const tr_kernel *k = s->k;
  const double *g0 = map_g0(k, maps);
  int a = k->active, closed = 1;
  double r[a + 1];
  memcpy(r, g0, sizeof(double) * a);
  tr_add_columns(a, a, maps, z, 1.0, r);
  tr_add_columns(a, k->neta, map_Se(k, maps), z + a, 1.0, r);
  for (int i = 0; i < a; ++i) closed &= fabs(r[i]) <= LOOP_OPENS * fabs(g0[i]) + tr_faint_opening(s, i);
  return closed;
}

/* The same of an answer that was found without maps: every row has to be met so. */
static int tr_rows_closed(const tr_sim *s, const tr_answer *it) {
  const double *gap = it->acc + s->k->neta, *first = it->acc_size + s->k->neta;
  int closed = 1;
  for (int i = 0; i < s->k->active; ++i) closed &= fabs(gap[i]) <= LOOP_OPENS * fabs(first[i]) + tr_faint_opening(s, i);
  return closed;
}

/* The loops' equations S λ + Se η + g0 = 0. */
static int tr_loops_open(const tr_sim *s, const double *maps, const double *z) {
  const tr_kernel *k = s->k;
  int a = k->active;
  double r[a + 1], size[a + 1];
  if (tr_loops_closed(s, maps, z)) return 0;
  tr_begin_sum(a, map_g0(k, maps), r, size);
  tr_sum_up(a, a, maps, z, r, size);
  tr_sum_up(a, k->neta, map_Se(k, maps), z + a, r, size);
  for (int i = 0; i < a; ++i)
    if (!(fabs(r[i]) <= LOOP_OPENS * size[i] + tr_faint_opening(s, i)) && !tr_given_up(s, i)) return TR_BREAKS_LOOP;
  return 0;
}

/* Friction of pair i against its law, of which it is a part of element el's. */
static int tr_law_missed(tr_sim *s, int i, tr_answer *it) {
  const tr_pair *pair = tr_pair_of(s, i);
  const tr_element *el = s->k->element + pair->element;
  const double *eta = TR_A(s, z) + s->k->active;
  double gap = 0.0, size = 0.0, force = 0.0, load = 0.0; /* without a coefficient friction is the round-off of its load */
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e) {
    const double off = fabs(eta[e] - it->law[e]);
    gap = fmax(gap, off), force = fmax(force, off / TR_A(s, arm)[e]), size += fabs(it->law[e]);
  }
  for (int q = 0; q < el->needs; ++q) load = fmax(load, fabs(it->N[el->n0 + q]));
  if (gap <= LAW_MISSED * size || force <= FRICTION_NOTHING * load) return 0;
  tr_size_laws(s, it);
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e)
    for (int q = 0; q < el->needs; ++q) size += fabs(it->dn[el->dn0 + e - el->eta0 + q * el->neta]) * it->N_size[el->n0 + q];
  return gap <= LAW_MISSED * size ? 0 : TR_BREAKS_LAW;
}

/* A pair whose mode is a branch of its law has to be on it. */
static int tr_branch_missed(const tr_sim *s, int i, const tr_sliding *v) {
  const tr_pair *pair = tr_pair_of(s, i);
  int flag = tr_flag(tr_mode_of(s, i));
  double over = pair->kind == TR_KIND_KINK ? fabs(v->speed) / v->border - 1.0 : pair->kind == TR_KIND_SET && pair->cone ? v->cone : 0.0;
  if (over == 0.0) return 0;
  int beyond = pair->kind == TR_KIND_KINK ? flag == TR_SATURATED : flag != TR_CONE;
  return (beyond ? -over : over) <= BRANCH_MISSED ? 0 : TR_BREAKS_BRANCH;
}

/* Sliding friction takes energy: its power on pair i with its rates, or (starts) with the accelerations with which it is about to slide. */
static int tr_drives(const tr_sim *s, int i, const tr_answer *it, int starts) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active + pair->eta0, *arm = TR_A(s, arm) + pair->eta0;
  const double *v0 = starts ? it->acc + pair->eta0 : map_rates(s->k, TR_A(s, maps)) + pair->rate0;
  const tr_element *el = s->k->element + pair->element;
  double friction = 0.0, load = 0.0; /* without a coefficient friction is the round-off of its load */
  double power = 0.0, size = 0.0, fast = 0.0, cancel = 0.0, slow = tr_speed_unit(s) * (pair->nrates == 1 ? AT_REST_SPEED : SLOW_TURNS);
  for (int j = 0; j < pair->nrates; ++j) power += eta[j] * v0[j];
  if (power >= 0.0) return 0; /* the levers below cancel in the power */
  power = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    double v = v0[j] * arm[j], f = eta[j] / arm[j];
    power += f * v, size += fabs(f * v), fast += v * v, friction = fmax(friction, fabs(f));
    if (starts) cancel += it->acc_size[pair->eta0 + j] * arm[j], size += fabs(f) * it->acc_size[pair->eta0 + j] * arm[j];
  }
  for (int q = 0; q < el->needs; ++q) load = fmax(load, fabs(it->N[el->n0 + q]));
  if (friction <= FRICTION_NOTHING * load) return 0;
  if (sqrt(fast) <= (starts ? FAINT_START * cancel : slow)) return 0;
  return power >= -(starts ? START_BACKWARDS : POWER_GIVEN) * size ? 0 : starts ? TR_BREAKS_START : TR_BREAKS_POWER;
}

/* A held pair does not move (at the end of a step of impulses), and carries no more than it can. */
static int tr_not_held(const tr_sim *s, int i, const tr_answer *it, const tr_hold *hold) {
  const tr_pair *pair = tr_pair_of(s, i);
  int broken = 0;
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e) {
    if (tr_row_kinds(s)[e] == TR_ROW_FREE && tr_comes_to_rest(s, e, it->acc[e])) continue;
    if (!(fabs(it->acc[e]) <= REST_MOVES * it->acc_size[e] + STANDS * tr_speed_unit(s) * s->set.rate / TR_A(s, arm)[e])) broken = TR_BREAKS_REST;
  }
  const double crawl = pair->v0 >= 0 && !s->k->rows ? AT_REST_SPEED * tr_speed_unit(s) : tr_creep(s);
  if (!(s->moreau.h > 0.0) && !(tr_pair_speed(s, i) <= crawl)) broken = TR_BREAKS_REST;
  double over = fmax(hold->size - hold->capacity, hold->beyond - CONE_BROKEN * hold->capacity);
  return over <= CONE_BROKEN * hold->capacity + NOTHING_HELD ? broken : broken | TR_BREAKS_CONE;
}

/* A stop presses while something is in it, and only then. depth: of every stop. */
static int tr_stops_missed(const tr_sim *s, const double *y) {
  const tr_kernel *k = s->k;
  double depth[k->nstops + 1];
  tr_depths(s, y, depth);
  for (int i = 0; i < k->nstops; ++i)
    if (!((tr_pressed(s, i) ? -depth[i] : depth[i]) <= STOP_MISSED * fmax(1.0, s->set.length))) return TR_BREAKS_STOP;
  return 0;
}

/* Whether any pair is held. */
static int tr_any_stuck(const tr_sim *s) {
  int any = 0;
  for (int i = 0; i < s->k->nsliders; ++i) any |= tr_is_stuck(s, i);
  return any;
}

/* Whether pair i is one of `rest`. */
static int tr_is_one_of(const int *rest, int n, int i) {
  for (int q = 0; q < n; ++q)
    if (rest[q] == i) return 1;
  return 0;
}

/* The friction of every pair. `rest`: those that have just been decided, which start from rest (0: none, and branches are asked for). */
static int tr_pairs_broken(tr_sim *s, tr_answer *it, const int *rest, int n) {
  const tr_kernel *k = s->k;
  tr_hold hold[k->nsliders + 1];
  int broken = 0;
  if (tr_any_stuck(s)) k->held_alone(it->N, TR_A(s, z) + k->active, TR_A(s, x), TR_A(s, c) + k->c_held, (double *)hold);
  for (int i = 0; i < k->nsliders; ++i) {
    if (i == s->friction.freed) continue;
    if (tr_is_stuck(s, i)) {
      broken |= tr_not_held(s, i, it, hold + i);
      continue;
    }
    int starts = s->moreau.h > 0.0 || tr_is_one_of(rest, n, i);
    broken |= tr_law_missed(s, i, it);
    if (!rest) broken |= tr_branch_missed(s, i, it->sliding + i);
    if (tr_is_set(s, i)) broken |= tr_drives(s, i, it, starts);
  }
  return broken;
}

/* Which laws the answer in place breaks (bits TR_BREAKS_…): at the state y whose maps are in place, with the modes in force and the
 * multipliers in z. `rest` (n): pairs that are just being decided; 0: the end of a step, where branches and stops are looked at, too. */
static int tr_broken(tr_sim *s, const double *y, const int *rest, int n) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *z = TR_A(s, z);
  int a = k->active, e = k->neta, m = k->nn, broken = k->nstops && !rest ? tr_stops_missed(s, y) : 0;
  double acc[2 * (e + a) + 1], N[2 * m + 1], law[e + 1], dn[k->ndn + 1];
  tr_sliding sliding[k->nsliders + 1];
  tr_answer it = {acc, acc + e + a, N, N + m, law, dn, sliding, 0};
  if (e && !s->step.mapped && !(s->moreau.h > 0.0)) { /* what seems broken is looked at once more with the maps */
    tr_form_answer_along(s, &it, rest || tr_any_stuck(s));
    if (tr_rows_closed(s, &it) && !tr_pairs_broken(s, &it, rest, n)) return broken;
    tr_form_maps(s);
  }
  tr_form_maps(s);
  if (a && tr_loops_open(s, maps, z)) broken |= TR_BREAKS_LOOP;
  if (!e) return broken;
  tr_form_answer(s, &it, rest || s->moreau.h > 0.0 || tr_any_stuck(s));
  return broken | tr_pairs_broken(s, &it, rest, n);
}

static int tr_at_rest(tr_sim *s, int also, int *rest);

/* The same of the block's own state, modes and multipliers, for hosts: as the end of a step, or (deciding) as a decision about the pairs
 * that are at rest. */
int tr_verify(tr_sim *s, int deciding) {
  int rest[s->k->nsliders + 1], n = 0;
  tr_maps_at(s, s->clock.t, TR_A(s, y));
  if (deciding) n = tr_at_rest(s, -1, rest);
  return tr_broken(s, TR_A(s, y), deciding ? rest : 0, n);
}

/* The end of a step (t, y), just evaluated there, breaks laws: whether Newton's iteration finds an answer that holds from another start,
 * that of the step or none. Its ẏ is in `slope` then. */
static int tr_another_end(tr_sim *s, int broken, double t, const double *y, double *slope) {
  const tr_kernel *k = s->k;
  const int asked = s->set.locate ? ~0 : TR_BREAKS_LOOP | TR_BREAKS_REST | TR_BREAKS_LAW;
  double *eta = TR_A(s, z) + k->active;
  if (!(broken & asked)) return 1;
  s->stats.refused++;
  for (int start = 0; start < 2; ++start) {
    if (start == 0) memcpy(eta, TR_A(s, zstart) + k->active, sizeof(double) * k->neta);
    else memset(eta, 0, sizeof(double) * k->neta);
    if (!tr_rhs(s, t, y, slope) || (tr_broken(s, y, 0, 0) & asked)) continue;
    tr_note_end(s);
    return 1;
  }
  s->step.trouble = TR_FAIL_MODES;
  return 0;
}

/* Whether a decision about the pairs `rest`, at the state whose maps are in place, holds; one that does not is counted. */
static int tr_holds(tr_sim *s, const int *rest, int n) {
  int ok = !tr_broken(s, 0, rest, n);
  s->stats.refused += !ok;
  return ok;
}
