/* Modes of sliding pairs and stops, and the events that change them.
 *
 * Within a step every mode is frozen, so that what is integrated is smooth; at its end (and at every stage) the quantities that
 * decide the modes are looked at, and when one has crossed its threshold the earliest crossing is located on the dense output. */
#include "modes.h"
#include "tr.h"

#define TOL_KINK 1e-9   /* of the kink speed: how far past it a step may end unnoticed */
#define TOL_STOP 1e-12  /* of the length scale (turns: rad) */
#define TOL_SPEED 1e-13   /* of the speed unit: how far past the end of sliding a step may end unnoticed */
#define TOL_RELEASE 1e-10 /* of the friction ratio */
#define TOL_CONE 1e-10    /* of s²/|ω|² */
#define NEAR_RELEASE 0.05 /* a stage this close to release makes the step worth a closer look */
#define NEAR_MISS 1e-10   /* of the speed unit: a turn of more than a right angle at a higher speed is no stop, but too large a step */

/* Rates of a slider from the maps in place. */
static const double *tr_slider_rates(const tr_sim *s, int i) { return map_rates(s->k, TR_A(s, maps)) + tr_pair_of(s, i)->rate0; }

/* Freeze the direction of sliding as it is now. */
static void tr_freeze(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *r = tr_slider_rates(s, i);
  tr_mode *m = tr_mode_of(s, i);
  if (pair->nrates == 1)
    m->direction[0] = r[0] < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < 3; ++j) m->direction[j] = j < pair->nrates ? r[j] : 0.0;
}

/* The same for a pair with a set-valued law, in units of its tolerance: the end of sliding, release (after tr_holding), and the border
 * between sliding and spinning. */
static double tr_set_violation(tr_sim *s, int i) {
  const tr_sliding *v = tr_sliding_of(s, i);
  int flag = tr_flag(tr_mode_of(s, i));
  if (flag == TR_STUCK) return (tr_ratio(s, i) - 1.0) / TOL_RELEASE;
  if (flag == TR_CONE) return v->border / TOL_CONE;
  double stop = -v->speed / (tr_speed_unit(s) * TOL_SPEED);
  return tr_pair_of(s, i)->cone ? fmax(stop, -v->border / TOL_CONE) : stop;
}

/* The same for a law with a kink at rest: the end of its direction. */
static double tr_turn_violation(const tr_sim *s, int i) { return -tr_sliding_of(s, i)->speed / (tr_speed_unit(s) * TOL_SPEED); }

/* How far pair or stop i is beyond its mode (> 1: an event), in units of its tolerance. Needs the state evaluated, and tr_holding when
 * something is held. */
static double tr_violation(tr_sim *s, int i, const double *depth) {
  const tr_kernel *k = s->k;
  if (i < k->nsliders) {
    int kind = tr_pair_of(s, i)->kind;
    if (kind == TR_KIND_SMOOTH) return -1.0;
    if (kind == TR_KIND_SET) return tr_set_violation(s, i);
    if (kind == TR_KIND_TURN) return tr_turn_violation(s, i);
    double speed = tr_sliding_of(s, i)->speed, kink = tr_sliding_of(s, i)->border;
    return (tr_slides(s, i) ? (kink - speed) / kink : (fabs(speed) - kink) / kink) / TOL_KINK;
  }
  int j = i - k->nsliders;
  return (tr_pressed(s, j) ? -depth[j] : depth[j]) / TOL_STOP;
}

static inline int tr_watched(const tr_sim *s) { return s->k->nsliders + s->k->nstops; }

static void tr_depths(tr_sim *s, const double *y, double *depth) {
  if (s->k->nstops) s->k->events(TR_A(s, x), y, TR_A(s, c) + s->k->c_events, depth);
}

/* Worst violation at a dense point, relative to tolerance; which one in *worst. NaN when the state cannot be evaluated. */
static double tr_probe(tr_sim *s, double theta, int *worst) {
  double *y = TR_A(s, yout), depth[s->k->nstops + 1], best = -INFINITY;
  tr_dense_eval(s, theta, y);
  if (s->k->nquat) tr_normalize(s, y);
  if (!tr_rhs(s, s->step.t0 + theta * s->step.size, y, TR_A(s, dy))) return NAN;
  tr_depths(s, y, depth);
  if (s->friction.still) tr_holding(s);
  for (int i = 0; i < tr_watched(s); ++i) {
    double v = tr_violation(s, i, depth);
    if (v > best) best = v, *worst = i;
  }
  return best - 1.0;
}

/* First θ in (a, b] where the probe turns positive, given g(b) > 0: a safeguarded secant (Illinois). */
static double tr_first_root(tr_sim *s, double a, double b, double ga, double gb, int *which) {
  int side = 0;
  for (int it = 0; it < 80 && b - a > 1e-14; ++it) {
    double m = (ga < 0.0 && it < 60) ? (a * gb - b * ga) / (gb - ga) : 0.5 * (a + b);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    int w = *which;
    double g = tr_probe(s, m, &w);
    if (!(g <= 0.0)) {
      b = m, gb = g, *which = w;
      if (side == 1) ga *= 0.5;
      side = 1;
      if (g < 1.0) break; /* within twice the tolerance: good enough, and on the far side */
    } else {
      a = m, ga = g;
      if (side == -1) gb *= 0.5;
      side = -1;
    }
  }
  return b;
}

/* What an event search in a step has found. */
enum { TR_NO_EVENT, TR_FOUND, TR_TOO_LARGE };

/* Whether what was found at θ is an event; a pair of several components that has merely turned fast asks for a smaller step. */
static int tr_event_at(tr_sim *s, double theta, int which) {
  if (which >= s->k->nsliders || !tr_is_set(s, which) || tr_pair_of(s, which)->nrates == 1 || !tr_slides(s, which)) return TR_FOUND;
  double *y = TR_A(s, yout);
  tr_dense_eval(s, theta, y);
  tr_set_time(s, s->step.t0 + theta * s->step.size);
  s->k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  const tr_mode *m = tr_mode_of(s, which);
  const double *r = tr_slider_rates(s, which), *arm = TR_A(s, arm) + tr_pair_of(s, which)->eta0;
  double along = 0.0;
  for (int j = 0; j < tr_pair_of(s, which)->nrates; ++j) along += r[j] * m->direction[j] * arm[j] * arm[j];
  if (!(along < 0.0 && tr_pair_speed(s, which) > NEAR_MISS * tr_speed_unit(s))) return TR_FOUND;
  s->friction.missed = which;
  return TR_TOO_LARGE;
}

/* Look for the first event in the step just made (end state evaluated in ynew, K[end]): what, and at which θ. */
static int tr_find_event(tr_sim *s, int *which, double *theta) {
  int n = tr_watched(s), hit = 0, suspect = 0;
  if (n == 0 || !s->set.locate) return TR_NO_EVENT;
  double depth[s->k->nstops + 1];
  tr_depths(s, TR_A(s, ynew), depth);
  if (s->friction.still) tr_holding(s);
  for (int i = 0; i < n; ++i) {
    if (tr_violation(s, i, depth) > 1.0) hit = 1, *which = i;
    if (i < s->k->nsliders && tr_is_set(s, i)) {
      suspect |= TR_A(s, smax)[i] > (tr_is_stuck(s, i) ? -NEAR_RELEASE / TOL_RELEASE : 1.0);
    } else if (i < s->k->nsliders && tr_is_turn(s, i)) {
      suspect |= TR_A(s, smax)[i] > 1.0;
    } else if (i < s->k->nsliders && tr_pair_of(s, i)->kind) {
      double kink = tr_sliding_of(s, i)->border;
      int sliding = tr_slides(s, i);
      if (sliding ? TR_A(s, smin)[i] < -TOL_KINK * kink : TR_A(s, smax)[i] > TOL_KINK * kink) suspect = 1;
    }
  }
  if (!hit && !suspect) return TR_NO_EVENT;
  if (!s->step.have_dense) {
    if (!tr_prepare_dense(s)) return TR_TOO_LARGE;
    s->step.have_dense = 1;
  }
  double a = 0.0, ga = -1.0, before = INFINITY;
  for (int q = 1; q <= 8; ++q) {
    double b = q / 8.0;
    if (q < 8 && !suspect) continue;
    int w = *which;
    double g = tr_probe(s, b, &w);
    if (g != g) return TR_TOO_LARGE;
    if (g > 0.0) {
      *which = w;
      *theta = tr_first_root(s, a, b, ga, g, which);
      return tr_event_at(s, *theta, *which);
    }
    if (suspect && s->friction.still && q > 1 && ga > before && ga > g && ga > -2.0 * NEAR_RELEASE / TOL_RELEASE) {
      double top = a + 0.5 / 8.0 * (before - g) / (before - 2.0 * ga + g), peak = tr_probe(s, top, &w); /* of the parabola */
      if (peak > 0.0) {
        *which = w;
        *theta = tr_first_root(s, top < a ? a - 0.125 : a, top, top < a ? before : ga, peak, which);
        return tr_event_at(s, *theta, *which);
      }
    }
    before = ga, a = b, ga = g;
  }
  return TR_NO_EVENT;
}

static double tr_angle_of(const tr_contact *p) { return atan2(p->vector[1], p->vector[0]); }

/* Record an event of pair or stop `index`, with n of its contacts. */
static void tr_log(tr_sim *s, double t, int kind, int index, const tr_contact *before, const tr_contact *after, int n) {
  if (s->events.count >= s->events.capacity) return;
  tr_event *e = (tr_event *)TR_A(s, ev) + s->events.count++;
  tr_last *last = &s->events.last;
  memset(e, 0, sizeof *e);
  memset(last, 0, sizeof *last);
  e->time = t, e->kind = kind, e->index = index, e->contacts = n;
  last->time = t, last->kind = kind, last->element = kind == TR_EV_STOP_ON || kind == TR_EV_STOP_OFF ? 0.0 : 1.0 + tr_pair_of(s, index)->element;
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

/* Contact forces of one pair at the state just evaluated (z, x in place); how many. */
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

static void tr_enter_zone(tr_sim *s, int i, double t, const double *y) {
  tr_zone *zone = tr_zone_of(s, i);
  zone->inside = 1, zone->entered = t, zone->reversal = NAN;
  memcpy(zone->direction, tr_mode_of(s, i)->direction, sizeof zone->direction);
  zone->ncontacts = tr_slider_contacts(s, i, y, zone->before);
}

/* +: sliding as when the zone was entered. */
static double tr_along(const tr_sim *s, int i) {
  const double *r = tr_slider_rates(s, i), *d = tr_zone_of(s, i)->direction;
  double a = 0.0;
  for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) a += r[j] * d[j];
  return a;
}

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

/* Switch the mode of `which` at the state (t, y), which has just been evaluated. */
static void tr_switch(tr_sim *s, int which, double t, const double *y) {
  const tr_kernel *k = s->k;
  if (which < k->nsliders && tr_is_turn(s, which)) { /* friction goes on as it was: nothing to record */
    tr_freeze(s, which);
    return;
  }
  s->stats.events++;
  if (which >= k->nsliders) {
    int stop = which - k->nsliders, pressed = !tr_pressed(s, stop);
    *tr_stop_flag(s, stop) = pressed ? TR_STOP_PRESSED : TR_STOP_OPEN;
    tr_log(s, t, pressed ? TR_EV_STOP_ON : TR_EV_STOP_OFF, stop, 0, 0, 0);
    return;
  }
  tr_mode *m = tr_mode_of(s, which);
  const int saturated = tr_flag(m) == TR_SATURATED;
  if (saturated && fabs(tr_sliding_of(s, which)->speed) > tr_sliding_of(s, which)->border) {
    tr_freeze(s, which); /* still sliding fast: only the direction has turned by more than a right angle since it was frozen */
  } else if (saturated) {
    tr_enter_zone(s, which, t, y);
    m->flag = TR_PROPORTIONAL;
  } else {
    tr_leave_zone(s, which, t, y);
    m->flag = TR_SATURATED;
    tr_freeze(s, which);
  }
}

/* Pairs with a set-valued law at the start: sliding, or at rest and then decided. Maps in place. */
static int tr_start_sets(tr_sim *s, double *y) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1];
  tr_set_arms(s);
  memset(TR_A(s, vmin), 0, sizeof(double) * k->nsliders);
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set(s, i)) tr_mode_of(s, i)->flag = tr_pair_speed(s, i) > REST_SPEED * tr_speed_unit(s) ? TR_SLIPS : TR_STUCK;
  int n = tr_at_rest(s, -1, rest);
  if (n == 0) return TR_OK;
  tr_bring_to_rest(s, y, rest, n);
  k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  if (tr_decide(s, rest, n, -1)) {
    tr_note_answers(s, s->clock.t, rest, n);
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
  for (int i = 0; i < k->nstops; ++i) *tr_stop_flag(s, i) = TR_STOP_OPEN;
  tr_depths(s, y, depth);
  for (int i = 0; i < k->nstops; ++i) *tr_stop_flag(s, i) = depth[i] > 0.0 ? TR_STOP_PRESSED : TR_STOP_OPEN;
  s->friction.still = s->friction.shares = s->step.aside = 0, s->friction.capture = s->friction.missed = s->friction.freed = -1;
  if (k->nsliders == 0) return TR_OK;
  for (int i = 0; i < k->nsliders; ++i) memset(tr_mode_of(s, i), 0, sizeof(tr_mode)), tr_zone_of(s, i)->inside = 0;
  k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
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
    if (tr_pair_of(s, i)->kind == TR_KIND_SET && now[i].border < 0.0) m->flag = TR_CONE;
  }
  return tr_rhs(s, s->clock.t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}
