/* Parts of an impact, each of which ends where a pair stops sliding (theory, "Contact that begins and ends"). */
#include "stepping/stepping.h"

/* relative to the largest rate: tolerated error of the rates in one step along a path of growing impulses */
#define PATH_TOL 1e-11
#define PATH_FIRST 0.1   /* first step along a path, as a part of the impulses */
#define PATH_SLOWS 0.4   /* relative to the speed of a pair before a step: least speed after the step */
#define PATH_GROWS 4.0   /* largest ratio of successive steps */
#define PATH_STEPS 2000  /* largest number of steps along a path */
#define PATH_LEFT 1e-9   /* relative to the start of a phase: what rates of several contacts lack at the end of a path */
#define PATH_HALVES 45   /* largest number of bisections that find the end of a part within a step */
#define SLIP_TURNED 1e-9 /* sine of the least angle by which an impact turns a sliding direction */

static double tr_find_first_stop(const tr_sim *s, const double *before, const double *after, int *which) {
  const double rest = tr_rest_speed_in_impact(s);
  double first = 1.0;
  *which = -1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    const double lever = TR_A(s, lever)[pair->eta0], v = before[pair->rate0], u = after[pair->rate0];
    if (!tr_slides_on(s, i, TR_SLIDES_ONE_WAY) || fabs(v) * lever <= rest || (v * u > 0.0 && fabs(u) * lever > rest)) continue;
    if (*which < 0 || v / (v - u) < first) first = fmin(v / (v - u), 1.0), *which = i;
  }
  return first;
}

/* Whether friction of pair i can turn within an impact: the pair slides in several directions. (A ball may also start to spin.) */
static int tr_may_turn(const tr_sim *s, int i) { return tr_slides_on(s, i, TR_SLIDES_ALL) && !tr_slides_on(s, i, TR_SLIDES_ONE_WAY); }

static double tr_speed_of_rates(const tr_sim *s, int i, const double *rates) {
  return tr_surface_speed(tr_pair_of(s, i)->nrates, rates + tr_pair_of(s, i)->rate0, TR_A(s, lever) + tr_pair_of(s, i)->eta0);
}

/* Whether the friction of a pair turns between the rates `before` and `after`. */
static int tr_has_slip_turned(const tr_sim *s, const double *before, const double *after) {
  const double rest = tr_rest_speed_in_impact(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    const double v = tr_speed_of_rates(s, i, before), u = tr_speed_of_rates(s, i, after);
    double along = 0.0, across[3];
    if (!tr_may_turn(s, i) || v <= rest) continue;
    for (int j = 0; j < pair->nrates; ++j) along += before[pair->rate0 + j] * after[pair->rate0 + j] * pow(TR_A(s, lever)[pair->eta0 + j], 2.0);
    for (int j = 0; j < pair->nrates; ++j) across[j] = after[pair->rate0 + j] - along / (v * v) * before[pair->rate0 + j];
    if (u <= rest || along <= 0.0 || tr_surface_speed(pair->nrates, across, TR_A(s, lever) + pair->eta0) > SLIP_TURNED * u) return 1;
  }
  return 0;
}

static double tr_find_lack(const tr_sim *s, const tr_phase *p, const double *rate) {
  double lack = 0.0;
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (p->at[c]) lack += fmax(p->target[c] - rate[c], 0.0);
  return lack;
}

/* Whether several contacts touch that lack more than PATH_LEFT of `lack`. */
static int tr_do_several_push(const tr_sim *s, const tr_phase *p, const double *rate, double lack) {
  int contacts = 0, held = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) contacts += p->at[c], held |= p->least[c] > 0.0;
  return contacts > 1 && !held && tr_find_lack(s, p, rate) > PATH_LEFT * lack;
}

/* Growth of the impulses along a path. p: the phase, from the rates `rate` of the gaps. all: a phase whose bounds `least` are the
 * impulses per unit of the path. several: kg; the impulse of each contact grows by `several` times the rate that the contact still
 * lacks, as with equal dampers, until all contacts together lack `left`, m/s. 0: all impulses keep their ratio. from: rates of all
 * pairs at the start of the present step; no direction reverses within a step. modes: the modes of friction there. u: the point of the
 * path there: rates v, works of the pairs, impulses of all multipliers. K: derivatives in the step. */
typedef struct tr_growth {
  const tr_phase *p;
  tr_phase *all;
  const double *rate;
  double several, left, *from;
  tr_mode *modes;
  double *u, *K;
} tr_growth;

/* SIMD vectors of a point of the path. */
static int tr_path_vectors(const tr_sim *s) { return (s->k->nv + s->k->nsliders + s->k->active + s->k->neta + TR_LANES - 1) / TR_LANES; }

static const tr_method *tr_method_of_path(void) { return &tr_methods[TR_AUTO_TIGHT]; }

/* Derivative k of the point u of a path from the state y. keeps: whether friction keeps its modes. Leaves maps of the rates in u.
 * Returns 0 on failure. */
static int tr_evaluate_growth(tr_sim *s, double t, const double *y, const double *u, const tr_growth *g, int keeps, double *k) {
  const int nv = s->k->nv, pairs = s->k->nsliders, nz = s->k->active + s->k->neta;
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1], at[tr_state_width(s)];
  memcpy(at, y, sizeof at), memcpy(at + s->k->nq, u, sizeof(double) * nv);
  g->all->keeps = keeps;
  tr_evaluate_gaps(s, at, gap, rate);
  for (int c = 0; c < s->k->nunilateral && g->several > 0.0; ++c) g->all->least[c] = g->p->at[c] ? g->several * fmax(g->p->target[c] - rate[c], 0.0) : 0.0;
  if (!tr_solve_impulses(s, t, at, g->all, g->rate, TR_SLIDES_ALL)) return 0;
  tr_find_rate_changes(s, at, k);
  const double *rates = map_rates(s->k, TR_A(s, maps));
  for (int i = 0; i < nz; ++i) k[nv + pairs + i] = s->impact.h * TR_A(s, z)[i];
  for (int i = 0; i < pairs; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    k[nv + i] = 0.0;
    for (int j = 0; j < pair->nrates; ++j) k[nv + i] -= k[nv + pairs + s->k->active + pair->eta0 + j] * rates[pair->rate0 + j];
  }
  return 1;
}

/* One trial step h of a path, from g->u to `next`. *error: in units of the largest rate. Leaves maps of `next`, and its derivative in
 * the last row of K. Returns 0 on failure. */
static int tr_try_path_step(tr_sim *s, double t, const double *y, const tr_growth *g, double h, double *next, double *error) {
  const tr_explicit *m = tr_method_of_path()->explicit;
  const int n = tr_path_vectors(s), width = n * TR_LANES;
  double at[width], most = 0.0, size[2] = {0.0, 0.0};
  tr_restore_modes(s, g->modes);
  for (int i = 1; i < m->stages; ++i) {
    m->argument(i, n, h, (tr_vec *)g->u, (tr_vec *)g->K, (tr_vec *)at);
    if (!tr_evaluate_growth(s, t, y, at, g, 1, g->K + i * width)) return 0;
  }
  m->solution(n, h, (tr_vec *)g->u, (tr_vec *)g->K, (tr_vec *)next);
  if (!tr_evaluate_growth(s, t, y, next, g, 0, g->K + m->stages * width)) return 0;
  for (int e = 0; e < m->errors; ++e) {
    m->error[e](n, h, (tr_vec *)g->K, (tr_vec *)at);
    for (int i = 0; i < s->k->nv; ++i) size[e] = fmax(size[e], fabs(at[i])), most = fmax(most, fabs(next[i]));
  }
  *error = most > 0.0 ? sqrt(m->errors > 1 ? tr_combine_estimators(size[0] * size[0], size[1] * size[1]) : size[0] * size[0]) / most : 0.0;
  return 1;
}

/* Whether the part ends at or before the point u, to which the part `grown` of the impulses was applied: a pair stops, a stuck pair
 * slips, or a contact has its rate and impulse. Requires maps of u, and the modes of friction there. */
static int tr_does_part_end(tr_sim *s, const double *y, const double *u, const tr_growth *g, double grown, int *which) {
  const tr_phase *p = g->p;
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1], at[tr_state_width(s)];
  const double rest = tr_rest_speed_in_impact(s), *after = map_rates(s->k, TR_A(s, maps));
  int ends = 0;
  *which = -1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const int r = tr_pair_of(s, i)->rate0, one_way = tr_slides_on(s, i, TR_SLIDES_ONE_WAY);
    ends |= tr_mode_flag(g->modes + i) == TR_STUCK && !tr_is_stuck(s, i);
    if (*which >= 0 || !(one_way || tr_may_turn(s, i)) || tr_speed_of_rates(s, i, g->from) <= rest) continue;
    if (one_way ? g->from[r] * after[r] <= 0.0 : tr_speed_of_rates(s, i, after) <= rest) *which = i;
  }
  memcpy(at, y, sizeof at), memcpy(at + s->k->nq, u, sizeof(double) * s->k->nv);
  tr_evaluate_gaps(s, at, gap, rate);
  for (int c = 0; c < s->k->nunilateral && !(g->several > 0.0); ++c) ends |= p->impulse[c] > 0.0 && g->rate[c] < p->target[c] && rate[c] >= p->target[c] && grown * p->impulse[c] >= p->least[c];
  return ends || *which >= 0;
}

/* Whether a pair that may turn loses more than PATH_SLOWS of its speed in one step. */
static int tr_slows_too_fast(const tr_sim *s, const double *before, const double *after) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_may_turn(s, i) && tr_speed_of_rates(s, i, after) < PATH_SLOWS * tr_speed_of_rates(s, i, before)) return 1;
  return 0;
}

/* Find the end of a part within a step of length `high`, at whose end the pair *which stops, and make the step to this end into `next`. Returns its length; 0 on
 * failure. */
static double tr_find_part_end(tr_sim *s, double t, const double *y, const tr_growth *g, double grown, double high, double *next, int *which) {
  double low = 0.0, error;
  int pair = *which; /* that stops at `high` */
  for (int k = 0; k < PATH_HALVES && 0.5 * (low + high) > low && 0.5 * (low + high) < high; ++k) {
    const double middle = 0.5 * (low + high);
    if (!tr_try_path_step(s, t, y, g, middle, next, &error)) return 0.0;
    if (tr_does_part_end(s, y, next, g, grown + middle, which)) high = middle, pair = *which;
    else low = middle;
  }
  *which = pair;
  return tr_try_path_step(s, t, y, g, high, next, &error) ? high : 0.0;
}

/* Let the impulses grow to the first stop of a pair, or to the end of the path. Without `several`, this end is one unit of the path,
 * or the end of a contact's impulse. Returns the length of the path; 0 on failure. */
static double tr_follow_path(tr_sim *s, double t, double *y, const tr_growth *g, int *which) {
  const tr_method *m = tr_method_of_path();
  const double most = g->several > 0.0 ? INFINITY : 1.0;
  const int width = tr_path_vectors(s) * TR_LANES, nrates = s->k->nrates;
  double grown = 0.0, h = PATH_FIRST, error, next[width], gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  memcpy(g->u, y + s->k->nq, sizeof(double) * s->k->nv);
  memcpy(g->from, map_rates(s->k, TR_A(s, maps)), sizeof(double) * nrates);
  if (!tr_evaluate_growth(s, t, y, g->u, g, 0, g->K)) return 0.0;
  tr_save_modes(s, g->modes);
  for (int it = 0; it < PATH_STEPS; ++it) {
    h = fmin(h, most - grown);
    if (!tr_try_path_step(s, t, y, g, h, next, &error)) return 0.0;
    const double factor = error > 0.0 ? 0.9 * pow(PATH_TOL / error, 1.0 / m->order) : PATH_GROWS;
    const int ends = tr_does_part_end(s, y, next, g, grown + h, which), slows = tr_slows_too_fast(s, g->from, map_rates(s->k, TR_A(s, maps)));
    if (error > PATH_TOL || (slows && *which < 0)) {
      h *= error > PATH_TOL ? fmax(factor, 0.2) : 0.5;
      continue;
    }
    if (ends && !((h = tr_find_part_end(s, t, y, g, grown, h, next, which)) > 0.0)) return 0.0;
    memcpy(g->u, next, sizeof next), memcpy(g->K, g->K + m->explicit->stages * width, sizeof(double) * width);
    memcpy(y + s->k->nq, next, sizeof(double) * s->k->nv), memcpy(g->from, map_rates(s->k, TR_A(s, maps)), sizeof(double) * nrates), tr_save_modes(s, g->modes);
    grown += h;
    tr_evaluate_gaps(s, y, gap, rate);
    if (ends || grown >= most || (g->several > 0.0 && tr_find_lack(s, g->p, rate) <= g->left)) return grown;
    h *= fmin(factor, PATH_GROWS);
  }
  return 0.0;
}

/* How the impulses of phase p grow along a path, into `g`. Returns whether the part needs a path: friction turns, or several contacts
 * push. Requires maps at the start of the part. */
static int tr_needs_path(const tr_sim *s, const tr_phase *p, const double *rate, double lack, tr_growth *g) {
  double pushes = 0.0;
  int turns = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) pushes += p->impulse[c];
  for (int i = 0; i < s->k->nsliders; ++i) turns |= tr_may_turn(s, i) && tr_pair_speed(s, i) > tr_rest_speed_in_impact(s);
  g->several = tr_do_several_push(s, p, rate, lack) ? pushes / tr_find_lack(s, p, rate) : 0.0, g->left = PATH_LEFT * lack;
  return turns || g->several > 0.0;
}

/* Make a part whose friction turns, or in which several contacts push. See tr_make_part. */
static double tr_make_part_by_path(tr_sim *s, double t, double *y, tr_growth *g, int *which) {
  const int nv = s->k->nv, pairs = s->k->nsliders, nz = s->k->active + s->k->neta;
  const int width = tr_path_vectors(s) * TR_LANES;
  double from[s->k->nrates + 1], u[width], K[TR_STAGES * width];
  tr_mode modes[pairs + 1];
  memset(u, 0, sizeof u), memset(K, 0, sizeof K);
  g->from = from, g->u = u, g->K = K, g->modes = modes, g->all->from = from;
  const double part = tr_follow_path(s, t, y, g, which);
  for (int i = 0; i < nz && part > 0.0; ++i) TR_A(s, z)[i] = u[nv + pairs + i] / (part * s->impact.h);
  tr_add_pair_works(s, y, u + nv);
  return part;
}

static double tr_make_part(tr_sim *s, double t, double *y, const tr_phase *p, const double *rate, double lack, int *which) {
  const int n = s->k->nunilateral;
  char none[n + 1];
  double old[tr_state_width(s)], before[s->k->nrates + 1], least[n + 1], part;
  memset(none, 0, n), memcpy(old, y, sizeof old), memcpy(least, p->impulse, sizeof(double) * n);
  tr_phase all = {p->at, p->target, least, none, p->impulse, 0, 0};
  tr_growth growth = {.p = p, .all = &all, .rate = rate};
  tr_evaluate_maps_at(s, t, y);
  if (tr_needs_path(s, p, rate, lack, &growth)) {
    part = tr_make_part_by_path(s, t, y, &growth, which);
  } else {
    if (!tr_solve_impulses(s, t, y, &all, rate, TR_SLIDES_ONE_WAY)) return 0.0;
    memcpy(before, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
    tr_apply_impulses(s, t, y, 1.0);
    part = tr_find_first_stop(s, before, map_rates(s->k, TR_A(s, maps)), which);
    memcpy(y, old, sizeof old);
    tr_evaluate_maps_at(s, t, y);
    tr_apply_impulses(s, t, y, part);
  }
  for (int c = 0; c < n; ++c) p->impulse[c] = part * s->impact.h * tr_normal_force(s, c);
  return part;
}
