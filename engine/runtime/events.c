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
static const double *tr_slider_rates(const tr_sim *s, int i) { return map_rates(s->k, TR_A(s, maps)) + tr_slider(s, i)[3]; }

/* Freeze the direction of sliding as it is now. */
static void tr_freeze(tr_sim *s, int i) {
  const int *sl = tr_slider(s, i);
  const double *r = tr_slider_rates(s, i);
  double *m = tr_mode(s, i);
  if (sl[4] == 1)
    m[1] = r[0] < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < 3; ++j) m[1 + j] = j < sl[4] ? r[j] : 0.0;
}

/* The same for a pair with a set-valued law, in units of its tolerance: the end of sliding, release (after tr_holding), and the border
 * between sliding and spinning. */
static double tr_set_violation(tr_sim *s, int i) {
  const double *v = TR_A(s, speed) + 2 * i, flag = tr_mode(s, i)[0];
  if (flag < 0.5) return (tr_ratio(s, i) - 1.0) / TOL_RELEASE;
  if (flag > 1.5) return v[1] / TOL_CONE;
  double stop = -v[0] / (tr_speed_unit(s) * TOL_SPEED);
  return tr_slider(s, i)[9] ? fmax(stop, -v[1] / TOL_CONE) : stop;
}

/* The same for a law with a kink at rest: the end of its direction. */
static double tr_turn_violation(const tr_sim *s, int i) { return -TR_A(s, speed)[2 * i] / (tr_speed_unit(s) * TOL_SPEED); }

/* How far pair or stop i is beyond its mode (> 1: an event), in units of its tolerance. Needs the state evaluated, and tr_holding when
 * something is held. */
static double tr_violation(tr_sim *s, int i, const double *depth) {
  const tr_kernel *k = s->k;
  if (i < k->nsliders) {
    int kind = tr_slider(s, i)[5];
    if (kind == TR_KIND_SMOOTH) return -1.0;
    if (kind == TR_KIND_SET) return tr_set_violation(s, i);
    if (kind == TR_KIND_TURN) return tr_turn_violation(s, i);
    double speed = TR_A(s, speed)[2 * i], kink = TR_A(s, speed)[2 * i + 1];
    return (tr_mode(s, i)[0] > 0.5 ? (kink - speed) / kink : (fabs(speed) - kink) / kink) / TOL_KINK;
  }
  int j = i - k->nsliders;
  return (*tr_stop_flag(s, j) > 0.5 ? -depth[j] : depth[j]) / TOL_STOP;
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
  if (!tr_rhs(s, s->step_t0 + theta * s->step_h, y, TR_A(s, dy))) return NAN;
  tr_depths(s, y, depth);
  if (s->still) tr_holding(s);
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

/* The event found, or 3 (too large a step) when a pair of several components has merely turned fast. */
static double tr_event_at(tr_sim *s, double theta, int which) {
  if (which >= s->k->nsliders || !tr_is_set(s, which) || tr_slider(s, which)[4] == 1 || tr_mode(s, which)[0] < 0.5) return theta;
  double *y = TR_A(s, yout);
  tr_dense_eval(s, theta, y);
  tr_set_time(s, s->step_t0 + theta * s->step_h);
  s->k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  const double *r = tr_slider_rates(s, which), *m = tr_mode(s, which), *arm = TR_A(s, arm) + tr_slider(s, which)[1];
  double along = 0.0;
  for (int j = 0; j < tr_slider(s, which)[4]; ++j) along += r[j] * m[1 + j] * arm[j] * arm[j];
  if (!(along < 0.0 && tr_pair_speed(s, which) > NEAR_MISS * tr_speed_unit(s))) return theta;
  s->missed = which;
  return 3.0;
}

/* Look for an event in the step just made (end state evaluated in ynew, K[end]). Returns θ of the first one, or 2. */
static double tr_find_event(tr_sim *s, int *which) {
  int n = tr_watched(s), hit = 0, suspect = 0;
  if (n == 0 || !s->locate) return 2.0;
  double depth[s->k->nstops + 1];
  tr_depths(s, TR_A(s, ynew), depth);
  if (s->still) tr_holding(s);
  for (int i = 0; i < n; ++i) {
    if (tr_violation(s, i, depth) > 1.0) hit = 1, *which = i;
    if (i < s->k->nsliders && tr_is_set(s, i)) {
      suspect |= TR_A(s, smax)[i] > (tr_is_stuck(s, i) ? -NEAR_RELEASE / TOL_RELEASE : 1.0);
    } else if (i < s->k->nsliders && tr_is_turn(s, i)) {
      suspect |= TR_A(s, smax)[i] > 1.0;
    } else if (i < s->k->nsliders && tr_slider(s, i)[5]) {
      double kink = TR_A(s, speed)[2 * i + 1];
      int sliding = tr_mode(s, i)[0] > 0.5;
      if (sliding ? TR_A(s, smin)[i] < -TOL_KINK * kink : TR_A(s, smax)[i] > TOL_KINK * kink) suspect = 1;
    }
  }
  if (!hit && !suspect) return 2.0;
  if (!s->have_dense) {
    if (!tr_prepare_dense(s)) return 3.0;
    s->have_dense = 1;
  }
  double a = 0.0, ga = -1.0, before = INFINITY;
  for (int q = 1; q <= 8; ++q) {
    double b = q / 8.0;
    if (q < 8 && !suspect) continue;
    int w = *which;
    double g = tr_probe(s, b, &w);
    if (g != g) return 3.0;
    if (g > 0.0) {
      *which = w;
      return tr_event_at(s, tr_first_root(s, a, b, ga, g, which), *which);
    }
    if (suspect && s->still && q > 1 && ga > before && ga > g && ga > -2.0 * NEAR_RELEASE / TOL_RELEASE) {
      double top = a + 0.5 / 8.0 * (before - g) / (before - 2.0 * ga + g), peak = tr_probe(s, top, &w); /* of the parabola */
      if (peak > 0.0) {
        *which = w;
        return tr_event_at(s, tr_first_root(s, top < a ? a - 0.125 : a, top, top < a ? before : ga, peak, which), *which);
      }
    }
    before = ga, a = b, ga = g;
  }
  return 2.0;
}

/* Event record: t, kind, slider or stop, contacts, then (before, after, turn of the normal) per contact. */
static void tr_log(tr_sim *s, double t, int kind, int index, const double *before, const double *after, int n) {
  if (s->nev >= s->ev_capacity) return;
  double *e = TR_A(s, ev) + TR_EVENT * s->nev++, *last = s->last;
  memset(e, 0, sizeof(double) * TR_EVENT);
  memset(last, 0, sizeof s->last);
  e[0] = t, e[1] = kind, e[2] = index, e[3] = n;
  last[0] = t, last[1] = kind, last[2] = kind == TR_EV_STOP_ON || kind == TR_EV_STOP_OFF ? 0.0 : 1.0 + tr_slider(s, index)[0];
  for (int i = 0; i < n && i < 6; ++i) {
    const double *p = before + 4 * i, *q = after + 4 * i;
    double a = sqrt(p[1] * p[1] + p[2] * p[2] + p[3] * p[3]), b = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    double dot = a > 0.0 && b > 0.0 ? (p[1] * q[1] + p[2] * q[2] + p[3] * q[3]) / (a * b) : 1.0;
    e[4 + 3 * i] = atan2(p[2], p[1]);
    e[5 + 3 * i] = atan2(q[2], q[1]);
    e[6 + 3 * i] = acos(fmax(-1.0, fmin(1.0, dot)));
    if (last[3] == 0.0 || e[6 + 3 * i] > last[6]) last[3] = 1.0 + i, last[4] = e[4 + 3 * i], last[5] = e[5 + 3 * i], last[6] = e[6 + 3 * i];
  }
}

/* Contact forces of one slider at the state just evaluated (z, x in place): 4 numbers per contact. */
static int tr_slider_contacts(tr_sim *s, int i, const double *y, double *out) {
  const int *sl = tr_slider(s, i);
  int n = sl[7];
  if (!s->o || !s->o->contacts || n == 0) return 0;
  double all[4 * s->o->ncontacts + 1], zf[s->k->rows + s->k->neta + 1];
  tr_full_multipliers(s, y, zf, 0);
  s->o->contacts(TR_A(s, x), y, TR_A(s, co), zf, TR_A(s, dy) + s->k->nq, all);
  memcpy(out, all + 4 * sl[6], sizeof(double) * 4 * n);
  return n;
}

/* Per slider memory of its way through the proportional zone: [in zone, t entered, d1..d3, t of reversal, contacts, data…]. */
#define TR_ZONE 32
static inline double *tr_zone(const tr_sim *s, int i) { return TR_A(s, lin0) + TR_ZONE * i; }

static void tr_enter_zone(tr_sim *s, int i, double t, const double *y) {
  double *z = tr_zone(s, i), *m = tr_mode(s, i);
  z[0] = 1.0, z[1] = t;
  for (int j = 0; j < 3; ++j) z[2 + j] = m[1 + j];
  z[5] = NAN;
  z[6] = tr_slider_contacts(s, i, y, z + 7);
}

/* +: sliding as when the zone was entered. */
static double tr_along(const tr_sim *s, int i) {
  const double *r = tr_slider_rates(s, i), *z = tr_zone(s, i);
  double a = 0.0;
  for (int j = 0; j < tr_slider(s, i)[4]; ++j) a += r[j] * z[2 + j];
  return a;
}

static void tr_leave_zone(tr_sim *s, int i, double t, const double *y) {
  double *z = tr_zone(s, i), after[TR_ZONE];
  if (z[0] > 0.5 && tr_along(s, i) < 0.0) {
    int n = tr_slider_contacts(s, i, y, after);
    tr_log(s, z[5] == z[5] ? z[5] : 0.5 * (z[1] + t), TR_EV_REVERSAL, i, z + 7, after, n < (int)z[6] ? n : (int)z[6]);
  }
  z[0] = 0.0;
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
    double *flag = tr_stop_flag(s, which - k->nsliders);
    *flag = *flag > 0.5 ? 0.0 : 1.0;
    tr_log(s, t, *flag > 0.5 ? TR_EV_STOP_ON : TR_EV_STOP_OFF, which - k->nsliders, 0, 0, 0);
    return;
  }
  double *m = tr_mode(s, which);
  if (m[0] > 0.5 && fabs(TR_A(s, speed)[2 * which]) > TR_A(s, speed)[2 * which + 1]) {
    tr_freeze(s, which); /* still sliding fast: only the direction has turned by more than a right angle since it was frozen */
  } else if (m[0] > 0.5) {
    tr_enter_zone(s, which, t, y);
    m[0] = 0.0;
  } else {
    tr_leave_zone(s, which, t, y);
    m[0] = 1.0;
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
    if (tr_is_set(s, i)) tr_mode(s, i)[0] = tr_pair_speed(s, i) > REST_SPEED * tr_speed_unit(s) ? TR_SLIPS : TR_STUCK;
  int n = tr_at_rest(s, -1, rest);
  if (n == 0) return TR_OK;
  tr_bring_to_rest(s, y, rest, n);
  k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  if (tr_decide(s, rest, n, -1)) {
    tr_note_answers(s, s->t, rest, n);
    return TR_OK;
  }
  s->event_slider = rest[0];
  return TR_FAIL_MODES;
}

/* Modes at the start: saturated where the sliding could be faster than the kink (a ball's speed depends on its load; without load
 * it is largest), then proportional where with the loads found it is not. */
static int tr_start_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  double depth[k->nstops + 1], *y = TR_A(s, y), none[k->nn + 1];
  memset(none, 0, sizeof none);
  tr_set_time(s, s->t);
  for (int i = 0; i < k->nstops; ++i) *tr_stop_flag(s, i) = 0.0;
  tr_depths(s, y, depth);
  for (int i = 0; i < k->nstops; ++i) *tr_stop_flag(s, i) = depth[i] > 0.0 ? 1.0 : 0.0;
  s->still = s->shares = s->aside = 0, s->capture = s->missed = s->freed = -1;
  if (k->nsliders == 0) return TR_OK;
  for (int i = 0; i < k->nsliders; ++i) memset(tr_mode(s, i), 0, sizeof(double) * TR_MODE), tr_zone(s, i)[0] = 0.0;
  k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  for (int i = 0; i < k->nsliders; ++i) tr_freeze(s, i);
  const double *rates = map_rates(k, TR_A(s, maps)), *speed = TR_A(s, speed);
  k->laws(none, rates, TR_A(s, x), TR_A(s, c) + k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, speed));
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_slider(s, i)[5] == TR_KIND_KINK && fabs(speed[2 * i]) > speed[2 * i + 1]) tr_mode(s, i)[0] = 1.0;
  if (k->sets) {
    int code = tr_start_sets(s, y);
    if (code != TR_OK) return code;
  }
  if (!tr_rhs(s, s->t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  for (int i = 0; i < k->nsliders; ++i) {
    double *m = tr_mode(s, i);
    if (m[0] > 0.5 && tr_slider(s, i)[5] == TR_KIND_KINK && fabs(speed[2 * i]) < speed[2 * i + 1]) m[0] = 0.0;
    if (m[0] > 0.5 && tr_slider(s, i)[5] == TR_KIND_SET && speed[2 * i + 1] < 0.0) m[0] = TR_CONE;
  }
  return tr_rhs(s, s->t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}
