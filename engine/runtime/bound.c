/* Pairs that the loops bind to one freedom: their rates are in a fixed ratio, so that all of them slide, one way or the other, or none
 * (METHOD, "Deciding modes"). A class of such pairs is named by the multiplier of one of them; `line` holds their rates when that one's
 * freedom moves forward. Told from the response A of their freedoms to their frictions, loops closed: in a class A_ij² = A_ii A_jj; and from
 * the accelerations without friction, which are in that ratio where all of the class rests: not where a drive moves some of them, nor for an
 * instant at a dead centre. */
#include "modes.h"

#define SAME_START 1e-3 /* of the accelerations: so far those of a class may be from their ratio, where loops are open by a step's error; */
#define NO_START 1e-9   /* of length · rate²: and so far where there are none */
#define DRIVES_MOVE 1e-12 /* of their unit: rates that the loops ask of a mechanism at rest, above round-off */

/* The multiplier of pair m that moves it most, where it moves along a line that the loops leave it; -1: it has more ways, or none. */
static int tr_line_of(const tr_sim *s, int m) {
  const tr_pair *pair = tr_pair_of(s, m);
  int most = -1;
  for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
    if (!tr_is_prescribed(s, i) && (most < 0 || tr_response(s, i, i) > tr_response(s, most, most))) most = i;
  for (int i = pair->eta0; i < pair->eta0 + pair->neta && most >= 0; ++i)
    if (i != most && !tr_is_prescribed(s, i) && !tr_are_one(s, i, most)) most = -1;
  return most;
}

/* Whether pair i, with a line, starts in proportion to the freedom of multiplier `lead`, its own one; its rates in that are then noted. */
static int tr_starts_with(tr_sim *s, int i, int lead) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *Q0 = TR_A(s, Q), *arm = TR_A(s, arm);
  double *line = TR_A(s, line), gap = 0.0, size = 0.0, own = tr_response(s, lead, lead);
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) {
    double ratio = tr_response(s, lead, j) / own, with = ratio * Q0[lead];
    gap = fmax(gap, fabs(Q0[j] - with) * arm[j]), size = fmax(size, (fabs(Q0[j]) + fabs(with)) * arm[j]);
    line[j] = ratio;
  }
  return gap <= SAME_START * size + NO_START * tr_speed_unit(s) * s->set.rate;
}

/* The classes at the state whose maps are in place. */
static void tr_bind(tr_sim *s) {
  const tr_kernel *k = s->k;
  int *bound = tr_bound(s), line[k->nsliders + 1];
  memset(bound, 0, sizeof(int) * k->nsliders);
  if (!k->active || !k->sets) return;
  tr_without_loops(s, 1);
  for (int m = 0; m < k->nsliders; ++m) line[m] = tr_is_set(s, m) ? tr_line_of(s, m) : -1;
  for (int m = 0; m < k->nsliders; ++m) {
    if (line[m] < 0 || bound[m] || !tr_starts_with(s, m, line[m])) continue;
    for (int i = m; i < k->nsliders; ++i)
      if (line[i] >= 0 && !bound[i] && tr_are_one(s, line[m], line[i]) && tr_starts_with(s, i, line[m])) bound[i] = line[m] + 1;
  }
}

/* Whether pairs i and j are of one class. */
static inline int tr_bound_to(const tr_sim *s, int i, int j) { return i == j || (tr_bound(s)[i] && tr_bound(s)[i] == tr_bound(s)[j]); }

/* Surface speed of pair i of a class when its freedom moves with rate 1. */
static double tr_line_speed(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double sum = 0.0;
  for (int j = pair->eta0; j < pair->eta0 + pair->nrates; ++j) sum += TR_A(s, line)[j] * TR_A(s, line)[j] * TR_A(s, arm)[j] * TR_A(s, arm)[j];
  return sqrt(sum);
}

/* Whether drives may move pair i at (t, y): with no rates in the state it has a speed, or its loops ask for some. Maps are anew in place. */
static int tr_drives_move(tr_sim *s, int i, double t, const double *y) {
  const tr_kernel *k = s->k;
  double still[s->ny + 1], h[2 * k->rows + 1];
  int moves;
  memcpy(still, y, sizeof(double) * s->ny);
  memset(still + k->nq, 0, sizeof(double) * k->nv);
  tr_maps_at(s, t, still);
  moves = tr_pair_speed(s, i) > 0.0;
  if (k->rows) k->closure(TR_A(s, x), still, TR_A(s, c) + k->c_closure, h);
  for (int r = 0; r < k->rows; ++r) moves |= fabs(h[k->rows + r]) > DRIVES_MOVE * tr_row_unit(s, r) * s->set.rate;
  tr_maps_at(s, t, y);
  return moves;
}

/* Whether drives move pair i across its line at (t, y), however slowly: with the loops closed it has a speed there still. Maps are anew in place. */
static int tr_is_driven_across(tr_sim *s, int i, double t, const double *y) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *rates = map_rates(s->k, TR_A(s, maps)) + pair->rate0, *arm = TR_A(s, arm) + pair->eta0, *line = TR_A(s, line) + pair->eta0;
  const double length = tr_line_speed(s, i);
  if (!tr_drives_move(s, i, t, y)) return 0;
  double closed[tr_width(s) + 1], along = 0.0, across = 0.0;
  memcpy(closed, y, sizeof(double) * tr_width(s));
  const int closes = tr_project(s, t, closed);
  tr_maps_at(s, t, closed);
  for (int j = 0; j < pair->nrates; ++j) along += rates[j] * arm[j] * line[j] * arm[j] / length;
  for (int j = 0; j < pair->nrates; ++j) across = fmax(across, fabs(rates[j] * arm[j] - along * line[j] * arm[j] / length));
  tr_maps_at(s, t, y);
  return closes && across > CRAWLS * tr_speed_unit(s);
}

/* Whether pair i, of several components, is about to stop at (t, y) on a line that the loops leave it: it then passes through zero, as one of one
 * component does, but for a speed across it by which a step leaves the loops open. Maps in place. */
static int tr_stops_on_line(tr_sim *s, int i, double t, const double *y) {
  if (!s->k->active || tr_pair_speed(s, i) > tr_creep(s)) return 0;
  tr_bind(s);
  return tr_bound(s)[i] && !tr_is_driven_across(s, i, t, y);
}

/* Let the class of pair i slip (`way` > 0: as its freedom moves forward): those of it that are stuck, and i. */
static void tr_slip_along(tr_sim *s, int i, double way) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    tr_mode *mode = tr_mode_of(s, m);
    if (m != i && !(tr_bound_to(s, m, i) && tr_is_stuck(s, m))) continue;
    const double *line = TR_A(s, line) + pair->eta0;
    mode->flag = TR_SLIPS;
    for (int j = 0; j < 3; ++j) mode->direction[j] = 0.0;
    if (pair->nrates == 1) mode->direction[0] = way * line[0] < 0.0 ? -1.0 : 1.0;
    else for (int j = 0; j < pair->nrates; ++j) mode->direction[j] = way * line[j];
  }
}
