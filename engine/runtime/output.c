/* Output rows: state at a time → multipliers → requested columns, with what only the runtime knows filled in. */
#include "tr.h"

/* `extra` block handed to the output unit. */
enum { TR_X_ENERGY0, TR_X_CLOSURE, TR_X_COMPLEMENT, TR_X_CONTRACTION, TR_X_EVENTS, TR_X_STEP, TR_X_STATES };

/* Redundant loops: add to λ the null-space combination that minimises the reactions' norm in the bodies' own metric (``kappa``:
 * reactions of all joints in loops, scaled by the inertia of the parts they act on). Does not depend on units, on the order of
 * things, or on which joints were cut. */
static void tr_resolve(tr_sim *s, const double *y, double *z) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int rows = k->rows, free_rows[rows + 1], nf = 0, m = o->nkappa;
  if (rows == 0 || m == 0) return;
  /* unknowns that the motion leaves open: inactive rows, and pivots beyond the rank */
  char is_active[rows + 1];
  memset(is_active, 0, sizeof is_active);
  for (int i = 0; i < k->active; ++i) is_active[k->active_rows[i]] = 1;
  for (int i = 0; i < rows; ++i)
    if (!is_active[i]) free_rows[nf++] = i;
  const int *perm = (const int *)TR_A(s, perm);
  int extra = k->active - s->rank_now;
  if (nf + extra == 0) return;
  double *base = TR_A(s, kap), *col = base + m, *N = base + 2 * m; /* N: m×(nf+extra) */
  o->kappa(TR_A(s, x), y, TR_A(s, co), z, base);
  int count = nf + extra;
  double *dir = TR_A(s, cand); /* rows × count: null directions in λ */
  memset(dir, 0, sizeof(double) * rows * count);
  for (int q = 0; q < count; ++q) {
    double *v = dir + rows * q;
    if (q < nf) {
      v[free_rows[q]] = 1.0;
    } else { /* λ_r = 1 for a dropped pivot r, the kept ones compensate: S_kk λ_k = −S_kr */
      int r = perm[s->rank_now + q - nf], a = k->active;
      double b[a], x[a];
      const double *S = TR_A(s, maps);
      for (int i = 0; i < a; ++i) b[i] = -S[i + r * a];
      tr_solve_S(s, b, x);
      for (int i = 0; i < s->rank_now; ++i) v[k->active_rows[perm[i]]] = x[perm[i]];
      v[k->active_rows[r]] = 1.0;
    }
    double zz[rows + k->neta];
    for (int i = 0; i < rows; ++i) zz[i] = z[i] + v[i];
    memcpy(zz + rows, z + rows, sizeof(double) * k->neta);
    o->kappa(TR_A(s, x), y, TR_A(s, co), zz, col);
    for (int i = 0; i < m; ++i) N[i + m * q] = col[i] - base[i];
  }
  /* modified Gram–Schmidt, then subtract the projections */
  for (int q = 0; q < count; ++q) {
    double *v = dir + rows * q, *n = N + m * q, len0 = 0.0, len = 0.0;
    for (int i = 0; i < m; ++i) len0 += n[i] * n[i];
    for (int p = 0; p < q; ++p) {
      double dot = 0.0, *np = N + m * p;
      for (int i = 0; i < m; ++i) dot += n[i] * np[i];
      for (int i = 0; i < m; ++i) n[i] -= dot * np[i];
      for (int i = 0; i < rows; ++i) v[i] -= dot * dir[rows * p + i];
    }
    for (int i = 0; i < m; ++i) len += n[i] * n[i];
    double inv = len > 1e-20 * len0 && len > 0.0 ? 1.0 / sqrt(len) : 0.0;
    for (int i = 0; i < m; ++i) n[i] *= inv;
    for (int i = 0; i < rows; ++i) v[i] *= inv;
  }
  for (int q = 0; q < count; ++q) {
    double dot = 0.0, *n = N + m * q;
    for (int i = 0; i < m; ++i) dot += n[i] * base[i];
    for (int i = 0; i < m; ++i) base[i] -= dot * n[i];
    for (int i = 0; i < rows; ++i) z[i] -= dot * dir[rows * q + i];
  }
}

/* z over all rows: [λ | η] from [λ active | η]. */
static void tr_full_multipliers(tr_sim *s, const double *y, double *full, int resolve) {
  const tr_kernel *k = s->k;
  const double *z = TR_A(s, z);
  memset(full, 0, sizeof(double) * k->rows);
  for (int i = 0; i < k->active; ++i) full[k->active_rows[i]] = z[i];
  memcpy(full + k->rows, z + k->active, sizeof(double) * k->neta);
  if (resolve && s->o && s->o->kappa) tr_resolve(s, y, full);
}

static void tr_fill_extra(tr_sim *s, const double *y, double *extra) {
  const tr_kernel *k = s->k;
  double pos = 0.0, vel = 0.0, worst = 0.0, *h = TR_A(s, h_res);
  if (k->rows) {
    k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
    for (int i = 0; i < k->rows; ++i) {
      double unit = k->row_kind[i] ? 1.0 : s->length;
      worst = fmax(worst, fabs(h[i]) / unit);
    }
  }
  (void)pos, (void)vel;
  extra[TR_X_ENERGY0] = s->energy0;
  extra[TR_X_CLOSURE] = worst;
  extra[TR_X_COMPLEMENT] = 0.0;
  if (k->neta) {
    double size = 0.0, err = 0.0;
    const double *eta = TR_A(s, z) + k->active;
    tr_law(s, eta);
    for (int i = 0; i < k->neta; ++i) {
      size = fmax(size, fabs(eta[i]));
      err = fmax(err, fabs(TR_A(s, law)[i] - eta[i]));
    }
    extra[TR_X_COMPLEMENT] = size > 0.0 ? err / size : err;
  }
  extra[TR_X_CONTRACTION] = 0.0;
  extra[TR_X_EVENTS] = (double)s->stats.events;
  extra[TR_X_STEP] = s->step_h;
  for (int i = 0; i < k->nsliders; ++i) {
    const double *m = tr_mode(s, i);
    extra[TR_X_STATES + i] = m[0] < 0.5 ? 0.0 : (tr_slider(s, i)[4] == 1 ? m[1] : 1.0);
  }
}

enum { TR_POST_HOLD = 1, TR_POST_WRAP = 2 };

/* hold: column keeps its last value while its partner (a normal force) is zero; wrap: an angle is continued by whole turns. */
static void tr_post(tr_sim *s, double *row) {
  const tr_outputs *o = s->o;
  double *memory = TR_A(s, wrap);
  for (int i = 0; i < o->npost; ++i) {
    const int *p = o->post + 3 * i;
    double *v = row + p[1], *last = memory + 2 * i;
    if (p[0] == TR_POST_HOLD) {
      if (last[0] > 0.5 && !(fabs(row[p[2]]) > 1e-140)) *v = last[1];
    } else if (last[0] > 0.5) {
      *v += 6.283185307179586 * round((last[1] - *v) / 6.283185307179586);
    }
    last[0] = 1.0, last[1] = *v;
  }
}

/* Evaluate the requested columns at (t, y); y is brought onto the manifold first. row[0] = t. 0 when it cannot be evaluated. */
static int tr_output(tr_sim *s, double t, double *y, double *row) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int watch = s->watch;
  row[0] = t;
  if (!o) return 1;
  s->watch = 0;
  s->stats.outputs++;
  int ok = tr_project(s, t, y) && tr_rhs(s, t, y, TR_A(s, dy));
  if (ok) {
    double z[k->rows + k->neta + 1], extra[TR_X_STATES + k->nsliders + 1];
    tr_fill_extra(s, y, extra);
    tr_full_multipliers(s, y, z, 1);
    o->eval(TR_A(s, x), y, TR_A(s, co), z, extra, row + 1);
    tr_post(s, row + 1);
  }
  s->watch = watch;
  return ok;
}
