/* The modes of stops and pairs at the start of a run, when parameters have changed in the middle of one, or when those in force have led to
 * an answer that was refused. */
#include "modes.h"

/* Pairs with a set-valued law at the start: sliding, or at rest and then decided. Maps in place. */
static int tr_start_sets(tr_sim *s, double *y) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1];
  tr_set_arms(s);
  memset(TR_A(s, vmin), 0, sizeof(double) * k->nsliders), memset(TR_A(s, stray), 0, sizeof(double) * 2 * k->nsliders);
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set(s, i)) tr_mode_of(s, i)->flag = tr_pair_speed(s, i) > REST_SPEED * tr_speed_unit(s) ? TR_SLIPS : TR_STUCK;
  int n = tr_at_rest(s, -1, rest);
  if (n == 0) return TR_OK;
  tr_bring_to_rest(s, y, rest, n, 0);
  tr_maps_of(s, y);
  if (tr_decide(s, rest, n, -1)) {
    tr_note_answers(s, s->clock.t, rest, n, ANSWERS_AT_START);
    return TR_OK;
  }
  return TR_FAIL_MODES;
}

/* Modes at the start: saturated where the sliding could be faster than the kink (a ball's speed depends on its load; without load
 * it is largest), then proportional where with the loads found it is not. */
static int tr_start_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  double depth[k->nstops + 1], *y = TR_A(s, y), none[k->nn + 1];
  memset(none, 0, sizeof none);
  tr_set_time(s, s->clock.t);
  for (int i = 0; i < k->nstops; ++i) { /* a latch that is down stays so where parameters change in the middle of a run */
    if (!tr_is_hook(s, i)) *tr_stop_flag(s, i) = TR_STOP_OPEN;
    else if (!s->stats.steps) *tr_stop_flag(s, i) = k->down[i - (k->nstops - k->nlatches)];
  }
  tr_depths(s, y, depth);
  int again = 0;
  for (int i = k->nstops - k->nlatches; i < k->nstops; ++i) /* or has gone on to another tooth */
    if (tr_pressed(s, i) && !(depth[i] > 0.0)) *tr_stop_flag(s, i) = TR_STOP_OPEN, again = 1;
  if (again) tr_depths(s, y, depth);
  for (int i = 0; i < k->nstops; ++i) {
    if (!(depth[i] > 0.0)) *tr_stop_flag(s, i) = TR_STOP_OPEN;
    else if (!tr_pressed(s, i)) *tr_stop_flag(s, i) = tr_flag_pressed(s, i, depth);
  }
  s->friction = (tr_friction){.pace = s->friction.pace, .anywhere = s->friction.anywhere, .searched = NAN, .folded = -INFINITY, .resumed_t = NAN,
                              .capture = -1, .missed = -1, .freed = -1, .failed = -1, .past_t = {NAN, NAN, NAN, NAN}};
  s->step.aside = 0;
  memset(tr_ends(s), 0, sizeof(int) * k->nsliders);
  if (k->nsliders == 0) return TR_OK;
  for (int i = 0; i < k->nsliders; ++i) memset(tr_mode_of(s, i), 0, sizeof(tr_mode)), tr_zone_of(s, i)->inside = 0;
  tr_maps_of(s, y);
  for (int i = 0; i < k->nsliders; ++i) tr_freeze(s, i);
  const double *rates = map_rates(k, TR_A(s, maps));
  const tr_sliding *now = tr_sliding_of(s, 0);
  k->laws(none, rates, TR_A(s, x), TR_A(s, c) + k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_pair_of(s, i)->kind == TR_KIND_KINK && fabs(now[i].speed) > now[i].border) tr_mode_of(s, i)->flag = TR_SATURATED;
  if (k->sets) {
    int code = tr_start_sets(s, y);
    if (code != TR_OK) return code;
  }
  if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  for (int i = 0; i < k->nsliders; ++i) {
    tr_mode *m = tr_mode_of(s, i);
    if (!tr_slides(s, i)) continue;
    if (tr_pair_of(s, i)->kind == TR_KIND_KINK && fabs(now[i].speed) < now[i].border) m->flag = TR_PROPORTIONAL;
    if (tr_pair_of(s, i)->kind == TR_KIND_SET && now[i].cone < 0.0) m->flag = TR_CONE;
  }
  if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  return s->friction.anywhere && tr_broken(s, y, 0, 0) ? TR_FAIL_MULTIPLIERS : TR_OK;
}

/* Where an answer was refused and no shorter step has another: the modes are chosen again from the state in place, as at a start. 1 when
 * they are others then. */
static int tr_decides_anew(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  tr_mode modes[k->nsliders + 1];
  if (!k->sets || s->step.trouble != TR_FAIL_MODES) return 0;
  s->step.watch = 0, s->step.trouble = TR_OK;
  tr_maps_at(s, s->clock.t, y);
  tr_keep_modes(s, modes);
  for (int i = 0; i < k->nsliders; ++i) {
    tr_mode *m = tr_mode_of(s, i);
    if (!tr_is_set(s, i) || tr_pair_speed(s, i) <= tr_creep(s)) continue;
    if (tr_flag(m) == TR_STUCK) m->flag = TR_SLIPS;
    tr_freeze(s, i);
  }
  return tr_settles_anew(s, -1, modes, 1);
}

/* A decision at the block's state has failed: once more, with friction sought from all starts there are, and of the pair whose event it
 * was. 1 when it then succeeds. */
static int tr_searches_on(tr_sim *s, int code) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  tr_mode modes[k->nsliders + 1];
  if (!k->sets || s->friction.searched == s->clock.t || (code != TR_FAIL_MODES && s->step.have_k1)) return 0;
  s->friction.searched = s->clock.t, s->step.watch = 0;
  tr_keep_modes(s, modes);
  tr_maps_at(s, s->clock.t, y);
  s->friction.anywhere = 1;
  int found = tr_settles_anew(s, s->friction.failed, modes, 0);
  s->friction.anywhere = 0;
  s->stats.events += found;
  return found;
}
