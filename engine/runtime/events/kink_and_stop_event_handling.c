/* Handling of events of laws with a kink, and of stops: mode changes and event records. A pair enters and leaves the proportional
 * zone at its kink. A reversal of its sliding inside the zone is known only when the pair leaves the zone. The contacts at the
 * entry are therefore stored. */
#include "events/events.h"

/* relative to the step: distance before the event at which a ball is evaluated. If the tilt vanishes at the event like a square
 * root, the tilt is below 0.01 at this distance. */
#define FOLD_BEFORE 1e-4
/* rad (three degrees): a change of a ball's tilt counts as a jump only above this value. Long steps resolve tilts to one degree. */
#define FOLD_TILT 0.05

/* Pair i enters the proportional zone at (t, y): store its direction and its contacts. */
static void tr_enter_zone(tr_sim *s, int i, double t, const double *y) {
  tr_zone *zone = tr_zone_of(s, i);
  zone->inside = 1, zone->entered = t, zone->reversal = NAN;
  memcpy(zone->direction, tr_mode_of(s, i)->direction, sizeof zone->direction);
  zone->ncontacts = tr_pair_contacts(s, i, y, zone->before);
}

static double tr_speed_along_entry(const tr_sim *s, int i) {
  const double *r = tr_pair_rates(s, i), *d = tr_zone_of(s, i)->direction;
  double a = 0.0;
  for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) a += r[j] * d[j];
  return a;
}

/* Pair i leaves the proportional zone at (t, y): log a reversal if its sliding direction reversed inside the zone. */
static void tr_leave_zone(tr_sim *s, int i, double t, const double *y) {
  tr_zone *zone = tr_zone_of(s, i);
  tr_contact after[TR_EVENT_CONTACTS];
  if (zone->inside && tr_speed_along_entry(s, i) < 0.0) {
    int n = tr_pair_contacts(s, i, y, after);
    double at = zone->reversal == zone->reversal ? zone->reversal : 0.5 * (zone->entered + t);
    tr_log_event(s, at, TR_EV_REVERSAL, i, zone->before, after, n < zone->ncontacts ? n : zone->ncontacts);
  }
  zone->inside = 0;
}

/* Try the proportional branch of pair i at its kink (t, y). Returns 1 if this branch exists at this state. Otherwise restores the
 * saturated branch and returns 0. (The friction of a ball near its cone has hysteresis: its sliding branch ends slightly later than
 * at the kink.) */
static int tr_take_branch_below_kink(tr_sim *s, int i, double t, const double *y) {
  tr_mode *m = tr_mode_of(s, i);
  if (tr_sliding_of(s, i)->speed < 0.0) return 0; /* the direction turned by more than a right angle since it was frozen */
  m->flag = TR_PROPORTIONAL;
  if (tr_rhs(s, t, y, TR_A(s, dy)) && fabs(tr_sliding_of(s, i)->speed) <= tr_sliding_of(s, i)->border) return 1;
  m->flag = TR_SATURATED;
  tr_rhs(s, t, y, TR_A(s, dy));
  return 0;
}

/* Ball i has just left the proportional zone at (t, y). If its sliding branch does not continue, take another root and log a
 * fold. */
static void tr_jump_beyond_fold(tr_sim *s, int i, double t, const double *y) {
  tr_contact before[TR_EVENT_CONTACTS], after[TR_EVENT_CONTACTS];
  const int n = tr_pair_contacts(s, i, y, before);
  if (!tr_find_tilt_beyond_kink(s, TR_A(s, z) + s->k->active, i) || !tr_rhs(s, t, y, TR_A(s, dy))) return;
  tr_log_event(s, t, TR_EV_FOLD, i, before, after, tr_pair_contacts(s, i, y, after) ? n : 0);
}

/* Tilt of ball i at the present solution; 0 if the ball spins. Evaluates the laws again, because Newton's method leaves the values
 * of the iterate before the last one. */
static double tr_current_tilt(tr_sim *s, int i) {
  tr_evaluate_laws(s, TR_A(s, z) + s->k->active);
  return sqrt(fmax(tr_sliding_of(s, i)->cone, 0.0));
}

static tr_branch tr_evaluate_branch(tr_sim *s, int i, double t, const double *y) {
  tr_branch was = {.tilt = NAN};
  const int n = s->k->active + s->k->neta;
  double z[n + 1];
  tr_copy(n, TR_A(s, z), z);
  if (tr_rhs(s, t, y, TR_A(s, dy))) was.tilt = tr_current_tilt(s, i), was.ncontacts = tr_pair_contacts(s, i, y, was.contacts);
  tr_copy(n, z, TR_A(s, z));
  return was;
}

static tr_branch tr_evaluate_branch_before(tr_sim *s, int which) {
  const double theta = s->pending.theta * (1.0 - FOLD_BEFORE);
  if (which >= s->k->nsliders || !tr_pair_of(s, which)->cone || s->pending.captured) return (tr_branch){.tilt = NAN};
  tr_dense_state(s, theta, TR_A(s, yout));
  return tr_evaluate_branch(s, which, s->step.t0 + theta * s->step.size, TR_A(s, yout));
}

static void tr_log_fold(tr_sim *s, int i, double t, const double *y, const tr_branch *was) {
  tr_contact after[TR_EVENT_CONTACTS];
  const double jump = fabs(tr_current_tilt(s, i) - was->tilt) - FOLD_TILT;
  if (jump > 0.0) {
    tr_record_margin(s, jump);
    tr_log_event(s, t, TR_EV_FOLD, i, was->contacts, after, tr_pair_contacts(s, i, y, after) ? was->ncontacts : 0);
  }
}

static void tr_release_behind(tr_sim *s, int hook, double t) {
  const int behind = tr_stop_behind_hook(s, hook);
  if (!tr_is_pressed(s, behind)) return;
  *tr_stop_flag(s, behind) = TR_STOP_OPEN;
  tr_log_event(s, t, TR_EV_END_STOP_RELEASED, behind, 0, 0, 0);
  s->stats.events++;
}

/* Whether a hook that is down leaves its tooth at y because the next tooth passes. In this case the signal does not lift the hook,
 * and nothing presses on the hook. y may be slightly before the tooth, because loops were closed after the event was located. */
static int tr_is_tooth_passing(const tr_sim *s, int stop, const double *y) {
  double depth[s->k->nstops + 1], lifts[s->k->nstops + 1];
  if (!tr_is_hook(s, stop) || !tr_is_pressed(s, stop)) return 0;
  tr_stop_depths_and_pushes(s, y, depth, lifts);
  return depth[tr_stop_behind_hook(s, stop)] < 0.0 && -lifts[stop] > depth[stop];
}

static void tr_switch_stop(tr_sim *s, int stop, double t, const double *y) {
  const int was = (int)*tr_stop_flag(s, stop), hook = tr_is_hook(s, stop), passing = tr_is_tooth_passing(s, stop, y);
  const double before = tr_potential_energy(s, y);
  double depth[s->k->nstops + 1];
  *tr_stop_flag(s, stop) = TR_STOP_OPEN;
  tr_stop_depths(s, y, depth);
  int now = !was || (hook && depth[stop] > 0.0) ? (int)tr_pressed_flag(s, stop, depth) : TR_STOP_OPEN;
  if (passing && now <= was) now = was + 1;
  if (was && now) tr_release_behind(s, stop, t);
  *tr_stop_flag(s, stop) = now;
  if (hook && was) {
    const double lost = before - tr_potential_energy(s, y);
    s->audit.begin -= lost, s->audit.energy0 -= lost;
  }
  if (was && now <= was) {
    tr_log_event(s, t, tr_stop_event_kind(s, stop, 0), stop, 0, 0, 0);
    s->stats.events += now > 0;
  }
  if (hook && was && !now) tr_release_behind(s, stop, t);
  if (now) tr_log_event(s, t, tr_stop_event_kind(s, stop, 1), stop, 0, 0, 0);
}

static void tr_switch_mode(tr_sim *s, int which, double t, const double *y) {
  const tr_kernel *k = s->k;
  if (which < k->nsliders && tr_has_kink_at_rest(s, which)) { /* friction is continuous, so no event is logged */
    tr_freeze_direction(s, which);
    return;
  }
  s->stats.events++;
  if (which >= k->nsliders) {
    tr_switch_stop(s, which - k->nsliders, t, y);
    return;
  }
  tr_mode *m = tr_mode_of(s, which);
  const int saturated = tr_mode_flag(m) == TR_SATURATED;
  if (saturated && fabs(tr_sliding_of(s, which)->speed) > tr_sliding_of(s, which)->border && !tr_take_branch_below_kink(s, which, t, y)) {
    tr_freeze_direction(s, which); /* the pair still slides fast, so its direction is accurate */
  } else if (saturated) {
    tr_enter_zone(s, which, t, y);
    m->flag = TR_PROPORTIONAL;
  } else {
    tr_leave_zone(s, which, t, y);
    m->flag = TR_SATURATED;
    tr_freeze_direction(s, which);
    if (tr_pair_of(s, which)->cone) tr_jump_beyond_fold(s, which, t, y);
  }
}
