/* Violations: by how much a pair or a stop exceeds the limit of its mode, in tolerances. */
#include "friction/friction.h"

/* relative to tolerance × the sum of absolute terms: largest acceleration that the error of the dense output causes; the largest
 * observed value is 0.02 */
#define OPEN_INSIDE 0.1
/* relative to REST_BROKEN: acceleration at which rest ends; above 1, so that the choice of modes after the event lets the pair move,
 * too */
#define MOVES_ALONG 2.0

static double tr_rest_violation(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double most = 0.0;
  if (!s->k->active || !(tr_pair_speed(s, i) > tr_rest_speed(tr_speed_unit(s)))) return -INFINITY;
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e)
    if (tr_is_held_freedom_moving(s, e, OPEN_INSIDE * s->set.rtol)) most = fmax(most, tr_relative_acceleration(s, e) / REST_BROKEN - MOVES_ALONG);
  return most > 0.0 ? most : -INFINITY;
}

static double tr_set_valued_violation(tr_sim *s, int i) {
  const tr_sliding *v = tr_sliding_of(s, i);
  int flag = tr_mode_flag(tr_mode_of(s, i));
  if (flag == TR_STUCK) return fmax((tr_friction_ratio(s, i) - 1.0) / TOL_RELEASE, tr_rest_violation(s, i));
  if (flag == TR_CONE) return v->cone / TOL_CONE;
  double stop = tr_stick_overshoot(v->speed, tr_speed_unit(s));
  return tr_pair_of(s, i)->cone ? fmax(stop, -v->cone / TOL_CONE) : stop;
}

static double tr_mode_violation(tr_sim *s, int i, const double *depth) {
  const tr_kernel *k = s->k;
  if (i < k->nsliders) {
    int kind = tr_kind_of(s, i);
    if (kind == TR_KIND_SMOOTH) return -1.0;
    if (kind == TR_KIND_SET) return tr_set_valued_violation(s, i);
    if (kind == TR_KIND_TURN) return tr_direction_violation(s, i);
    double speed = tr_sliding_of(s, i)->speed, kink = tr_sliding_of(s, i)->border;
    return (tr_is_sliding(s, i) ? (kink - speed) / kink : (fabs(speed) - kink) / kink) / TOL_KINK;
  }
  int j = i - k->nsliders, c = tr_contact_of_stop(s, j);
  if (c >= 0 && tr_is_contact_away(s, c)) return -1.0;
  if (c >= 0 && tr_is_contact_unloaded(s, c)) return tr_load_of_open_contact(s, c) / (TOL_LIFT * tr_force_unit(s));
  if (c >= 0 && tr_is_pressed(s, j)) return -tr_normal_force(s, c) / (TOL_LIFT * tr_force_unit(s));
  return (tr_is_pressed(s, j) ? -depth[j] : depth[j]) / TOL_STOP;
}
