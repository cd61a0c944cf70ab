/* Signals of tables and external inputs, and the times at which signals have breaks. */
#include "base/base.h"

static void tr_evaluate_input(const tr_input *in, double t, tr_signal *out) {
  const double tau = t - in->t0, w = in->bandwidth, *u = in->u;
  out->value = u[0] + tau * (u[1] + 0.5 * tau * u[2]), out->first = u[1] + tau * u[2], out->second = u[2], out->third = 0.0;
  if (in->followed == 0.0 || (in->gap == 0.0 && in->gap_rate == 0.0)) return;
  double c = in->gap_rate + w * in->gap, a = in->gap + c * tau, f = exp(-w * tau);
  out->value += a * f, out->first += (c - w * a) * f;
  out->second += w * (w * a - 2.0 * c) * f, out->third += w * w * (3.0 * c - w * a) * f;
}

static int tr_input_count(const tr_sim *s) {
  int n = 0;
  while (n < s->k->ntables && *tr_table_of(s, n) == TR_TABLE_INPUT) ++n;
  return n;
}

/* The knot times, which follow the head of a table. Behind them are the values, then second derivatives (spline) or slopes (Hermite
 * pieces). */
static const double *tr_knot_times(const tr_knots *table) { return (const double *)(table + 1); }

/* Signal before the first knot, or after the last knot (`last`). The signal is constant for a held table, otherwise a straight
 * line. */
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

/* Signal of a table at time t. The time ts selects the interval of the table. All evaluations of a step pass the same ts, so that
 * they use the same side of a knot. */
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

/* Write time t and `count` signals to x. x already contains the time inside the step, which selects intervals. `tables` begins with
 * the offset of each record. Runs, statics and derivatives call this function, so that all evaluate tables in the same way. */
static inline void tr_evaluate_signals(const double *tables, int count, double t, double *x) {
  tr_moment *now = (tr_moment *)x;
  tr_signal *out = (tr_signal *)(now + 1);
  now->t = t;
  for (int i = 0; i < count; ++i) {
    const double *table = tables + (int)tables[i];
    if (*table == TR_TABLE_INPUT) tr_evaluate_input((const tr_input *)table, t, out + i);
    else tr_evaluate_table((const tr_knots *)table, t, now->inside, out + i);
  }
}

void tr_signals(const double *tables, int count, double t, double *x) { tr_evaluate_signals(tables, count, t, x); }

double tr_next_break(const tr_sim *s) {
  return s->clock.next_break < s->clock.nbreaks ? TR_A(s, breaks)[s->clock.next_break] : INFINITY;
}

double tr_break_after(const tr_sim *s, double t) {
  for (int i = 0; i < s->clock.nbreaks; ++i)
    if (TR_A(s, breaks)[i] > t) return TR_A(s, breaks)[i];
  return INFINITY;
}

static inline void tr_set_time(tr_sim *s, double t) { tr_evaluate_signals(TR_A(s, tables), s->k->ntables, t, TR_A(s, x)); }
