/* The right-hand side ẏ(t, y): signals at t, stage 1 of the kernel (the affine maps of the multipliers), the multipliers, stage 2. */
#include "modes.h"

/* An external input from its communication point on. A motion that follows it starts where it was (off by a gap e, with the rate ė) and
 * closes the gap critically damped: q = u + (e + (ė + ω e) τ) exp(−ω τ). */
static void tr_input_signal(const tr_input *in, double t, tr_signal *out) {
  const double tau = t - in->t0, w = in->bandwidth, *u = in->u;
  out->value = u[0] + tau * (u[1] + 0.5 * tau * u[2]), out->first = u[1] + tau * u[2], out->second = u[2], out->third = 0.0;
  if (in->followed == 0.0 || (in->gap == 0.0 && in->gap_rate == 0.0)) return;
  double c = in->gap_rate + w * in->gap, a = in->gap + c * tau, f = exp(-w * tau);
  out->value += a * f, out->first += (c - w * a) * f;
  out->second += w * (w * a - 2.0 * c) * f, out->third += w * w * (3.0 * c - w * a) * f;
}

/* How many external inputs there are: they are the first tables. */
static int tr_inputs(const tr_sim *s) {
  int n = 0;
  while (n < s->k->ntables && *tr_table_of(s, n) == TR_TABLE_INPUT) ++n;
  return n;
}

/* The records behind a table's head: times, values, and second derivatives (spline) or slopes (Hermite pieces). */
static const double *tr_times(const tr_knots *table) { return (const double *)(table + 1); }

/* Before its first and after its last knot: a held table keeps its value, others go straight on. */
static void tr_table_beyond(const tr_knots *table, int last, double t, tr_signal *out) {
  int kind = (int)table->kind, n = (int)table->n, e = last ? n - 1 : 0, a = last ? n - 2 : 0;
  const double *tt = tr_times(table), *v = tt + n, *m = v + n;
  double h = tt[a + 1] - tt[a], slope = (v[a + 1] - v[a]) / h;
  if (kind == TR_TABLE_SPLINE) slope += last ? h / 6.0 * (m[a] + 2.0 * m[a + 1]) : -h / 6.0 * (2.0 * m[a] + m[a + 1]);
  if (kind == TR_TABLE_HERMITE) slope = m[e];
  if (table->held != 0.0) slope = 0.0;
  out->value = v[e] + slope * (t - tt[e]), out->first = slope, out->second = out->third = 0.0;
}

/* The cubic with values v and slopes m at both ends of an interval h, at u after its beginning. */
static void tr_table_hermite(const double *v, const double *m, double h, double u, tr_signal *out) {
  double rise = (v[1] - v[0]) / h, bend = (3.0 * rise - 2.0 * m[0] - m[1]) / h, twist = (m[0] + m[1] - 2.0 * rise) / (h * h);
  out->value = v[0] + u * (m[0] + u * (bend + u * twist)), out->first = m[0] + u * (2.0 * bend + 3.0 * u * twist);
  out->second = 2.0 * bend + 6.0 * u * twist, out->third = 6.0 * twist;
}

/* A table's signal at t; the interval is chosen by ts, so that no step sees both sides of a knot. */
static void tr_table_signal(const tr_knots *table, double t, double ts, tr_signal *out) {
  int kind = (int)table->kind, n = (int)table->n, lo = 0, hi = n - 1;
  const double *tt = tr_times(table), *v = tt + n, *m = v + n;
  if (ts <= tt[0] || ts >= tt[n - 1]) {
    tr_table_beyond(table, ts > tt[0], t, out);
    return;
  }
  while (hi - lo > 1) {
    int c = (hi + lo) / 2;
    if (tt[c] <= ts) lo = c; else hi = c;
  }
  double h = tt[hi] - tt[lo], A = (tt[hi] - t) / h, B = (t - tt[lo]) / h;
  if (kind == TR_TABLE_HERMITE) {
    tr_table_hermite(v + lo, m + lo, h, t - tt[lo], out);
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

/* Time t and the first signals of x (nx), whose moment says where inside a step it is. tables: the offset of each record, then the
 * records. Whoever needs the value of a table asks here (runs, statics, derivatives along a run), so that nobody evaluates one in
 * another way. */
static inline void tr_signals_at(const double *tables, int count, double t, double *x) {
  tr_moment *now = (tr_moment *)x;
  tr_signal *out = (tr_signal *)(now + 1);
  now->t = t;
  for (int i = 0; i < count; ++i) {
    const double *table = tables + (int)tables[i];
    if (*table == TR_TABLE_INPUT) tr_input_signal((const tr_input *)table, t, out + i);
    else tr_table_signal((const tr_knots *)table, t, now->inside, out + i);
  }
}

/* The same for hosts. */
void tr_signals(const double *tables, int count, double t, double *x) { tr_signals_at(tables, count, t, x); }

/* Make t the moment of the block's own signals. */
static inline void tr_set_time(tr_sim *s, double t) { tr_signals_at(TR_A(s, tables), s->k->ntables, t, TR_A(s, x)); }

/* Powers just written go behind the derivative dy: each where columns ask for works, then the sums that the audit looks at. */
static inline void tr_put_powers(const tr_sim *s, double *dy) {
  const tr_kernel *k = s->k;
  const double *power = TR_A(s, power);
  double *out = dy + s->ny, sum[2] = {0.0, 0.0};
  if (!s->naudit) return;
  for (int i = 0; i < s->nworks; ++i) out[i] = power[i];
  for (int i = 0; i < k->npowers; ++i) sum[i >= k->ntaken] += power[i];
  out[s->nworks] = sum[0], out[s->nworks + 1] = sum[1];
}

/* Put the maps of the state y in place, at the moment whose signals are; of a tree of parts they are formed when they are
 * asked for. What is known of ẏ stays (a large tree that rubs puts its own there);
 * without multipliers the maps are ẏ. */
static void tr_maps_of(tr_sim *s, const double *y) {
  s->step.along = 0, s->step.mapped = s->k->begin ? TR_MAPS_NONE : TR_MAPS_RAW, s->stats.maps++;
  double *dy = s->k->active + s->k->neta ? TR_A(s, dyeval) : TR_A(s, dy);
  if (s->k->begin) tr_begin_along(s, y, TR_A(s, dyeval));
  else s->k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), dy, TR_A(s, power));
  if (dy == TR_A(s, dy)) tr_put_powers(s, dy);
}

/* The same at time t. */
static void tr_maps_at(tr_sim *s, double t, const double *y) { tr_set_time(s, t), tr_maps_of(s, y); }

/* Defined in the files that come after this one. */
static double tr_set_violation(tr_sim *s, int i);
static double tr_turn_violation(const tr_sim *s, int i);
static void tr_holding_now(tr_sim *s);
static void tr_keep_still(const tr_sim *s, double *v);
static void tr_watch_loops(tr_sim *s);

/* Record the extremes of (signed sliding speed − kink speed) of every pair over the stages of a step; of a pair with a set-valued law
 * how far it has come from its mode. */
static void tr_watch(tr_sim *s) {
  double *lo = TR_A(s, smin), *hi = TR_A(s, smax);
  if (s->friction.still) tr_holding_now(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (tr_is_set(s, i)) {
      double v = tr_set_violation(s, i);
      hi[i] = fmax(hi[i], v), lo[i] = fmin(lo[i], v);
      continue;
    }
    if (tr_is_turn(s, i)) {
      hi[i] = fmax(hi[i], tr_turn_violation(s, i));
      continue;
    }
    const tr_sliding *v = tr_sliding_of(s, i);
    double g = v->speed - v->border, b = -v->speed - v->border;
    if (g < lo[i]) lo[i] = g;
    if (fmax(g, b) > hi[i]) hi[i] = fmax(g, b);
  }
}

/* Nothing is known yet of how near pairs come to the end of their modes, and loops to singular positions, in the step that begins. */
static void tr_forget_extremes(tr_sim *s) {
  s->loops.least = INFINITY;
  for (int i = 0; i < s->k->nsliders; ++i) TR_A(s, smin)[i] = INFINITY, TR_A(s, smax)[i] = -INFINITY;
}

/* Whether all n numbers are finite. */
static int tr_finite(int n, const double *a) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += 0.0 * a[i];
  return sum == 0.0;
}

/* ẏ (dy), powers behind it, at the state y whose stage 1 is in place, with the multipliers z. */
static inline void tr_stage2(tr_sim *s, const double *y, const double *z, double *dy) {
  s->k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, dy, TR_A(s, power));
  tr_put_powers(s, dy);
}

/* ẏ at (t, y). 0 when the multipliers cannot be found; then step.trouble says why. */
static int tr_rhs(tr_sim *s, double t, const double *y, double *dy) {
  const tr_kernel *k = s->k;
  if (tr_at_bound(s)) {
    s->step.trouble = TR_FAIL_MULTIPLIERS;
    return 0;
  }
  s->stats.rhs_evaluations++;
  tr_set_time(s, t);
  if (tr_recurs(s) && tr_rhs_along(s, y, dy)) {
    tr_put_powers(s, dy);
    if (s->step.watch) tr_watch(s);
    if (s->step.watch && k->active) tr_watch_loops(s);
    if (s->friction.still) tr_keep_still(s, dy);
    return 1;
  }
  k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), dy, TR_A(s, power));
  s->step.mapped = TR_MAPS_RAW, s->step.along = 0;
  if (k->active + k->neta == 0) {
    tr_put_powers(s, dy);
    return 1;
  }
  if (!tr_multipliers(s, 0)) {
    s->step.trouble = tr_finite(k->nmaps, TR_A(s, maps)) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
    return 0;
  }
  tr_note_loads(s);
  if (s->step.watch) tr_watch(s), tr_watch_loops(s);
  tr_stage2(s, y, TR_A(s, z), dy);
  if (s->friction.still) tr_keep_still(s, dy);
  return 1;
}
