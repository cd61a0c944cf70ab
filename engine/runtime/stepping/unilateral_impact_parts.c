/* Parts of an impact, each of which ends where a pair stops sliding (theory, "Contact that begins and ends"). */
#include "stepping/stepping.h"

/* relative to the largest rate: tolerated error of the rates in one step along a path of growing impulses */
#define PATH_TOL 1e-11
#define PATH_FIRST 0.1   /* first step along a path, as a part of the impulses */
#define PATH_SLOWS 0.4   /* relative to the speed of a pair before a step: least speed after the step */
#define PATH_GROWS 4.0   /* largest ratio of successive steps */
#define PATH_STEPS 2000  /* largest number of steps along a path */
#define PATH_LEFT 1e-9   /* relative to the start of a phase: what rates of several contacts lack at the end of a path */
#define PATH_HALVES 60   /* largest number of bisections that find the end of a part within a step */
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

static int tr_do_several_push(const tr_sim *s, const tr_phase *p, const double *rate, double lack) {
  int contacts = 0, held = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) contacts += p->at[c], held |= p->least[c] > 0.0;
  return contacts > 1 && !held && tr_find_lack(s, p, rate) > PATH_LEFT * lack;
}

/* Growth of the impulses along a path. p: the phase, from the rates `rate` of the gaps. all: a phase whose bounds `least` are the
 * impulses per unit of the path. several: kg; the impulse of each contact grows by `several` times the rate that the contact still
 * lacks, as with equal dampers, until all contacts together lack `left`, m/s. 0: all impulses keep their ratio. from: rates of all
 * pairs at the start of the present step; no direction reverses within a step. step, made: impulses of all multipliers in the last
 * step, and in the part. stuck: whether each pair is stuck in the last step. */
typedef struct tr_growth {
  const tr_phase *p;
  tr_phase *all;
  const double *rate;
  double several, left, *from, *step, *made;
  char *stuck;
} tr_growth;

/* Solve for the growth of the impulses at the state y. keeps: whether friction keeps its modes. Returns 0 on failure. */
static int tr_solve_growth(tr_sim *s, double t, const double *y, const tr_growth *g, int keeps) {
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  g->all->keeps = keeps;
  if (g->several > 0.0) {
    tr_evaluate_gaps(s, y, gap, rate);
    for (int c = 0; c < s->k->nunilateral; ++c) g->all->least[c] = g->p->at[c] ? g->several * fmax(g->p->target[c] - rate[c], 0.0) : 0.0;
  }
  return tr_solve_impulses(s, t, y, g->all, g->rate, TR_SLIDES_ALL);
}

/* Apply the part h of the growing impulses by a Runge-Kutta step of order four. Returns 0 on failure. */
static int tr_step_along_path(tr_sim *s, double t, double *y, const tr_growth *g, double h) {
  const int nz = s->k->active + s->k->neta;
  const double weight[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0}, at[] = {0.0, 0.5, 0.5, 1.0};
  double *z = TR_A(s, z), sum[nz + 1], impulses[nz + 1], stage[tr_state_width(s)], works[tr_state_width(s)];
  memset(sum, 0, sizeof sum), memcpy(works, y, sizeof works);
  for (int k = 0; k < 4; ++k) {
    memcpy(stage, y, sizeof stage);
    if (k) tr_apply_impulses(s, t, stage, at[k] * h);
    if (!tr_solve_growth(s, t, stage, g, k > 0)) return 0;
    for (int i = 0; i < s->k->nsliders && k == 0; ++i) g->stuck[i] = tr_is_stuck(s, i);
    for (int i = 0; i < nz; ++i) sum[i] += weight[k] * z[i], impulses[i] = weight[k] * h * s->impact.h * z[i];
    tr_add_works_of_impulses(s, works, impulses, map_rates(s->k, TR_A(s, maps)));
  }
  memcpy(z, sum, sizeof(double) * nz);
  for (int i = 0; i < nz; ++i) g->step[i] += h * z[i];
  tr_evaluate_maps_at(s, t, y);
  tr_apply_impulses(s, t, y, h);
  memcpy(y + s->ny, works + s->ny, sizeof(double) * (tr_state_width(s) - s->ny));
  return 1;
}

/* Whether the part ends at or before the state y, to which the part `grown` of the impulses was applied: a pair stops, a stuck pair
 * slips, or a contact has its rate and impulse. Leaves maps of y. */
static int tr_does_part_end(tr_sim *s, double t, const double *y, const tr_growth *g, double grown, int *which) {
  const tr_phase *p = g->p;
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  const double rest = tr_rest_speed_in_impact(s);
  tr_evaluate_maps_at(s, t, y);
  const double *after = map_rates(s->k, TR_A(s, maps));
  *which = -1;
  for (int i = 0; i < s->k->nsliders && *which < 0; ++i) {
    const int r = tr_pair_of(s, i)->rate0, one_way = tr_slides_on(s, i, TR_SLIDES_ONE_WAY);
    if (!(one_way || tr_may_turn(s, i)) || tr_speed_of_rates(s, i, g->from) <= rest) continue;
    if (one_way ? g->from[r] * after[r] <= 0.0 : tr_speed_of_rates(s, i, after) <= rest) *which = i;
  }
  tr_evaluate_gaps(s, y, gap, rate);
  int ends = *which >= 0;
  if (!ends && tr_solve_growth(s, t, y, g, 0))
    for (int i = 0; i < s->k->nsliders; ++i) ends |= g->stuck[i] && !tr_is_stuck(s, i);
  for (int c = 0; c < s->k->nunilateral && !(g->several > 0.0); ++c) ends |= p->impulse[c] > 0.0 && g->rate[c] < p->target[c] && rate[c] >= p->target[c] && grown * p->impulse[c] >= p->least[c];
  return ends;
}

/* Whether a pair that may turn loses more than PATH_SLOWS of its speed in one step. */
static int tr_slows_too_fast(const tr_sim *s, const double *before, const double *after) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_may_turn(s, i) && tr_speed_of_rates(s, i, after) < PATH_SLOWS * tr_speed_of_rates(s, i, before)) return 1;
  return 0;
}

/* One trial step of the path: two half steps into `y`. *error: difference between the results of two half steps and of one whole
 * step, in units of the largest rate. Returns 0 on failure. */
static int tr_try_path_step(tr_sim *s, double t, double *y, const tr_growth *g, double h, double *error) {
  const int nq = s->k->nq, nv = s->k->nv;
  double once[tr_state_width(s)], most = 0.0, apart = 0.0;
  memcpy(once, y, sizeof once);
  if (!tr_step_along_path(s, t, once, g, h)) return 0;
  memset(g->step, 0, sizeof(double) * (s->k->active + s->k->neta));
  for (int k = 0; k < 2; ++k)
    if (!tr_step_along_path(s, t, y, g, 0.5 * h)) return 0;
  for (int i = nq; i < nq + nv; ++i) most = fmax(most, fabs(y[i])), apart = fmax(apart, fabs(once[i] - y[i]));
  *error = most > 0.0 ? apart / most : 0.0;
  return 1;
}

/* Find the end of a part within a step of length `high` from y, and make this step into `next`. Returns its length; 0 on failure. */
static double tr_find_part_end(tr_sim *s, double t, const double *y, const tr_growth *g, double grown, double high, double *next, int *which) {
  double low = 0.0, error;
  for (int k = 0; k < PATH_HALVES && 0.5 * (low + high) > low && 0.5 * (low + high) < high; ++k) {
    const double middle = 0.5 * (low + high);
    memcpy(next, y, sizeof(double) * tr_state_width(s));
    if (!tr_try_path_step(s, t, next, g, middle, &error)) return 0.0;
    if (tr_does_part_end(s, t, next, g, grown + middle, which)) high = middle;
    else low = middle;
  }
  memcpy(next, y, sizeof(double) * tr_state_width(s));
  return tr_try_path_step(s, t, next, g, high, &error) && tr_does_part_end(s, t, next, g, grown + high, which) ? high : 0.0;
}

/* Let the impulses grow to the first stop of a pair, or to the end of the path. Without `several`, this end is one unit of the path,
 * or the end of a contact's impulse. Returns the length of the path; 0 on failure. */
static double tr_follow_path(tr_sim *s, double t, double *y, const tr_growth *g, int *which) {
  const double most = g->several > 0.0 ? INFINITY : 1.0;
  double grown = 0.0, h = PATH_FIRST, error, next[tr_state_width(s)], gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  tr_evaluate_maps_at(s, t, y);
  for (int it = 0; it < PATH_STEPS; ++it) {
    memcpy(g->from, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
    h = fmin(h, most - grown);
    memcpy(next, y, sizeof next);
    if (!tr_try_path_step(s, t, next, g, h, &error)) return 0.0;
    const double factor = error > 0.0 ? 0.9 * pow(PATH_TOL / error, 0.2) : PATH_GROWS;
    const int ends = tr_does_part_end(s, t, next, g, grown + h, which), slows = tr_slows_too_fast(s, g->from, map_rates(s->k, TR_A(s, maps)));
    if (error > PATH_TOL || (slows && *which < 0)) {
      h *= error > PATH_TOL ? fmax(factor, 0.2) : 0.5;
      tr_evaluate_maps_at(s, t, y);
      continue;
    }
    if (ends && !((h = tr_find_part_end(s, t, y, g, grown, h, next, which)) > 0.0)) return 0.0;
    memcpy(y, next, sizeof next), grown += h;
    for (int i = 0; i < s->k->active + s->k->neta; ++i) g->made[i] += g->step[i];
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

static double tr_make_part(tr_sim *s, double t, double *y, const tr_phase *p, const double *rate, double lack, int *which) {
  const int n = s->k->nunilateral, nz = s->k->active + s->k->neta;
  char none[n + 1], stuck[s->k->nsliders + 1];
  double old[tr_state_width(s)], from[s->k->nrates + 1], least[n + 1], step[nz + 1], made[nz + 1], part;
  memset(none, 0, n), memset(made, 0, sizeof made), memcpy(old, y, sizeof old), memcpy(least, p->impulse, sizeof(double) * n);
  tr_phase all = {p->at, p->target, least, none, p->impulse, 0, 0};
  tr_growth growth = {p, &all, rate, 0.0, 0.0, from, step, made, stuck};
  tr_evaluate_maps_at(s, t, y);
  if (tr_needs_path(s, p, rate, lack, &growth)) {
    all.from = from;
    part = tr_follow_path(s, t, y, &growth, which);
    for (int i = 0; i < nz && part > 0.0; ++i) TR_A(s, z)[i] = made[i] / part;
  } else {
    if (!tr_solve_impulses(s, t, y, &all, rate, TR_SLIDES_ONE_WAY)) return 0.0;
    memcpy(from, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
    tr_apply_impulses(s, t, y, 1.0);
    part = tr_find_first_stop(s, from, map_rates(s->k, TR_A(s, maps)), which);
    memcpy(y, old, sizeof old);
    tr_evaluate_maps_at(s, t, y);
    tr_apply_impulses_and_works(s, t, y, part);
  }
  for (int c = 0; c < n; ++c) p->impulse[c] = part * s->impact.h * tr_normal_force(s, c);
  return part;
}
