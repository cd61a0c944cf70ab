/* Classes of pairs that the loops couple to one degree of freedom (theory, "Deciding modes"). The rates of these pairs have fixed
 * ratios, so either all pairs of a class slide, or none. A class is identified by the multiplier of one of its pairs; `class_rates`
 * contains the rates of all pairs of the class at unit rate of this multiplier. Pairs i and j of a class satisfy A_ij² = A_ii
 * A_jj, where A is the response of freedoms to frictions with closed loops. The frictionless accelerations of these pairs must also
 * have the ratio of their rates; this condition excludes driven pairs and dead centres. */
#include "modes/modes.h"

/* relative to the accelerations that the state's rates cause: largest deviation from the ratio of a class. Loops that are open by
 * the error of a step cause this deviation. Accelerations caused by forces are excluded: they keep the ratio even in open loops,
 * and accelerations of light bodies may be arbitrarily large. */
#define SAME_START 1e-3
/* relative to the accelerations caused by forces: a smaller deviation from the ratio of a class is round-off */
#define SAME_BY_FORCES 1e-10
#define NO_START 1e-9   /* in units of length · rate²: largest deviation from the ratio of a class, if all accelerations vanish */
/* relative to the unit of the rates: if all rates of the state are zero, larger rates come from drives, and smaller rates are
 * round-off */
#define DRIVES_MOVE 1e-12

static int tr_line_multiplier(const tr_sim *s, int m) {
  const tr_pair *pair = tr_pair_of(s, m);
  int most = -1;
  for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
    if (!tr_is_prescribed(s, i) && (most < 0 || tr_freedom_response(s, i, i) > tr_freedom_response(s, most, most))) most = i;
  for (int i = pair->eta0; i < pair->eta0 + pair->neta && most >= 0; ++i)
    if (i != most && !tr_is_prescribed(s, i) && !tr_are_one_freedom(s, i, most)) most = -1;
  return most;
}

/* Size of accelerations that the rates of the state cause, m/s². In an impulse step, the result is INFINITY, because accelerations
 * contain the rates divided by the step. */
static double tr_acceleration_by_rates(const tr_sim *s) {
  double most = s->set.rate;
  for (int i = 0; i < s->k->nv; ++i) most = fmax(most, fabs(TR_A(s, y)[s->k->nq + i]) / tr_rate_unit(s, i));
  return s->moreau.h > 0.0 ? INFINITY : s->set.length * most * most;
}

/* Whether the frictionless acceleration of pair i is proportional to that of multiplier `lead`. Also writes the rates of pair i, at
 * unit rate of `lead`, to class_rates. */
static int tr_is_proportional_start(tr_sim *s, int i, int lead) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *Q0 = TR_A(s, Q), *lever = TR_A(s, lever);
  double *line = TR_A(s, class_rates), gap = 0.0, size = 0.0, own = tr_freedom_response(s, lead, lead);
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) {
    double ratio = tr_freedom_response(s, lead, j) / own, with = ratio * Q0[lead];
    gap = fmax(gap, fabs(Q0[j] - with) * lever[j]), size = fmax(size, (fabs(Q0[j]) + fabs(with)) * lever[j]);
    line[j] = ratio;
  }
  const double by_rates = fmin(size, tr_acceleration_by_rates(s));
  return gap <= SAME_START * by_rates + SAME_BY_FORCES * size + NO_START * tr_speed_unit(s) * s->set.rate;
}

static void tr_find_coupled_pairs(tr_sim *s) {
  TR_NEED(s, TR_HAS_MAPS);
  const tr_kernel *k = s->k;
  int *bound = tr_pair_classes(s), line[k->nsliders + 1];
  memset(bound, 0, sizeof(int) * k->nsliders);
  if (!k->active || !k->sets) return;
  tr_form_maps_without_loops(s, 1);
  for (int m = 0; m < k->nsliders; ++m) line[m] = tr_is_set_valued(s, m) ? tr_line_multiplier(s, m) : -1;
  for (int m = 0; m < k->nsliders; ++m) {
    if (line[m] < 0 || bound[m] || !tr_is_proportional_start(s, m, line[m])) continue;
    for (int i = m; i < k->nsliders; ++i)
      if (line[i] >= 0 && !bound[i] && tr_are_one_freedom(s, line[m], line[i]) && tr_is_proportional_start(s, i, line[m])) bound[i] = line[m] + 1;
  }
}

static inline int tr_are_coupled(const tr_sim *s, int i, int j) { return i == j || (tr_pair_classes(s)[i] && tr_pair_classes(s)[i] == tr_pair_classes(s)[j]); }

/* Surface speed of pair i at unit rate of its class. */
static double tr_line_speed(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  return tr_surface_speed(pair->nrates, TR_A(s, class_rates) + pair->eta0, TR_A(s, lever) + pair->eta0);
}

static int tr_is_moved_by_drives(tr_sim *s, int i, double t, const double *y) {
  const tr_kernel *k = s->k;
  double still[s->ny + 1], h[2 * k->rows + 1];
  int moves;
  memcpy(still, y, sizeof(double) * s->ny);
  memset(still + k->nq, 0, sizeof(double) * k->nv);
  tr_evaluate_maps_at(s, t, still);
  moves = tr_pair_speed(s, i) > 0.0;
  if (k->rows) tr_evaluate_closure(s, still, h);
  for (int r = 0; r < k->rows; ++r) moves |= fabs(h[k->rows + r]) > DRIVES_MOVE * tr_row_unit(s, r) * s->set.rate;
  tr_evaluate_maps_at(s, t, y);
  return moves;
}

/* Whether drives move pair i perpendicular to its line at (t, y), where the loops are closed. Leaves maps of (t, y). */
static int tr_is_driven_across(tr_sim *s, int i, double t, const double *y) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *rates = map_rates(s->k, TR_A(s, maps)) + pair->rate0, *lever = TR_A(s, lever) + pair->eta0, *line = TR_A(s, class_rates) + pair->eta0;
  const double length = tr_line_speed(s, i);
  if (!tr_is_moved_by_drives(s, i, t, y)) return 0;
  double closed[tr_state_width(s) + 1], along = 0.0, across = 0.0;
  memcpy(closed, y, sizeof(double) * tr_state_width(s));
  const int closes = tr_project(s, t, closed);
  tr_evaluate_maps_at(s, t, closed);
  for (int j = 0; j < pair->nrates; ++j) along += rates[j] * lever[j] * line[j] * lever[j] / length;
  for (int j = 0; j < pair->nrates; ++j) across = fmax(across, fabs(rates[j] * lever[j] - along * line[j] * lever[j] / length));
  tr_evaluate_maps_at(s, t, y);
  return closes && across > tr_crawl_speed(tr_speed_unit(s));
}

static int tr_is_stopping_on_line(tr_sim *s, int i, double t, const double *y) {
  if (!s->k->active || tr_pair_speed(s, i) > tr_closure_speed(s)) return 0;
  tr_find_coupled_pairs(s);
  return tr_pair_classes(s)[i] && !tr_is_driven_across(s, i, t, y);
}

/* Let pair i and, if `all`, the stuck pairs of its class slip: forward along the freedom of the class if way > 0, otherwise
 * backward. */
static void tr_let_class_slip(tr_sim *s, int i, double way, int all) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    tr_mode *mode = tr_mode_of(s, m);
    if (m != i && !(all && tr_are_coupled(s, m, i) && tr_is_stuck(s, m))) continue;
    const double *line = TR_A(s, class_rates) + pair->eta0;
    mode->flag = TR_SLIPS;
    for (int j = 0; j < 3; ++j) mode->direction[j] = 0.0;
    if (pair->nrates == 1) mode->direction[0] = way * line[0] < 0.0 ? -1.0 : 1.0;
    else for (int j = 0; j < pair->nrates; ++j) mode->direction[j] = way * line[j];
  }
}
