/* Detection of events of end stops and latches: event kinds, flags, and whether a stop may have two events inside a step. */
#include "events/events.h"

#define SHORTLY 1e-3      /* relative to the step: time difference for the derivative of a depth */
#define TOP_POINTS 16     /* number of intervals into which the step is divided to find a cubic's maximum */
#define TOP_DIP 0.1       /* relative to the variation of a depth over the step: possible excess of the depth over the cubic */

/* Event kind of an end stop or latch hook: engaged if `pressed`, otherwise released. */
static int tr_stop_event_kind(const tr_sim *s, int stop, int pressed) {
  if (tr_is_hook(s, stop)) return pressed ? TR_EV_LATCH : TR_EV_UNLATCH;
  return pressed ? TR_EV_END_STOP_ENGAGED : TR_EV_END_STOP_RELEASED;
}

/* Flag of a stop that engages; for a hook, the number of the tooth on which it falls. depth: depths while this stop is open. */
static double tr_pressed_flag(const tr_sim *s, int stop, const double *depth) {
  return tr_is_hook(s, stop) ? -depth[tr_stop_behind_hook(s, stop)] : TR_STOP_PRESSED;
}

/* Largest value of the cubic with the values g and slopes m at both ends of the step; −∞ if no maximum lies between them. */
static double tr_top_inside(double g0, double g1, double m0, double m1) {
  double top = fmax(g0, g1);
  if (!(m0 > 0.0 && m1 < 0.0)) return -INFINITY;
  for (int q = 1; q < TOP_POINTS; ++q) {
    const double x = q / (double)TOP_POINTS;
    top = fmax(top, g0 + x * (m0 + x * (3.0 * (g1 - g0) - 2.0 * m0 - m1 + x * (2.0 * (g0 - g1) + m0 + m1))));
  }
  return top;
}

static int tr_may_pass_zero(double g0, double m0, double g1, double m1) {
  const double top = tr_top_inside(g0, g1, m0, m1);
  return top > -TOP_DIP * (top - fmin(g0, g1));
}

/* A stop is marked if the cubic through its depths and rates at both ends has a maximum near the threshold. Rates come from K and
 * K[end]; for impulse steps, from the dense output. For a hook that is down, the event function is constant far from the next
 * tooth. The depth behind the hook is smooth; its fall shows how far the event function can rise. */
static int tr_mark_stops_with_events_inside(tr_sim *s, char *inside) {
  int any = 0;
  const int n = tr_state_width(s), ns = s->k->nstops, by_dense = tr_method_of(s)->kind == TR_IMPULSES;
  const double h = s->step.size, *ends[2] = {TR_A(s, y), TR_A(s, ynew)}, *rates[2] = {TR_A(s, K), TR_A(s, K) + tr_method_of(s)->end * n};
  double depth[2][ns + 1], near[2][ns + 1], *y = TR_A(s, yout);
  for (int e = 0; e < 2; ++e) {
    if (by_dense) tr_evaluate_dense(s, e ? 1.0 - SHORTLY : SHORTLY, y);
    else
      for (int i = 0; i < n; ++i) y[i] = ends[e][i] + (e ? -SHORTLY : SHORTLY) * h * rates[e][i];
    tr_set_time(s, s->step.t0 + (e ? h : 0.0)), tr_stop_depths(s, ends[e], depth[e]);
    tr_set_time(s, s->step.t0 + (e ? (1.0 - SHORTLY) * h : SHORTLY * h)), tr_stop_depths(s, y, near[e]);
  }
  tr_set_time(s, s->step.t0 + h);
  for (int i = 0; i < ns; ++i) {
    inside[i] = 0;
    const int contact = tr_contact_of_stop(s, i);
    /* tr_mark_pulls_inside marks these contacts */
    if (contact >= 0 && (tr_is_pressed(s, i) || tr_is_contact_away(s, contact) || tr_is_contact_unloaded(s, contact))) continue;
    const double side = tr_is_pressed(s, i) ? -1.0 : 1.0, g0 = side * depth[0][i], g1 = side * depth[1][i];
    const double m0 = (side * near[0][i] - g0) / SHORTLY, m1 = (g1 - side * near[1][i]) / SHORTLY;
    double top = tr_top_inside(g0, g1, m0, m1);
    if (tr_is_hook(s, i) && tr_is_pressed(s, i)) {
      const int b = tr_stop_behind_hook(s, i);
      const double d0 = depth[0][b], d1 = depth[1][b];
      top = fmax(top, fmax(g0, g1) + fmin(d0, d1) + tr_top_inside(-d0, -d1, (d0 - near[0][b]) / SHORTLY, (near[1][b] - d1) / SHORTLY));
    }
    any |= inside[i] = top > -TOP_DIP * (top - fmin(g0, g1));
  }
  return any;
}
