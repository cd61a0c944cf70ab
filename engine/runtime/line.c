/* Pairs of several components that move along a line: the direction in their mode is frozen, and told from others by its length. */
#include "modes.h"

#define ON_LINE 1e144     /* length of the direction of a pair that moves along a line, which stays frozen while it does: beyond TR_LINE
                             whatever unit vector and levers it was made of */
#define LINE_WIDTH 1e-9   /* of the speed: what is across the line and is round-off, or as good as that */

/* Make v (n) a unit vector; returns the length it had. */
static double tr_unit(int n, double *v) {
  double len = 0.0;
  for (int j = 0; j < n; ++j) len += v[j] * v[j];
  len = sqrt(len);
  for (int j = 0; j < n && len > 0.0; ++j) v[j] /= len;
  return len;
}

/* Length of the direction that is frozen for pair i, by its largest component. */
static double tr_frozen_length(const tr_sim *s, int i) {
  const double *d = tr_mode_of(s, i)->direction;
  return tr_is_set(s, i) && tr_slides(s, i) ? fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2]))) : 0.0;
}

/* Steps of impulses freeze no direction of sliding: pairs that moved along a line have its direction, of no length that outweighs rates. */
static void tr_leave_lines(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_pair_of(s, i)->nrates > 1 && tr_frozen_length(s, i) > TR_LINE)
      for (int j = 0; j < 3; ++j) tr_mode_of(s, i)->direction[j] /= ON_LINE;
}

/* Whether pair i, which began to slide along a line, is still on it with these rates, but for a part `width` of its speed. Across the line
 * friction is so stiff at low speed that explicit methods blow round-off up from stage to stage; with the direction frozen there is nothing
 * across it. */
static int tr_is_on_line(const tr_sim *s, int i, const double *rate, double width) {
  const tr_pair *pair = tr_pair_of(s, i);
  double v[3], d[3], along = 0.0, speed = 0.0, across = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    double arm = TR_A(s, arm)[pair->eta0 + j];
    v[j] = rate[j] * arm, d[j] = tr_mode_of(s, i)->direction[j] * arm / ON_LINE;
  }
  tr_unit(pair->nrates, d);
  for (int j = 0; j < pair->nrates; ++j) along += v[j] * d[j], speed += v[j] * v[j];
  for (int j = 0; j < pair->nrates; ++j) across += (v[j] - along * d[j]) * (v[j] - along * d[j]);
  return across <= width * width * speed && along >= 0.0;
}

/* The same at the block's state: on it but for round-off. */
static int tr_stays_on_line(tr_sim *s, int i) {
  double rate[3];
  if (!(tr_frozen_length(s, i) > TR_LINE)) return 0;
  tr_rates_of_state(s, i, rate);
  return tr_is_on_line(s, i, rate, LINE_WIDTH);
}
