/* Signals of tables and external inputs, and the breaks of signals. */
#include "base/base.h"

static void tr_evaluate_given(const tr_input *in, double t, tr_signal *out) {
  const double tau = t - in->t0, *u = in->u;
  out->value = u[0] + tau * (u[1] + 0.5 * tau * u[2]), out->first = u[1] + tau * u[2], out->second = u[2], out->third = 0.0;
}

/* Signal of an input at time t. Before the time `begin`, the signal has the value `start`; the time ts inside the step decides
 * which side of `begin` applies. A motion that follows the input approaches the input from t0 on, or from `begin` on if `begin` is
 * later. */
static void tr_evaluate_input(const tr_input *in, double t, double ts, tr_signal *out) {
  double from = in->t0, gap = in->gap, rate = in->gap_rate, w = in->bandwidth;
  if (ts < in->begin) {
    *out = (tr_signal){.value = in->start};
    return;
  }
  if (in->t0 < in->begin) {
    tr_evaluate_given(in, in->begin, out);
    from = in->begin, gap = in->start - out->value, rate = -out->first;
  }
  tr_evaluate_given(in, t, out);
  if (in->followed == 0.0 || (gap == 0.0 && rate == 0.0)) return;
  const double tau = t - from, c = rate + w * gap, a = gap + c * tau, f = exp(-w * tau);
  out->value += a * f, out->first += (c - w * a) * f;
  out->second += w * (w * a - 2.0 * c) * f, out->third += w * w * (3.0 * c - w * a) * f;
}

static int tr_input_count(const tr_sim *s) {
  int n = 0;
  while (n < s->k->ntables && *tr_table_of(s, n) == TR_TABLE_INPUT) ++n;
  return n;
}

static int tr_has_input_turn(const tr_sim *s, double from, double to) {
  for (int i = tr_input_count(s) - 1; i >= 0; --i) {
    const tr_input *in = (const tr_input *)tr_table_of(s, i);
    const double turn = in->t0 - in->u[1] / in->u[2];
    if (in->u[2] != 0.0 && turn > from && turn < to) return 1;
  }
  return 0;
}

/* Knot times of a table. In memory, the order is: head, knot times, values, then second derivatives (spline) or slopes (Hermite
 * pieces). */
static const double *tr_knot_times(const tr_knots *table) { return (const double *)(table + 1); }

/* Signal before the first knot, or (`last`) after the last knot: constant for a held table, otherwise a straight line. */
static void tr_extrapolate_table(const tr_knots *table, int last, double t, tr_signal *out) {
  int kind = (int)table->kind, n = (int)table->n, e = last ? n - 1 : 0, a = last ? n - 2 : 0;
  const double *tt = tr_knot_times(table), *v = tt + n, *m = v + n;
  double h = tt[a + 1] - tt[a], slope = (v[a + 1] - v[a]) / h;
  if (kind == TR_TABLE_SPLINE) slope += last ? h / 6.0 * (m[a] + 2.0 * m[a + 1]) : -h / 6.0 * (2.0 * m[a] + m[a + 1]);
  if (kind == TR_TABLE_HERMITE) slope = m[e];
  if (table->held != 0.0) slope = 0.0;
  out->value = v[e] + slope * (t - tt[e]), out->first = slope, out->second = out->third = 0.0;
}

/* Evaluate a cubic at the time u after the start of an interval of duration h. v and m: values and slopes at both ends. */
static void tr_evaluate_hermite(const double *v, const double *m, double h, double u, tr_signal *out) {
  double rise = (v[1] - v[0]) / h, bend = (3.0 * rise - 2.0 * m[0] - m[1]) / h, twist = (m[0] + m[1] - 2.0 * rise) / (h * h);
  out->value = v[0] + u * (m[0] + u * (bend + u * twist)), out->first = m[0] + u * (2.0 * bend + 3.0 * u * twist);
  out->second = 2.0 * bend + 6.0 * u * twist, out->third = 6.0 * twist;
}

/* Signal of a table at time t. The time ts selects the interval of the table. All evaluations of a step pass the same ts, so all
 * use the same side of a knot. */
static void tr_evaluate_table(const tr_knots *table, double t, double ts, tr_signal *out) {
  int kind = (int)table->kind, n = (int)table->n, lo = 0, hi = n - 1;
  const double *tt = tr_knot_times(table), *v = tt + n, *m = v + n;
  if (ts <= tt[0] || ts >= tt[n - 1]) {
    tr_extrapolate_table(table, ts > tt[0], t, out);
    return;
  }
  while (hi - lo > 1) {
    int c = (hi + lo) / 2;
    if (tt[c] <= ts) lo = c; else hi = c;
  }
  double h = tt[hi] - tt[lo], A = (tt[hi] - t) / h, B = (t - tt[lo]) / h;
  if (kind == TR_TABLE_HERMITE) {
    tr_evaluate_hermite(v + lo, m + lo, h, t - tt[lo], out);
    return;
  }
  out->value = A * v[lo] + B * v[hi];
  out->first = (v[hi] - v[lo]) / h;
  out->second = out->third = 0.0;
  if (kind == TR_TABLE_SPLINE) {
    out->value += ((A * A * A - A) * m[lo] + (B * B * B - B) * m[hi]) * h * h / 6.0;
    out->first += h / 6.0 * ((3.0 * B * B - 1.0) * m[hi] - (3.0 * A * A - 1.0) * m[lo]);
    out->second = A * m[lo] + B * m[hi];
    out->third = (m[hi] - m[lo]) / h;
  }
}

/* Write time t and `count` signals to x. x must already contain the time inside the step, which selects the intervals of tables.
 * `tables` begins with the offset of each record. Runs, statics and derivatives all call this function. */
static inline void tr_evaluate_signals(const double *tables, int count, double t, double *x) {
  tr_moment *now = (tr_moment *)x;
  tr_signal *out = (tr_signal *)(now + 1);
  now->t = t;
  for (int i = 0; i < count; ++i) {
    const double *table = tables + (int)tables[i];
    if (*table == TR_TABLE_INPUT) tr_evaluate_input((const tr_input *)table, t, now->inside, out + i);
    else tr_evaluate_table((const tr_knots *)table, t, now->inside, out + i);
  }
}

void tr_signals(const double *tables, int count, double t, double *x) { tr_evaluate_signals(tables, count, t, x); }

double tr_next_break(const tr_sim *s) { return s->clock.next_break; }

/* Find the last break up to t and the first break after t. A periodic break that differs from t only by round-off counts as a break
 * up to t. */
static void tr_find_breaks(const tr_sim *s, double t, double *last, double *next) {
  const tr_break *breaks = (const tr_break *)TR_A(s, breaks);
  int once = s->clock.nbreaks, lo = 0;
  *last = -INFINITY, *next = INFINITY;
  for (; once > 0 && breaks[once - 1].period > 0.0; --once) {
    const tr_break *b = breaks + once - 1;
    const double passed = floor((t + tr_time_tolerance(t) - b->time) / b->period);
    if (passed >= 0.0) *last = fmax(*last, b->time + passed * b->period);
    *next = fmin(*next, b->time + fmax(passed + 1.0, 0.0) * b->period);
  }
  for (int hi = once; lo < hi;) {
    const int c = (lo + hi) / 2;
    if (breaks[c].time > t) hi = c; else lo = c + 1;
  }
  if (lo > 0) *last = fmax(*last, breaks[lo - 1].time);
  if (lo < once) *next = fmin(*next, breaks[lo].time);
}

double tr_break_after(const tr_sim *s, double t) {
  double last, next;
  tr_find_breaks(s, t, &last, &next);
  return next;
}

static void tr_begin_breaks(tr_sim *s, double t) { tr_find_breaks(s, t, &s->clock.last_break, &s->clock.next_break); }

static int tr_pass_breaks(tr_sim *s, double t) {
  const int passed = s->clock.next_break <= t;
  while (s->clock.next_break <= t) s->clock.last_break = s->clock.next_break, s->clock.next_break = tr_break_after(s, s->clock.last_break);
  return passed;
}

static inline void tr_set_time(tr_sim *s, double t) { tr_evaluate_signals(TR_A(s, tables), s->k->ntables, t, TR_A(s, x)); }
