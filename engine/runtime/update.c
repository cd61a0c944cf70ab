/* What becomes of a mode that ends in a run whose steps are an importer's own, at the importer's time and state (``told.c``). */
#include "modes.h"

#define ENDS_AGAIN 0.5     /* of the speed at which rest was last tried in vain: slower than that it is tried again */
#define TURNS_ROUND -0.9   /* cosine: what turns by more has stopped in between */
#define LAST_MOST 60       /* evaluations for the direction in which a pair comes to rest, */
#define LAST_PART 0.5      /* by so much of what it turns while the speed falls by itself; by so much less where it turns back, */
#define LAST_GROWS 1.1     /* else by so much more, */
#define LAST_FOUND 1e-6    /* until it turns by no more than this */
#define ROUNDS 4           /* events of each pair and stop at one time */
#define DUE_CONE 1e-9      /* of that number: with less left a ball is at its cone, or it may be found beyond where the importer goes on */
#define NEAR_CONE 1e-3     /* of s²/|ω|²: a ball nearer to its cone is looked at */
#define LOOKED 1e-9        /* of the time in which the motion changes: so far ahead */

/* Which pair or stop is at the end of its mode, sliding first, for it changes what others carry; -1: none. */
static int tr_due(const tr_sim *s) {
  const double *z = TR_A(s, told), *handled = tr_handled(s);
  int found = -1;
  for (int i = 0; i < tr_watched(s); ++i) {
    const int pair = i < s->k->nsliders;
    const double least = pair ? fmin(z[2 * i], z[2 * i + 1]) : z[s->k->nsliders + i];
    if ((least > 0.0 && !(pair && tr_cone_left(s, i) <= DUE_CONE)) || handled[i] >= ROUNDS) continue;
    if (found < 0 || (pair && !tr_is_stuck(s, i) && found < s->k->nsliders && tr_is_stuck(s, found))) found = i;
  }
  return found;
}

/* The same of a ball whose friction jumps across its cone just ahead: no root is found of that, so that an importer stops before it. What is
 * told is then what it tells here. */
static int tr_due_ahead(tr_sim *s) {
  const double ahead = LOOKED / s->set.rate, t = s->clock.t;
  const int n = tr_width(s), numbers = 2 * s->k->nsliders + s->k->nstops + 1;
  double *y = TR_A(s, y), here[n], told[numbers];
  int balls = 0;
  for (int i = 0; i < s->k->nsliders; ++i) balls += tr_cone_left(s, i) < NEAR_CONE;
  if (!balls) return -1;
  tr_copy(n, y, here), tr_copy(numbers, TR_A(s, told), told);
  for (int i = 0; i < s->ny; ++i) y[i] += ahead * TR_A(s, dy)[i];
  s->clock.t += ahead;
  if (tr_rhs_in_modes(s)) tr_tell(s);
  const int due = tr_due(s), at_cone = due >= 0 && due < s->k->nsliders && tr_cone_left(s, due) <= DUE_CONE;
  s->clock.t = t;
  tr_copy(n, here, y), tr_copy(numbers, told, TR_A(s, told));
  return tr_rhs_in_modes(s) && at_cone ? due : -1;
}

/* Pair i, of several components, is slow or has turned: whether it stops here. */
static int tr_stops_here(tr_sim *s, int i) {
  const double speed = tr_pair_speed(s, i), unit = tr_own_speed(s, i);
  const int back = tr_speed_in_mode(s, i) < 0.0;
  if (back && tr_speed_along(s, i) > TURNS_ROUND * speed && speed > 2.0 * ENDS_SPEED * unit) return 0;
  if (!back && !(tr_time_to_brake(s, i) < INFINITY)) return 0;
  tr_copy(tr_width(s), TR_A(s, y), TR_A(s, yold));
  const int stops = tr_rest_has_answer(s, s->clock.t, TR_A(s, yold), i);
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  return tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) && stops;
}

/* The sliding of pair i ends, or it is let go: decided anew with all that rest. Failing that all is as it was. */
static int tr_settle_here(tr_sim *s, int i) {
  const int events = s->events.count;
  double *y = TR_A(s, y);
  tr_copy(tr_width(s), y, TR_A(s, ynew));
  tr_keep_modes(s, (tr_mode *)TR_A(s, modes));
  const int code = tr_settle(s, s->clock.t, y, i, 0);
  if (code == TR_OK) {
    s->stats.events += s->events.count > events;
    return code;
  }
  tr_put_modes(s, (const tr_mode *)TR_A(s, modes));
  tr_copy(tr_width(s), TR_A(s, ynew), y);
  s->friction.failed = i;
  return code;
}

/* The direction of pair i, of several components, is anew: that of its motion, or of a line on which it moves. */
static void tr_goes_its_way(tr_sim *s, int i) {
  const double *rates = tr_slider_rates(s, i);
  const int line = tr_frozen_length(s, i) > TR_LINE;
  if (line ? !tr_is_on_line(s, i, rates, LINE_LEFT) : !tr_is_on_line(s, i, rates, LINE_WIDTH)) tr_freeze(s, i);
  else if (!line) tr_freeze_along(s, i, ON_LINE, rates, tr_pair_speed(s, i));
  TR_A(s, slow)[i] = ENDS_SPEED * tr_own_speed(s, i);
}

/* Friction of pair i along the surface direction d, its rates' direction. Surface acceleration then; 0 where there is none. */
static int tr_accelerates_along(tr_sim *s, int i, const double *d, double *acc) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *arm = TR_A(s, arm) + pair->eta0;
  for (int j = 0; j < pair->nrates; ++j) tr_mode_of(s, i)->direction[j] = ON_LINE * d[j] / arm[j];
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0;
  for (int j = 0; j < pair->nrates; ++j) acc[j] = tr_acceleration_now(s, pair->eta0 + j) * arm[j];
  return 1;
}

/* The direction in which pair i, of several components, comes to rest at the block's state: that to which its motion turns as it slows down,
 * from the one it had. The last of its speed, which is that of the solver's errors, does not tell. Evaluated with it. */
static void tr_last_direction(tr_sim *s, int i) {
  const int n = tr_pair_of(s, i)->nrates;
  const double *arm = TR_A(s, arm) + tr_pair_of(s, i)->eta0;
  const tr_mode was = *tr_mode_of(s, i);
  double d[3] = {0.0, 0.0, 0.0}, last[3] = {0.0, 0.0, 0.0}, acc[3], across = 1.0, along = -1.0, part = LAST_PART;
  for (int j = 0; j < n; ++j) d[j] = was.direction[j] * arm[j] / tr_frozen_length(s, i);
  for (int it = 0; it < LAST_MOST && across > LAST_FOUND && along < 0.0; ++it) {
    if (!(tr_unit(n, d) > 0.0) || !tr_accelerates_along(s, i, d, acc)) break;
    double back = across = along = 0.0;
    for (int j = 0; j < n; ++j) along += acc[j] * d[j];
    for (int j = 0; j < n; ++j) acc[j] = (acc[j] - along * d[j]) / fabs(along), across += acc[j] * acc[j], back += acc[j] * last[j];
    across = sqrt(across);
    part *= back < 0.0 ? LAST_PART : LAST_GROWS;
    for (int j = 0; j < n; ++j) last[j] = acc[j], d[j] += part * acc[j] / fmax(1.0, across);
  }
  if (across <= LAST_FOUND && along < 0.0) return;
  *tr_mode_of(s, i) = was;
  tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy));
}

/* A ball that turns about its contact, as good as at rest, is at rest: no branch of its law is to be chosen. */
static void tr_takes_last_speed(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  if (tr_flag(tr_mode_of(s, i)) != TR_CONE || pair->v0 < 0) return;
  for (int j = 0; j < pair->nrates; ++j) TR_A(s, y)[s->k->nq + pair->v0 + j] = 0.0;
  tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy));
}

/* What pair i with a set-valued law does at the end of its mode, at the block's state, just evaluated. */
static int tr_ends_set(tr_sim *s, int i) {
  const double *z = TR_A(s, told) + 2 * i;
  const int several = tr_pair_of(s, i)->nrates > 1 && !tr_is_stuck(s, i);
  double *y = TR_A(s, y);
  if (z[0] > 0.0 && (!several || tr_keeps_way(s, i) > 0.0)) {
    s->stats.events++;
    return tr_meets_cone(s, s->clock.t, y, i);
  }
  if (z[0] > 0.0) {
    tr_goes_its_way(s, i);
  } else if (several && !tr_stops_here(s, i)) {
    TR_A(s, slow)[i] = ENDS_AGAIN * tr_pair_speed(s, i);
    tr_freeze(s, i);
  } else {
    if (several) tr_last_direction(s, i), tr_takes_last_speed(s, i);
    return tr_settle_here(s, i);
  }
  return tr_rhs(s, s->clock.t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* The same of any pair or stop. */
static int tr_ends_mode(tr_sim *s, int i) {
  const int pairs = s->k->nsliders;
  tr_handled(s)[i] += 1.0;
  if (i < pairs && tr_is_set(s, i)) return tr_ends_set(s, i);
  if (i < pairs && TR_A(s, told)[2 * i] > 0.0) {
    tr_zone_of(s, i)->reversal = s->clock.t;
    return TR_OK;
  }
  tr_switch(s, i, s->clock.t, TR_A(s, y));
  return tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* Friction has no answer at the block's (t, y) any more: the root that was followed has folded away. Where another is left the motion goes on
 * with that. 1 when there is one. */
static int tr_folds_here(tr_sim *s) {
  const tr_kernel *k = s->k;
  double jump;
  tr_mode *modes = (tr_mode *)TR_A(s, modes);
  if (!k->neta) return 0;
  tr_maps_at(s, s->clock.t, TR_A(s, y));
  tr_keep_modes(s, modes);
  if (!tr_root_on_branches(s) || !tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) || !tr_fits_branches(s)) {
    tr_put_modes(s, modes);
    return 0;
  }
  const int pair = tr_most_changed(s, TR_A(s, zend) + k->active, TR_A(s, z) + k->active, &jump);
  if (jump > FOLD_JUMP) tr_log(s, s->clock.t, TR_EV_FOLD, pair, 0, 0, 0), s->stats.events++;
  return 1;
}

/* The same of a ball that can turn without sliding. */
static int tr_spins_here(tr_sim *s) {
  const int events = s->events.count;
  tr_mode *modes = (tr_mode *)TR_A(s, modes);
  tr_keep_modes(s, modes);
  if (!tr_lets_spin(s)) return 0;
  for (int i = 0; i < s->k->nsliders && s->events.count == events; ++i)
    if (tr_flag(modes + i) != tr_flag(tr_mode_of(s, i))) tr_log(s, s->clock.t, TR_EV_FOLD, i, 0, 0, 0);
  return 1;
}

/* After a failure at the block's (t, y): whether the run goes on from there in another way. tried: how often it has been asked. */
static int tr_goes_on_here(tr_sim *s, int code, int tried) {
  s->step.have_k1 = 0;
  if (code == TR_FAIL_MULTIPLIERS && tried < s->k->nsliders && (tr_spins_here(s) || tr_slow_pair_stops(s) || tr_folds_here(s))) return 1;
  s->step.have_k1 = 0;
  return tr_goes_on(s, code);
}

/* Handle what happens at the block's (t, y): breaks, loops that have come open, modes that end. jumped: loads have jumped. TR_OK, or why
 * the run cannot go on; *changed: whether y is another. */
int tr_update(tr_sim *s, int jumped, int *changed) {
  const double slack = PASSED * fmax(1.0, fabs(s->clock.t));
  double *y = TR_A(s, y);
  for (; tr_next_break(s) <= s->clock.t + slack; ++s->clock.next_break) jumped = 1;
  memset(tr_handled(s), 0, sizeof(double) * tr_watched(s));
  s->step.have_k1 = s->step.have_jac = 0, s->clock.status = TR_OK;
  tr_copy(tr_width(s), y, TR_A(s, kstep));
  tr_moment_between_breaks(s);
  if (!tr_project(s, s->clock.t, y)) return tr_end(s, TR_FAIL_CLOSURE);
  int looked = 0, tried = 0, code = tr_rhs_in_modes(s) ? TR_OK : TR_FAIL_MULTIPLIERS;
  if (code == TR_OK && jumped && (s->friction.still || tr_rests_now(s))) code = tr_settle_here(s, -1);
  for (;;) {
    if (code == TR_OK) {
      tr_tell(s);
      int i = tr_due(s);
      if (i < 0 && !looked) i = tr_due_ahead(s), looked = 1;
      if (i < 0) break;
      code = tr_ends_mode(s, i);
      if (code == TR_OK) tr_keep_answer(s);
    }
    if (code == TR_OK) continue;
    if (!tr_goes_on_here(s, code, tried++)) return tr_end(s, code);
    code = tr_rhs(s, s->clock.t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
    if (code == TR_OK) tr_keep_answer(s);
  }
  tr_is_clear(s);
  tr_keep_up(s);
  *changed = memcmp(TR_A(s, kstep), y, sizeof(double) * tr_states(s)) != 0;
  return TR_OK;
}
