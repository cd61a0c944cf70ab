/* Collects the pairs at rest, and sets their speeds to zero. In loops, other pairs may come to rest at the same time; these pairs
 * are included. */
#include "modes/modes.h"

/* relative to the period of a load or of a rotation: longest step while pairs are held. In such a step, eight points suffice to
 * find every maximum of a violation (``events/event_location.c``). */
#define HELD_PART 0.25

/* Whether pair i counts as at rest because pair j of the same class is at rest. The limit of the speed of i is the rest speed. If i
 * moves faster than j in the common motion of the class, the limit is multiplied by the ratio of these speeds. */
static int tr_is_at_rest_with(const tr_sim *s, int i, int j) {
  if (!tr_are_coupled(s, i, j)) return 0;
  double ratio = tr_line_speed(s, i) / fmax(tr_line_speed(s, j), NO_FORCE);
  return tr_pair_speed(s, i) <= tr_rest_speed(tr_speed_unit(s)) * fmax(1.0, ratio);
}

static int tr_collect_pairs_at_rest(tr_sim *s, int also, int *rest) {
  TR_NEED(s, TR_HAS_MAPS);
  const int pairs = s->k->nsliders;
  int n = 0, resting[pairs + 1];
  for (int i = 0; i < pairs; ++i) {
    resting[i] = tr_is_set_valued(s, i) && (tr_is_stuck(s, i) || i == also || tr_stopping_marks(s)[i] || tr_is_at_rest(s, i));
    n += resting[i];
  }
  if (!n) return 0;
  tr_find_coupled_pairs(s);
  n = 0;
  for (int i = 0; i < pairs; ++i) {
    int rests = resting[i];
    for (int j = 0; j < pairs && !rests && tr_is_set_valued(s, i); ++j) rests = resting[j] && tr_is_at_rest_with(s, i, j);
    if (rests) rest[n++] = i;
  }
  return n;
}

static int tr_bring_all_to_rest(tr_sim *s, double *y, int also, int *rest, int n) {
  const tr_kernel *k = s->k;
  for (int more = n; n; n = more) {
    tr_bring_to_rest(s, y, rest, n, 0);
    tr_evaluate_maps(s, y);
    if (!k->active) break; /* without loops, pairs stop independently of each other */
    more = tr_collect_pairs_at_rest(s, also, rest);
    if (more <= n) break;
  }
  return n;
}

static double tr_longest_held_step(const tr_sim *s) {
  double pace = s->friction.pace;
  for (int i = 0; i < s->k->nv && s->friction.held; ++i)
    if (s->k->vkind[i] == TR_COORDINATE_ANGLE) pace = fmax(pace, fabs(TR_A(s, y)[s->k->nq + i]) / TURN);
  return pace > 0.0 ? HELD_PART / pace : INFINITY;
}
