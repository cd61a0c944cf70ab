/* Parts of an impact, each of which ends where a pair stops sliding (theory, "Contact that begins and ends"). */
#include "stepping/stepping.h"

/* relative to the largest rate: tolerated error of the rates in one step along a path of growing impulses */
#define PATH_TOL 1e-11
#define PATH_FIRST 0.1   /* first step along a path, as a part of the impulses */
#define PATH_SLOWS 0.4   /* relative to the speed of a pair before a step: least speed after the step */
#define PATH_GROWS 4.0   /* largest ratio of successive steps */
#define PATH_STEPS 2000  /* largest number of steps along a path */
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

/* Growth of the impulses along a path. p: the phase, from the rates `rate` of the gaps. all: a phase whose bounds `least` are the
 * impulses per unit of the path. several: kg; the impulse of each contact grows by `several` times the rate that the contact still
 * lacks, as with equal dampers. 0: all impulses keep their ratio. step, made: impulses of the contacts in
 * the last step, and in the part. */
typedef struct tr_growth {
  const tr_phase *p, *all;
  const double *rate;
  double several, *step, *made;
} tr_growth;

static void tr_set_growth(tr_sim *s, const double *y, const tr_growth *g) {
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  if (!(g->several > 0.0)) return;
  tr_evaluate_gaps(s, y, gap, rate);
  for (int c = 0; c < s->k->nunilateral; ++c) g->all->least[c] = g->p->at[c] ? g->several * fmax(g->p->target[c] - rate[c], 0.0) : 0.0;
}

/* Apply the part h of the growing impulses by a Runge-Kutta step of order four. Returns 0 on failure. */
static int tr_step_along_path(tr_sim *s, double t, double *y, const tr_growth *g, double h) {
  const int nz = s->k->active + s->k->neta;
  const double weight[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0}, at[] = {0.0, 0.5, 0.5, 1.0};
  double *z = TR_A(s, z), sum[nz + 1], work[tr_state_width(s)];
  memset(sum, 0, sizeof sum);
  for (int k = 0; k < 4; ++k) {
    memcpy(work, y, sizeof work);
    if (k) tr_apply_impulses(s, t, work, at[k] * h);
    tr_set_growth(s, work, g);
    if (!tr_solve_impulses(s, t, work, g->all, g->rate, TR_SLIDES_ALL)) return 0;
    for (int i = 0; i < nz; ++i) sum[i] += weight[k] * z[i];
  }
  memcpy(z, sum, sizeof(double) * nz);
  for (int c = 0; c < s->k->nunilateral; ++c) g->step[c] += h * s->impact.h * tr_normal_force(s, c);
  tr_evaluate_maps_at(s, t, y);
  tr_apply_impulses(s, t, y, h);
  return 1;
}

/* Whether the part ends at or before the state y, because a pair stops, or because a contact has reached its target rate and its
 * least impulse. grown: part of the impulses that led to y. before: rates at the start of the part. */
static int tr_does_part_end(tr_sim *s, double t, const double *y, const tr_growth *g, const double *before, double grown, int *which) {
  const tr_phase *p = g->p;
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  const double rest = tr_rest_speed_in_impact(s);
  tr_evaluate_maps_at(s, t, y);
  const double *after = map_rates(s->k, TR_A(s, maps));
  tr_find_first_stop(s, before, after, which);
  for (int i = 0; i < s->k->nsliders && *which < 0; ++i)
    if (tr_may_turn(s, i) && tr_speed_of_rates(s, i, before) > rest && tr_speed_of_rates(s, i, after) <= rest) *which = i;
  tr_evaluate_gaps(s, y, gap, rate);
  int ends = *which >= 0;
  for (int c = 0; c < s->k->nunilateral; ++c) ends |= p->impulse[c] > 0.0 && g->rate[c] < p->target[c] && rate[c] >= p->target[c] && grown * p->impulse[c] >= p->least[c];
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
  memset(g->step, 0, sizeof(double) * s->k->nunilateral);
  for (int k = 0; k < 2; ++k)
    if (!tr_step_along_path(s, t, y, g, 0.5 * h)) return 0;
  for (int i = nq; i < nq + nv; ++i) most = fmax(most, fabs(y[i])), apart = fmax(apart, fabs(once[i] - y[i]));
  *error = most > 0.0 ? apart / most : 0.0;
  return 1;
}

/* Let the impulses grow over one unit of the path: to the first stop of a pair, or to the end of a contact's impulse. Returns the
 * length of the path so far, at most 1; 0 on failure. */
static double tr_follow_path(tr_sim *s, double t, double *y, const tr_growth *g, int *which) {
  const int width = tr_state_width(s), nrates = s->k->nrates;
  double grown = 0.0, h = PATH_FIRST, error, before[nrates + 1], last[nrates + 1], next[width];
  tr_evaluate_maps_at(s, t, y);
  memcpy(before, map_rates(s->k, TR_A(s, maps)), sizeof(double) * nrates), memcpy(last, before, sizeof before);
  for (int it = 0; it < PATH_STEPS && grown < 1.0; ++it) {
    h = fmin(h, 1.0 - grown);
    memcpy(next, y, sizeof next);
    if (!tr_try_path_step(s, t, next, g, h, &error)) return 0.0;
    const double factor = error > 0.0 ? 0.9 * pow(PATH_TOL / error, 0.2) : PATH_GROWS;
    const int ends = tr_does_part_end(s, t, next, g, before, grown + h, which), slows = tr_slows_too_fast(s, last, map_rates(s->k, TR_A(s, maps)));
    if (error > PATH_TOL || (slows && *which < 0)) {
      h *= error > PATH_TOL ? fmax(factor, 0.2) : 0.5;
      continue;
    }
    if (ends) {
      double low = 0.0, high = h;
      for (int k = 0; k < PATH_HALVES && 0.5 * (low + high) > low && 0.5 * (low + high) < high; ++k) {
        const double middle = 0.5 * (low + high);
        memcpy(next, y, sizeof next);
        if (!tr_try_path_step(s, t, next, g, middle, &error)) return 0.0;
        if (tr_does_part_end(s, t, next, g, before, grown + middle, which)) high = middle;
        else low = middle;
      }
      h = high, memcpy(next, y, sizeof next);
      if (!tr_try_path_step(s, t, next, g, h, &error)) return 0.0;
    }
    memcpy(y, next, sizeof next), memcpy(last, map_rates(s->k, TR_A(s, maps)), sizeof last), grown += h;
    for (int c = 0; c < s->k->nunilateral; ++c) g->made[c] += g->step[c];
    if (ends) break;
    h *= fmin(factor, PATH_GROWS);
  }
  return grown;
}

/* Set in `g` how the impulses of phase p grow along a path. Returns whether the part needs a path, because friction turns, or
 * because several contacts push and their shares depend on the rates. Requires maps at the start of the part. */
static int tr_needs_path(const tr_sim *s, const tr_phase *p, const double *rate, tr_growth *g) {
  double pushes = 0.0, lacks = 0.0, held = 0.0;
  int contacts = 0, turns = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) {
    contacts += p->impulse[c] > 0.0, pushes += p->impulse[c], held += p->least[c];
    if (p->at[c]) lacks += fmax(p->target[c] - rate[c], 0.0);
  }
  for (int i = 0; i < s->k->nsliders; ++i) turns |= tr_may_turn(s, i) && tr_pair_speed(s, i) > tr_rest_speed_in_impact(s);
  g->several = contacts > 1 && lacks > 0.0 && !(held > 0.0) ? pushes / lacks : 0.0;
  return turns || g->several > 0.0;
}

static double tr_make_part(tr_sim *s, double t, double *y, const tr_phase *p, const double *rate, int *which) {
  const int n = s->k->nunilateral;
  char none[n + 1];
  double old[tr_state_width(s)], before[s->k->nrates + 1], least[n + 1], step[n + 1], made[n + 1], part;
  memset(none, 0, n), memset(step, 0, sizeof step), memset(made, 0, sizeof made), memcpy(old, y, sizeof old), memcpy(least, p->impulse, sizeof(double) * n);
  const tr_phase all = {p->at, p->target, least, none, p->impulse};
  tr_growth growth = {p, &all, rate, 0.0, step, made};
  tr_evaluate_maps_at(s, t, y);
  if (tr_needs_path(s, p, rate, &growth)) {
    part = tr_follow_path(s, t, y, &growth, which);
  } else {
    if (!tr_solve_impulses(s, t, y, &all, rate, TR_SLIDES_ONE_WAY)) return 0.0;
    memcpy(before, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
    tr_apply_impulses(s, t, y, 1.0);
    part = tr_find_first_stop(s, before, map_rates(s->k, TR_A(s, maps)), which);
    memcpy(y, old, sizeof old);
    if (*which < 0) return 0.0;
    tr_evaluate_maps_at(s, t, y);
    tr_apply_impulses(s, t, y, part);
    for (int c = 0; c < n; ++c) made[c] = part * p->impulse[c];
  }
  memcpy(p->impulse, made, sizeof(double) * n);
  return part;
}
