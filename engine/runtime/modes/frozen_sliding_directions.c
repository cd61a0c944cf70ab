/* Sliding directions, frozen over a step. The norm of the stored direction encodes its kind: TR_FROZEN means a first step from
 * rest, ON_LINE means motion along a line. */
#include "modes/modes.h"

#define ONSET_SPEED 0.1 /* in units of rtol · speed unit: a starting pair that is slower keeps its frozen direction */
/* relative to the speed unit: lower limit of the speed by ONSET_SPEED; directions of slower pairs are round-off of loops */
#define ONSET_LEAST 1e-9

static void tr_set_sliding_direction(tr_sim *s, int i, const double *r) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_mode *m = tr_mode_of(s, i);
  if (pair->nrates == 1)
    m->direction[0] = r[0] < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < 3; ++j) m->direction[j] = j < pair->nrates ? r[j] : 0.0;
}

static void tr_freeze_direction(tr_sim *s, int i) { tr_set_sliding_direction(s, i, tr_pair_rates(s, i)); }

static void tr_freeze_direction_at_start(tr_sim *s, int i) {
  double rates[3];
  tr_rates_of_state(s, i, rates), tr_set_sliding_direction(s, i, rates);
}

static void tr_reverse_kink_directions(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    double rate[3], *side = tr_mode_of(s, i)->direction;
    if (!tr_has_kink_at_rest(s, i)) continue;
    tr_rates_of_state(s, i, rate);
    if (rate[0] * side[0] < 0.0) side[0] = -side[0];
  }
}

static double tr_frozen_length(const tr_sim *s, int i) {
  const double *d = tr_mode_of(s, i)->direction;
  return tr_is_set_valued(s, i) && tr_is_sliding(s, i) ? fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2]))) : 0.0;
}

static void tr_clear_line_directions(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_pair_of(s, i)->nrates > 1 && tr_frozen_length(s, i) > TR_LINE)
      for (int j = 0; j < 3; ++j) tr_mode_of(s, i)->direction[j] /= ON_LINE;
}

static int tr_is_on_line(const tr_sim *s, int i, const double *rate, double width) {
  const tr_pair *pair = tr_pair_of(s, i);
  double v[3], d[3], along = 0.0, speed = 0.0, across = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    double lever = TR_A(s, lever)[pair->eta0 + j];
    v[j] = rate[j] * lever, d[j] = tr_mode_of(s, i)->direction[j] * lever / ON_LINE;
  }
  tr_make_unit(pair->nrates, d);
  for (int j = 0; j < pair->nrates; ++j) along += v[j] * d[j], speed += v[j] * v[j];
  for (int j = 0; j < pair->nrates; ++j) across += (v[j] - along * d[j]) * (v[j] - along * d[j]);
  return across <= width * width * speed && along >= 0.0;
}

static int tr_is_still_on_line(tr_sim *s, int i) {
  double rate[3];
  if (!(tr_frozen_length(s, i) > TR_LINE)) return 0;
  tr_rates_of_state(s, i, rate);
  return tr_is_on_line(s, i, rate, LINE_WIDTH);
}

static void tr_freeze_line_direction(tr_sim *s, int i, const double *r, double v) {
  for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) tr_mode_of(s, i)->direction[j] = ON_LINE * r[j] / v;
}

static int tr_is_starting_to_slide(const tr_sim *s, int i) {
  double length = tr_frozen_length(s, i);
  return length > STILL_FROZEN * TR_FROZEN && length < TR_LINE;
}

static double tr_onset_speed(const tr_sim *s) { return fmax(ONSET_SPEED * s->set.rtol, ONSET_LEAST) * tr_speed_unit(s); }

static int tr_is_direction_frozen(const tr_sim *s, int i, double speed) {
  return speed <= (tr_is_starting_to_slide(s, i) ? tr_onset_speed(s) : tr_rest_speed(tr_speed_unit(s)));
}
