/* ẏ(t, y): signals, stage 1, multipliers, stage 2. */
#include "tr.h"

/* An external input from its communication point on: D = [2, followed, t0, u, u̇, ü, e, ė, ω]. A motion that follows it starts where
 * it was (off by e, ė) and closes the gap critically damped: q = u + (e + (ė + ω e) τ) exp(−ω τ). out: value, three derivatives. */
static void tr_input_signal(const double *D, double t, double *out) {
  double tau = t - D[2], w = D[8];
  out[0] = D[3] + tau * (D[4] + 0.5 * tau * D[5]), out[1] = D[4] + tau * D[5], out[2] = D[5], out[3] = 0.0;
  if (D[1] == 0.0 || (D[6] == 0.0 && D[7] == 0.0)) return;
  double c = D[7] + w * D[6], a = D[6] + c * tau, f = exp(-w * tau);
  out[0] += a * f, out[1] += (c - w * a) * f, out[2] += w * (w * a - 2.0 * c) * f, out[3] += w * w * (3.0 * c - w * a) * f;
}

/* External inputs: the first tables. */
static int tr_inputs(const tr_sim *s) {
  const double *T = TR_A(s, tables);
  int n = 0;
  while (n < s->k->ntables && T[(int)T[n]] == 2.0) ++n;
  return n;
}

/* Time t and the signals at t into x (nx). Tables: [offset of each | data: kind, n, t[n], v[n], m[n] (second derivatives)]. The
 * interval is chosen by ts = x[1]. Hosts that keep an x of their own (sensitivities) call it too, so that nobody evaluates a table
 * in another way. */
void tr_signals(const tr_sim *s, double t, double *x) {
  const tr_kernel *k = s->k;
  const double *T = TR_A(s, tables);
  double ts = x[1], *out = x + 2;
  x[0] = t;
  for (int i = 0; i < k->ntables; ++i, out += TR_TABLE) {
    const double *D = T + (int)T[i];
    if (D[0] == 2.0) {
      tr_input_signal(D, t, out);
      continue;
    }
    int spline = (int)D[0], n = (int)D[1], lo = 0, hi = n - 1;
    const double *tt = D + 2, *v = tt + n, *m = v + n;
    double last = tt[n - 1], first = tt[0];
    if (ts <= first || ts >= last) {
      int e = ts <= first ? 0 : n - 1, a = ts <= first ? 0 : n - 2;
      double h = tt[a + 1] - tt[a], slope = (v[a + 1] - v[a]) / h;
      if (spline) slope += ts <= first ? -h / 6.0 * (2.0 * m[a] + m[a + 1]) : h / 6.0 * (m[a] + 2.0 * m[a + 1]);
      out[0] = v[e] + (spline ? slope * (t - tt[e]) : 0.0);
      out[1] = spline ? slope : 0.0;
      out[2] = out[3] = 0.0;
      continue;
    }
    while (hi - lo > 1) {
      int c = (hi + lo) / 2;
      if (tt[c] <= ts) lo = c; else hi = c;
    }
    out[3] = 0.0;
    double h = tt[hi] - tt[lo], A = (tt[hi] - t) / h, B = (t - tt[lo]) / h;
    out[0] = A * v[lo] + B * v[hi];
    out[1] = (v[hi] - v[lo]) / h;
    out[2] = 0.0;
    if (spline) {
      out[0] += ((A * A * A - A) * m[lo] + (B * B * B - B) * m[hi]) * h * h / 6.0;
      out[1] += h / 6.0 * ((3.0 * B * B - 1.0) * m[hi] - (3.0 * A * A - 1.0) * m[lo]);
      out[2] = A * m[lo] + B * m[hi];
      out[3] = (m[hi] - m[lo]) / h;
    }
  }
}

static void tr_set_time(tr_sim *s, double t) { tr_signals(s, t, TR_A(s, x)); }

static double tr_set_violation(tr_sim *s, int i);
static double tr_turn_violation(const tr_sim *s, int i);
static void tr_holding(tr_sim *s);
static void tr_set_time(tr_sim *s, double t);
static void tr_keep_still(const tr_sim *s, double *v);

/* Record the extremes of (signed sliding speed − kink speed) of every pair over the stages of a step; of a pair with a set-valued law
 * how far it has come from its mode. */
static void tr_watch(tr_sim *s) {
  const double *v = TR_A(s, speed);
  double *lo = TR_A(s, smin), *hi = TR_A(s, smax);
  if (s->still) tr_holding(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (tr_is_set(s, i)) {
      hi[i] = fmax(hi[i], tr_set_violation(s, i));
      continue;
    }
    if (tr_is_turn(s, i)) {
      hi[i] = fmax(hi[i], tr_turn_violation(s, i));
      continue;
    }
    double g = v[2 * i] - v[2 * i + 1], b = -v[2 * i] - v[2 * i + 1];
    if (g < lo[i]) lo[i] = g;
    if (fmax(g, b) > hi[i]) hi[i] = fmax(g, b);
  }
}

static int tr_finite(int n, const double *a) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += 0.0 * a[i];
  return sum == 0.0;
}

/* 1 when the derivative could be computed, 0 when the multipliers could not (why: `trouble`). */
static int tr_rhs(tr_sim *s, double t, const double *y, double *dy) {
  const tr_kernel *k = s->k;
  const double *x = TR_A(s, x), *c = TR_A(s, c);
  double *w = TR_A(s, w), *maps = TR_A(s, maps);
  s->stats.rhs++;
  tr_set_time(s, t);
  k->stage1(x, y, c, w, maps, dy);
  if (k->active + k->neta == 0) return 1;
  if (!tr_multipliers(s)) {
    s->trouble = tr_finite(k->nmaps, maps) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
    return 0;
  }
  if (s->watch) tr_watch(s);
  k->stage2(x, y, c, w, TR_A(s, z), dy);
  if (s->still) tr_keep_still(s, dy);
  return 1;
}
