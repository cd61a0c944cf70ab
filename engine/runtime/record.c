/* What is written down of an event, a pair's way through the proportional zone of its law, and the switch of a mode where it ends. A
 * reversal is known only when the zone is left again: until then the zone keeps what was there when it was entered. */
#include "modes.h"

#define FOLD_BEFORE 1e-4 /* of the step: so much before its event a ball is looked at; a tilt that ends smoothly, as a root, is below 0.01 there */
#define FOLD_TILT 0.05   /* of a ball's tilt, three degrees: what its branch changes by less is no jump; the tilt of a long step is known to one */

/* Orientation angle of a contact. */
static double tr_angle_of(const tr_contact *p) { return atan2(p->vector[1], p->vector[0]); }

/* Record an event of pair or stop `index`, with n of its contacts. */
static void tr_log(tr_sim *s, double t, int kind, int index, const tr_contact *before, const tr_contact *after, int n) {
  if (s->events.count >= s->events.capacity) return;
  tr_event *e = (tr_event *)TR_A(s, ev) + s->events.count++;
  tr_last *last = &s->events.last;
  memset(e, 0, sizeof *e);
  memset(last, 0, sizeof *last);
  e->time = t, e->kind = kind, e->index = index, e->contacts = n;
  e->margin = tr_method_of(s)->kind == TR_IMPULSES ? NAN : s->events.margin;
  e->marginal = last->marginal = e->margin == e->margin && s->events.unsure;
  const int stop = TR_IS_OF_STOP(kind);
  last->time = t, last->kind = kind, last->element = stop ? 0.0 : 1.0 + tr_pair_of(s, index)->element;
  for (int i = 0; i < n && i < TR_EVENT_CONTACTS; ++i) {
    tr_turn *turned = e->turned + i;
    const double *p = before[i].vector, *q = after[i].vector;
    double a = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), b = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    double dot = a > 0.0 && b > 0.0 ? (p[0] * q[0] + p[1] * q[1] + p[2] * q[2]) / (a * b) : 1.0;
    *turned = (tr_turn){tr_angle_of(before + i), tr_angle_of(after + i), acos(fmax(-1.0, fmin(1.0, dot)))};
    if (last->contact == 0.0 || turned->turn > last->turn)
      last->contact = 1.0 + i, last->before = turned->before, last->after = turned->after, last->turn = turned->turn;
  }
}

/* Contact forces of one pair at the state just evaluated (z and x in place). Returns how many there are. */
static int tr_slider_contacts(tr_sim *s, int i, const double *y, tr_contact *out) {
  const tr_pair *pair = tr_pair_of(s, i);
  int n = pair->ncontacts;
  if (!s->o || !s->o->contacts || n == 0) return 0;
  tr_contact all[s->o->ncontacts + 1];
  double zf[s->k->rows + s->k->neta + 1];
  tr_full_multipliers(s, y, zf, 0);
  s->o->contacts(TR_A(s, x), y, TR_A(s, co), zf, TR_A(s, dy) + s->k->nq, (double *)all);
  memcpy(out, all + pair->contact0, sizeof(tr_contact) * n);
  return n;
}

/* The pair enters the zone: what is there now is kept. */
static void tr_enter_zone(tr_sim *s, int i, double t, const double *y) {
  tr_zone *zone = tr_zone_of(s, i);
  zone->inside = 1, zone->entered = t, zone->reversal = NAN;
  memcpy(zone->direction, tr_mode_of(s, i)->direction, sizeof zone->direction);
  zone->ncontacts = tr_slider_contacts(s, i, y, zone->before);
}

/* Sliding velocity along that with which the zone was entered: negative when it has turned round. */
static double tr_along(const tr_sim *s, int i) {
  const double *r = tr_slider_rates(s, i), *d = tr_zone_of(s, i)->direction;
  double a = 0.0;
  for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) a += r[j] * d[j];
  return a;
}

/* The pair leaves the zone: when its sliding has turned round inside, that is recorded. */
static void tr_leave_zone(tr_sim *s, int i, double t, const double *y) {
  tr_zone *zone = tr_zone_of(s, i);
  tr_contact after[TR_EVENT_CONTACTS];
  if (zone->inside && tr_along(s, i) < 0.0) {
    int n = tr_slider_contacts(s, i, y, after);
    double at = zone->reversal == zone->reversal ? zone->reversal : 0.5 * (zone->entered + t);
    tr_log(s, at, TR_EV_REVERSAL, i, zone->before, after, n < zone->ncontacts ? n : zone->ncontacts);
  }
  zone->inside = 0;
}

/* The friction of pair i, at the kink of its law at (t, y), may turn back a little before the kink (a ball near its cone: hysteresis): just
 * evaluated it is on the sliding branch still, which is there no longer an instant later. Whether it is below the kink on the other one;
 * then that is in place. */
static int tr_turns_back(tr_sim *s, int i, double t, const double *y) {
  tr_mode *m = tr_mode_of(s, i);
  if (tr_sliding_of(s, i)->speed < 0.0) return 0; /* the direction has turned by more than a right angle since it was frozen */
  m->flag = TR_PROPORTIONAL;
  if (tr_rhs(s, t, y, TR_A(s, dy)) && fabs(tr_sliding_of(s, i)->speed) <= tr_sliding_of(s, i)->border) return 1;
  m->flag = TR_SATURATED;
  tr_rhs(s, t, y, TR_A(s, dy));
  return 0;
}

/* Ball i has just left its zone at (t, y): where its sliding cannot go on from there it goes on at another root, a fold. */
static void tr_leap(tr_sim *s, int i, double t, const double *y) {
  tr_contact before[TR_EVENT_CONTACTS], after[TR_EVENT_CONTACTS];
  const int n = tr_slider_contacts(s, i, y, before);
  if (!tr_slides_elsewhere(s, TR_A(s, z) + s->k->active, i) || !tr_rhs(s, t, y, TR_A(s, dy))) return;
  tr_log(s, t, TR_EV_FOLD, i, before, after, tr_slider_contacts(s, i, y, after) ? n : 0);
}

/* A ball's friction just before its event: its tilt (not a number: not known), its contacts. */
typedef struct tr_branch {
  double tilt;
  int ncontacts;
  tr_contact contacts[TR_EVENT_CONTACTS];
} tr_branch;

/* Tilt of ball i at the state just evaluated; one that turns about its contact has none. (What Newton's method leaves in place is that of its
 * last iterate but one, and a root of what is small.) */
static double tr_tilt_now(tr_sim *s, int i) {
  tr_law(s, TR_A(s, z) + s->k->active);
  return sqrt(fmax(tr_sliding_of(s, i)->cone, 0.0));
}

/* What there is of ball i at (t, y), in the modes in force. Multipliers are left as they were. */
static tr_branch tr_branch_at(tr_sim *s, int i, double t, const double *y) {
  tr_branch was = {.tilt = NAN};
  const int n = s->k->active + s->k->neta;
  double z[n + 1];
  tr_copy(n, TR_A(s, z), z);
  if (tr_rhs(s, t, y, TR_A(s, dy))) was.tilt = tr_tilt_now(s, i), was.ncontacts = tr_slider_contacts(s, i, y, was.contacts);
  tr_copy(n, z, TR_A(s, z));
  return was;
}

/* The same just before the event of pair or stop `which` that cuts the step short; nothing is known of what is no ball. */
static tr_branch tr_branch_before(tr_sim *s, int which) {
  const double theta = s->pending.theta * (1.0 - FOLD_BEFORE);
  if (which >= s->k->nsliders || !tr_pair_of(s, which)->cone || s->pending.captured) return (tr_branch){.tilt = NAN};
  tr_dense_state(s, theta, TR_A(s, yout));
  return tr_branch_at(s, which, s->step.t0 + theta * s->step.size, TR_A(s, yout));
}

/* Ball i has had its event at (t, y), just evaluated. Where its friction has jumped to its other branch, the root that was followed has
 * folded away: that is told. */
static void tr_log_fold(tr_sim *s, int i, double t, const double *y, const tr_branch *was) {
  tr_contact after[TR_EVENT_CONTACTS];
  const double jump = fabs(tr_tilt_now(s, i) - was->tilt) - FOLD_TILT;
  if (jump > 0.0) {
    tr_hangs_on(s, jump);
    tr_log(s, t, TR_EV_FOLD, i, was->contacts, after, tr_slider_contacts(s, i, y, after) ? was->ncontacts : 0);
  }
}

/* Potential energy at y, J, where the audit asks for it. */
static double tr_stored(const tr_sim *s, const double *y) {
  double both[2] = {0.0, 0.0};
  if (s->k->energy && s->k->nlatches) s->k->energy(TR_A(s, x), y, TR_A(s, c) + s->k->c_energy, both);
  return both[1];
}

/* A stop is reached or left. A hook that lifts may fall again at once: on the next tooth, which has passed it, or on the last, where what it
 * was on was too much for it. What it was pressed in by goes with it. */
static void tr_switch_stop(tr_sim *s, int stop, double t, const double *y) {
  const int was = (int)*tr_stop_flag(s, stop), hook = tr_is_hook(s, stop);
  const double before = tr_stored(s, y);
  double depth[s->k->nstops + 1];
  *tr_stop_flag(s, stop) = TR_STOP_OPEN;
  tr_depths(s, y, depth);
  const int now = !was || (hook && depth[stop] > 0.0) ? (int)tr_flag_pressed(s, stop, depth) : TR_STOP_OPEN;
  if (was && now && tr_pressed(s, tr_pressed_by(s, stop))) {
    *tr_stop_flag(s, tr_pressed_by(s, stop)) = TR_STOP_OPEN;
    tr_log(s, t, TR_EV_STOP_OFF, tr_pressed_by(s, stop), 0, 0, 0);
    s->stats.events++;
  }
  *tr_stop_flag(s, stop) = now;
  if (hook && was) {
    const double lost = before - tr_stored(s, y);
    s->audit.begin -= lost, s->audit.energy0 -= lost;
  }
  if (was && now <= was) {
    tr_log(s, t, tr_stop_event(s, stop, 0), stop, 0, 0, 0);
    s->stats.events += now > 0;
  }
  if (now) tr_log(s, t, tr_stop_event(s, stop, 1), stop, 0, 0, 0);
}

/* Switch the mode of `which` at the state (t, y), which has just been evaluated. */
static void tr_switch(tr_sim *s, int which, double t, const double *y) {
  const tr_kernel *k = s->k;
  if (which < k->nsliders && tr_is_turn(s, which)) { /* friction goes on as it was: nothing to record */
    tr_freeze(s, which);
    return;
  }
  s->stats.events++;
  if (which >= k->nsliders) {
    tr_switch_stop(s, which - k->nsliders, t, y);
    return;
  }
  tr_mode *m = tr_mode_of(s, which);
  const int saturated = tr_flag(m) == TR_SATURATED;
  if (saturated && fabs(tr_sliding_of(s, which)->speed) > tr_sliding_of(s, which)->border && !tr_turns_back(s, which, t, y)) {
    tr_freeze(s, which); /* still sliding fast */
  } else if (saturated) {
    tr_enter_zone(s, which, t, y);
    m->flag = TR_PROPORTIONAL;
  } else {
    tr_leave_zone(s, which, t, y);
    m->flag = TR_SATURATED;
    tr_freeze(s, which);
    if (tr_pair_of(s, which)->cone) tr_leap(s, which, t, y);
  }
}
