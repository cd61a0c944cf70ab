/* Output rows: state at a time → multipliers → requested columns, with what only the runtime knows filled in. */
#include "modes.h"

#define OPEN_FORCE 1e-140 /* N: what is left of a normal force where there is none (the contact forms keep their roots off zero) */

/* Directions of λ (rows × count) that the motion leaves open at the state just solved, and their scaled reactions N (nkappa × count);
 * base: the scaled reactions of z. Returns the count. */
static int tr_open_reactions(tr_sim *s, const double *y, const double *z, double *dir, double *N, double *base) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int rows = k->rows, m = o->nkappa, a = k->active, extra = a - s->loops.rank_now, count = 0;
  char is_active[rows + 1];
  double *V = TR_A(s, nul), zz[rows + k->neta + 1];
  memset(is_active, 0, sizeof is_active);
  memset(dir, 0, sizeof(double) * rows * (rows - a + extra));
  tr_null_space(s, V);
  for (int i = 0; i < a; ++i) is_active[k->active_rows[i]] = 1;
  for (int i = 0; i < rows; ++i)
    if (!is_active[i]) dir[i + rows * count++] = 1.0;
  for (int q = 0; q < extra; ++q, ++count)
    for (int i = 0; i < a; ++i) dir[k->active_rows[i] + rows * count] = V[i + q * a];
  o->kappa(TR_A(s, x), y, TR_A(s, co), z, TR_A(s, dy) + k->nq, base);
  memcpy(zz, z, sizeof(double) * (rows + k->neta));
  for (int q = 0; q < count; ++q) {
    for (int i = 0; i < rows; ++i) zz[i] = z[i] + dir[i + rows * q];
    o->kappa(TR_A(s, x), y, TR_A(s, co), zz, TR_A(s, dy) + k->nq, N + m * q);
    for (int i = 0; i < m; ++i) N[i + m * q] -= base[i];
  }
  return count;
}

/* Redundant loops: of all λ with this motion, those whose reactions are smallest in the bodies' own metric (``kappa``: reactions of
 * all joints on loops, scaled by the inertia of the parts they act on). Does not depend on units, order, or choice of cuts. */
static void tr_resolve(tr_sim *s, const double *y, double *z) {
  const tr_kernel *k = s->k;
  int rows = k->rows, m = s->o->nkappa;
  if (rows == 0 || m == 0 || k->nmore || (k->active == rows && s->loops.rank_now == k->active)) return;
  double *base = TR_A(s, kap), *N = base + m, *dir = TR_A(s, cand), x[rows];
  int count = tr_open_reactions(s, y, z, dir, N, base);
  tr_least least = tr_least_of(m, count, N, TR_A(s, gram));
  tr_least_solve(&least, base, 0, x);
  tr_add_columns(rows, count, dir, x, 1.0, z);
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

static double tr_contraction(tr_sim *s);

/* Relative residual of the complement equations at the solution in place: of the laws, and of rest. */
static double tr_complement(tr_sim *s) {
  const tr_kernel *k = s->k;
  double size = 0.0, err = 0.0, *r = TR_A(s, r);
  const double *eta = TR_A(s, z) + k->active;
  if (!k->neta) return 0.0;
  if (k->shift && s->step.along && !s->step.mapped && !s->friction.still) tr_laws_along(s, TR_A(s, law));
  else tr_law(s, eta);
  for (int i = 0; i < k->neta; ++i) r[i] = TR_A(s, law)[i] - eta[i];
  if (s->friction.still) tr_still_rows(s, eta, r, TR_A(s, lu));
  for (int i = 0; i < k->neta; ++i) size = fmax(size, fabs(eta[i])), err = fmax(err, fabs(r[i]));
  return size > 0.0 ? err / size : err;
}

/* How exact the state just solved is, and what the audit says so far. */
static void tr_fill_audit(tr_sim *s, const double *y, tr_extra *extra) {
  const tr_kernel *k = s->k;
  double worst = 0.0, *h = TR_A(s, h_res);
  tr_judgement said;
  if (k->rows) {
    k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
    for (int i = 0; i < k->rows; ++i) worst = fmax(worst, fabs(h[i]) / tr_row_unit(s, i));
  }
  tr_judge(s, &said);
  extra->closure = worst, extra->complement = tr_complement(s), extra->verdict = said.verdict;
}

/* What only the runtime knows, for the columns: `extra`, and the state of every pair behind it. */
static void tr_fill_extra(tr_sim *s, const double *y, tr_extra *extra) {
  const tr_kernel *k = s->k;
  extra->energy0 = s->audit.energy0;
  if (s->o->wants & TR_WANTS_AUDIT) tr_fill_audit(s, y, extra);
  extra->contraction = s->o->wants & TR_WANTS_CONTRACTION ? tr_contraction(s) : 0.0;
  extra->events = (double)s->stats.events;
  extra->overrun = s->bound.overrun, extra->overruns = (double)(s->stats.by_impulses + s->stats.relaxed);
  extra->step = s->step.size;
  extra->last = s->events.last;
  double *state = (double *)(extra + 1);
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_mode *m = tr_mode_of(s, i);
    state[i] = tr_flag(m) != TR_SLIPS ? m->flag : tr_pair_of(s, i)->nrates == 1 ? m->direction[0] : 1.0;
  }
}

/* What is done with columns after their values are known (``tr_post``). */
static void tr_post_columns(tr_sim *s, double *row) {
  const tr_outputs *o = s->o;
  tr_memory *memory = (tr_memory *)TR_A(s, wrap);
  for (int i = 0; i < o->npost; ++i) {
    const tr_post *post = o->post + i;
    double *v = row + post->column;
    tr_memory *last = memory + i;
    if (post->kind == TR_POST_HOLD) {
      if (last->known && !(fabs(row[post->partner]) > OPEN_FORCE)) *v = last->value;
    } else if (last->known) {
      *v += TURN * round((last->value - *v) / TURN);
    }
    last->known = 1, last->value = *v;
  }
}

/* Whether a row needs no more of the evaluation of its state than multipliers and accelerations: else it makes that itself. */
static inline int tr_row_is_apart(const tr_sim *s) {
  return !s->k->neta || (!(s->o->wants & (TR_WANTS_AUDIT | TR_WANTS_CONTRACTION)) && s->clock.row_index > 0);
}

/* Evaluate the requested columns at (t, y); y is brought onto the manifold first, and the multipliers are solved for where a column
 * depends on them (and at the start, whose solution the first step begins from); `there`: it is, and they are in place. row[0] = t. TR_OK;
 * TR_FAIL_MULTIPLIERS when it cannot be evaluated; TR_FAIL_NOT_FINITE when a column is no number, though the motion may be one: squares
 * of forces overflow long before the forces do. */
static int tr_output_of(tr_sim *s, double t, double *y, double *row, int there) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int watch = s->step.watch;
  row[0] = t;
  if (!o) return TR_OK;
  s->step.watch = 0;
  s->stats.outputs++;
  const int solved = o->wants & TR_WANTS_SOLUTION || s->clock.row_index == 0;
  if (!there && tr_row_is_apart(s)) there = tr_asks_end(s, solved ? TR_ASK_END : TR_ASK_PROJECT, t, y, TR_A(s, dy));
  int ok = there || tr_project(s, t, y);
  if (!solved) tr_set_time(s, t);
  else if (ok && !there) ok = tr_rhs(s, t, y, TR_A(s, dy));
  if (ok) {
    double z[k->rows + k->neta + 1], extra[TR_DOUBLES(tr_extra) + k->nsliders + 1];
    tr_fill_extra(s, y, (tr_extra *)extra);
    if (solved) tr_full_multipliers(s, y, z, 1);
    o->eval(TR_A(s, x), y, TR_A(s, co), z, TR_A(s, dy) + k->nq, extra, row + 1);
    tr_post_columns(s, row + 1);
  }
  s->step.watch = watch;
  return !ok ? TR_FAIL_MULTIPLIERS : tr_finite(o->nout, row + 1) ? TR_OK : TR_FAIL_NOT_FINITE;
}

/* The same at a state of which nothing is known. */
static int tr_output(tr_sim *s, double t, double *y, double *row) { return tr_output_of(s, t, y, row, 0); }
