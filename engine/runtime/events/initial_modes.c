/* Modes of stops and pairs at the start of a run, after a change of parameters, or after a rejected solution. */
#include "events/events.h"

#define ANSWERS_AT_START 4 /* largest number of pairs at rest at the start for which all combinations of modes are searched */

/* Set the modes of set-valued pairs at the start. Sliding pairs slip, and the modes of pairs at rest are decided. Requires maps of
 * y. Returns a status. */
static int tr_set_initial_set_valued(tr_sim *s, double *y) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1];
  tr_set_levers(s);
  memset(TR_A(s, capture_tried), 0, sizeof(double) * k->nsliders), memset(TR_A(s, speed_errors), 0, sizeof(double) * 2 * k->nsliders);
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set_valued(s, i)) tr_mode_of(s, i)->flag = tr_pair_speed(s, i) > tr_rest_speed(tr_speed_unit(s)) ? TR_SLIPS : TR_STUCK;
  int n = tr_collect_pairs_at_rest(s, -1, rest);
  if (n == 0) return TR_OK;
  tr_bring_to_rest(s, y, rest, n, 0);
  tr_evaluate_maps(s, y);
  if (tr_decide_modes(s, rest, n, -1)) {
    tr_prefer_sticking(s, s->clock.t, rest, n, -1, ANSWERS_AT_START);
    return TR_OK;
  }
  return TR_FAIL_MODES;
}

/* Set the flags of all end stops and latches at the start. Contacts of joints that only push keep their flags. Requires the
 * signals. */
static void tr_set_initial_stops(tr_sim *s) {
  const tr_kernel *k = s->k;
  double depth[k->nstops + 1], *y = TR_A(s, y);
  for (int i = 0; i < k->nstops; ++i) { /* when parameters change during a run, a hook stays engaged */
    if (tr_contact_of_stop(s, i) >= 0) continue; /* flags of contacts are set by the assembly and the run */
    if (!tr_is_hook(s, i)) *tr_stop_flag(s, i) = TR_STOP_OPEN;
    else if (!s->stats.steps) *tr_stop_flag(s, i) = k->down[i - (k->nstops - k->nlatches)];
  }
  tr_stop_depths(s, y, depth);
  int again = 0;
  for (int i = k->nstops - k->nlatches; i < k->nstops; ++i) /* a hook that is not behind any tooth is open */
    if (tr_is_pressed(s, i) && !(depth[i] > 0.0)) *tr_stop_flag(s, i) = TR_STOP_OPEN, again = 1;
  if (again) tr_stop_depths(s, y, depth);
  for (int i = 0; i < k->nstops; ++i) {
    if (tr_contact_of_stop(s, i) >= 0) continue;
    if (!(depth[i] > 0.0)) *tr_stop_flag(s, i) = TR_STOP_OPEN;
    else if (!tr_is_pressed(s, i)) *tr_stop_flag(s, i) = tr_pressed_flag(s, i, depth);
  }
  for (int c = 0; c < k->nunilateral; ++c)
    if (tr_is_contact_away(s, c)) tr_set_contact(s, c, 0);
}

static int tr_set_initial_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  double *y = TR_A(s, y), none[k->nn + 1];
  memset(none, 0, sizeof none);
  tr_set_time(s, s->clock.t);
  tr_set_initial_stops(s);
  s->friction = (tr_friction){.pace = s->friction.pace, .from_anywhere = s->friction.from_anywhere, .searched = NAN, .folded = -INFINITY, .resumed_t = NAN,
                              .capture = -1, .cutting_pair = -1, .freed = -1, .failed = -1, .past_t = {NAN, NAN, NAN, NAN}};
  s->step.explicit_for_now = 0;
  memset(tr_stopping_marks(s), 0, sizeof(int) * k->nsliders);
  if (k->nsliders == 0) return TR_OK;
  for (int i = 0; i < k->nsliders; ++i) memset(tr_mode_of(s, i), 0, sizeof(tr_mode)), tr_zone_of(s, i)->inside = 0;
  tr_evaluate_maps(s, y);
  for (int i = 0; i < k->nsliders; ++i) tr_freeze_direction(s, i);
  const double *rates = map_rates(k, TR_A(s, maps));
  const tr_sliding *now = tr_sliding_of(s, 0);
  k->laws(none, rates, TR_A(s, x), TR_A(s, c) + k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_pair_of(s, i)->kind == TR_KIND_KINK && fabs(now[i].speed) > now[i].border) tr_mode_of(s, i)->flag = TR_SATURATED;
  if (k->sets) {
    int code = tr_set_initial_set_valued(s, y);
    if (code != TR_OK) return code;
  }
  if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  for (int i = 0; i < k->nsliders; ++i) {
    tr_mode *m = tr_mode_of(s, i);
    if (!tr_is_sliding(s, i)) continue;
    if (tr_pair_of(s, i)->kind == TR_KIND_KINK && fabs(now[i].speed) < now[i].border) m->flag = TR_PROPORTIONAL;
    if (tr_pair_of(s, i)->kind == TR_KIND_SET && now[i].cone < 0.0) m->flag = TR_CONE;
  }
  if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  return s->friction.from_anywhere && tr_check_solution(s, y, 0, 0) ? TR_FAIL_MULTIPLIERS : TR_OK;
}

static int tr_reset_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  tr_mode modes[k->nsliders + 1];
  if (!k->sets || s->step.failure != TR_FAIL_MODES) return 0;
  s->step.watch = 0, s->step.failure = TR_OK;
  tr_evaluate_maps_at(s, s->clock.t, y);
  tr_save_modes(s, modes);
  for (int i = 0; i < k->nsliders; ++i) {
    tr_mode *m = tr_mode_of(s, i);
    if (!tr_is_set_valued(s, i) || tr_pair_speed(s, i) <= tr_closure_speed(s)) continue;
    if (tr_mode_flag(m) == TR_STUCK) m->flag = TR_SLIPS;
    tr_freeze_direction(s, i);
  }
  return tr_decide_again(s, -1, modes, 1);
}

static int tr_decide_from_anywhere(tr_sim *s, int code) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  tr_mode modes[k->nsliders + 1];
  if (!k->sets || s->friction.searched == s->clock.t || (code != TR_FAIL_MODES && s->step.have_k1)) return 0;
  s->friction.searched = s->clock.t, s->step.watch = 0;
  tr_save_modes(s, modes);
  tr_evaluate_maps_at(s, s->clock.t, y);
  s->friction.from_anywhere = 1;
  int found = tr_decide_again(s, s->friction.failed, modes, 0);
  s->friction.from_anywhere = 0;
  s->stats.events += found;
  return found;
}
