/* Output rows: multipliers and columns at a state, and the values that only the runtime can compute. */
#include "output/output.h"

#define ANGLE_PROBE 1e-6  /* rad: test rotation, whose effect gives the rate of an angle */

/* Find the directions of λ that the motion does not determine at the solution. dir (rows × count) receives these directions. N
 * (nkappa × count) receives their scaled reactions, and base the scaled reactions of z. Returns the number of directions. */
static int tr_open_reactions(tr_sim *s, const double *y, const double *z, double *dir, double *N, double *base) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int rows = k->rows, m = o->nkappa, a = k->active, extra = tr_dependent_rows(s), count = 0;
  char is_active[rows + 1];
  double *V = TR_A(s, open_lambda), zz[rows + k->neta + 1];
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

/* Normalise moved − base (n scaled reactions), and raise each entry of `share` at least to the absolute value of its component. at:
 * indices of the reactions; null pointer: the first n. */
static void tr_raise_shares(int n, const int *at, const double *base, const double *moved, double *share) {
  double squares = 0.0;
  for (int q = 0; q < n; ++q) {
    const double change = moved[at ? at[q] : q] - base[at ? at[q] : q];
    squares += change * change;
  }
  const double inv = squares > 0.0 ? 1.0 / sqrt(squares) : 0.0;
  for (int q = 0; q < n; ++q) {
    const int i = at ? at[q] : q;
    share[i] = fmax(share[i], fabs(moved[i] - base[i]) * inv);
  }
}

/* Add 1 to the multiplier of inactive row number `slot` of each loop in a group. opened: for each loop, the index of this row, or
 * −1. Returns the number of rows. */
static int tr_open_group(const tr_sim *s, int group, int slot, const char *is_active, int *opened, double *z) {
  const tr_outputs *o = s->o;
  int count = 0;
  for (int l = 0; l < o->nloops; ++l) {
    int left = slot;
    opened[l] = -1;
    if (o->loop_group[l] != group) continue;
    for (int r = o->loop_rows[l]; r < o->loop_rows[l + 1] && opened[l] < 0; ++r)
      if (!is_active[r] && left-- == 0) opened[l] = r, z[r] += 1.0, ++count;
  }
  return count;
}

/* moved ← scaled reactions at the multipliers zz. Row n of `columns` (or null pointer) ← the columns at zz. */
static void tr_evaluate_open(tr_sim *s, const double *y, const double *zz, double *moved, double *columns, int n) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  double extra[TR_DOUBLES(tr_extra) + k->nsliders + 1];
  o->kappa(TR_A(s, x), y, TR_A(s, co), zz, TR_A(s, dy) + k->nq, moved);
  if (!columns) return;
  memset(extra, 0, sizeof extra);
  o->eval(TR_A(s, x), y, TR_A(s, co), zz, TR_A(s, dy) + k->nq, extra, columns + (size_t)n * o->nout);
}

static int tr_open_shares(tr_sim *s, const double *y, const double *z, double *share, double *columns, int *evaluations) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int rows = k->rows, a = k->active, m = s->o->nkappa, count = tr_dependent_rows(s), opened[rows], groups = 0, more = 1;
  char is_active[rows + 1];
  double base[m], moved[m], zz[rows + k->neta + 1], *V = TR_A(s, open_lambda);
  memset(share, 0, sizeof(double) * m);
  *evaluations = 0;
  if (a == rows && count == 0) return 0;
  memset(is_active, 0, sizeof is_active);
  for (int i = 0; i < a; ++i) is_active[k->active_rows[i]] = 1;
  tr_evaluate_open(s, y, z, base, columns, 0);
  tr_null_space(s, V);
  for (int q = 0; q < count; ++q) {
    memcpy(zz, z, sizeof(double) * (rows + k->neta));
    for (int i = 0; i < a; ++i) zz[k->active_rows[i]] += V[i + q * a];
    tr_evaluate_open(s, y, zz, moved, columns, ++*evaluations);
    tr_raise_shares(m, 0, base, moved, share);
  }
  for (int l = 0; l < o->nloops; ++l)
    if (o->loop_group[l] >= groups) groups = o->loop_group[l] + 1;
  for (int g = 0; g < groups; ++g, more = 1)
    for (int slot = 0; more; ++slot) {
      memcpy(zz, z, sizeof(double) * (rows + k->neta));
      more = tr_open_group(s, g, slot, is_active, opened, zz);
      count += more;
      if (more) tr_evaluate_open(s, y, zz, moved, columns, ++*evaluations);
      for (int l = 0; l < o->nloops && more; ++l) {
        const int first = o->share_start[l], n = o->share_start[l + 1] - first;
        if (opened[l] >= 0) tr_raise_shares(n, o->share_at + first, base, moved, share);
      }
    }
  return count;
}

/* Redundant loops: among all λ with the same motion, choose the reactions with the smallest norm. kappa: reactions of all joints on
 * loops, scaled by the inertia on which they act. Thus units, the order of bodies, and cuts do not affect the choice. */
static void tr_minimise_reactions(tr_sim *s, const double *y, double *z) {
  const tr_kernel *k = s->k;
  int rows = k->rows, m = s->o->nkappa;
  if (rows == 0 || m == 0 || k->nmore || (k->active == rows && tr_dependent_rows(s) == 0)) return;
  double *base = TR_A(s, open_kappa), *N = base + m, *dir = TR_A(s, event_y), x[rows];
  int count = tr_open_reactions(s, y, z, dir, N, base);
  tr_least_squares least = tr_least_squares_factor(m, count, N, TR_A(s, gram));
  tr_least_squares_solve(&least, base, 0, x);
  tr_add_columns(rows, count, dir, x, 1.0, z);
}

static void tr_expand_multipliers(tr_sim *s, const double *y, double *full, int resolve) {
  TR_NEED(s, TR_HAS_SOLUTION);
  const tr_kernel *k = s->k;
  const double *z = TR_A(s, z);
  memset(full, 0, sizeof(double) * k->rows);
  for (int i = 0; i < k->active; ++i) full[k->active_rows[i]] = z[i];
  memcpy(full + k->rows, z + k->active, sizeof(double) * k->neta);
  if (resolve && s->o && s->o->kappa) tr_minimise_reactions(s, y, full);
}

static int tr_evaluate_contacts(tr_sim *s, const double *y, const double *a, tr_contact *out) {
  TR_NEED(s, TR_HAS_MAPS);
  if (!s->o || !s->o->contacts) return 0;
  double zf[s->k->rows + s->k->neta + 1];
  tr_expand_multipliers(s, y, zf, 0);
  s->o->contacts(TR_A(s, x), y, TR_A(s, co), zf, a, (double *)out);
  return 1;
}

static int tr_pair_contacts(tr_sim *s, int i, const double *y, tr_contact *out) {
  const tr_pair *pair = tr_pair_of(s, i);
  int n = pair->ncontacts;
  if (!s->o || n == 0) return 0;
  tr_contact all[s->o->ncontacts + 1];
  if (!tr_current_contacts(s, y, all)) return 0;
  memcpy(out, all + pair->contact0, sizeof(tr_contact) * n);
  return n;
}

/* Fill in the residuals of the solution, unless rows omit them, and the present verdict of the audit. */
static void tr_fill_audit(tr_sim *s, const double *y, tr_extra *extra) {
  const tr_kernel *k = s->k;
  double worst = 0.0, *h = TR_A(s, loop_error);
  tr_judgement said;
  if (k->rows && !s->set.brief) {
    tr_evaluate_closure(s, y, h);
    for (int i = 0; i < k->rows; ++i) worst = fmax(worst, fabs(h[i]) / tr_row_unit(s, i));
  }
  tr_judge(s, &said);
  extra->closure = worst, extra->complement = s->set.brief ? 0.0 : tr_complement_residual(s), extra->verdict = said.verdict;
}

static void tr_fill_extra(tr_sim *s, const double *y, tr_extra *extra) {
  const tr_kernel *k = s->k;
  extra->energy0 = s->audit.energy0;
  if (s->o->wants & TR_WANTS_AUDIT) tr_fill_audit(s, y, extra);
  extra->contraction = s->o->wants & TR_WANTS_CONTRACTION && !s->set.brief ? tr_contraction(s) : 0.0;
  extra->events = (double)s->stats.events;
  extra->overrun = s->bound.overrun, extra->overruns = (double)(s->stats.by_impulses + s->stats.relaxed);
  extra->step = s->step.size;
  extra->last = s->events.last;
  double *state = (double *)(extra + 1);
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_mode *m = tr_mode_of(s, i);
    state[i] = tr_mode_flag(m) != TR_SLIPS ? m->flag : tr_pair_of(s, i)->nrates == 1 ? m->direction[0] : 1.0;
  }
}

/* The angle v (within ± π), plus the multiple of 2π that brings it closest to the predicted angle. The predicted angle is the last
 * value plus rate × time since then. */
static double tr_unwrap(const tr_memory *last, double t, double rate, double v) {
  return v + TURN * round((last->value + rate * (t - last->t) - v) / TURN);
}

/* Evaluate all columns at y without multipliers; only columns of positions are valid. */
static void tr_evaluate_positions(tr_sim *s, double t, const double *y, double *columns) {
  double z[s->k->rows + s->k->neta + 1], extra[TR_DOUBLES(tr_extra) + s->k->nsliders + 1];
  memset(z, 0, sizeof z), memset(extra, 0, sizeof extra);
  tr_set_time(s, t);
  s->o->eval(TR_A(s, x), y, TR_A(s, co), z, TR_A(s, dy) + s->k->nq, extra, columns);
}

static void tr_follow_angles(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  tr_memory *memory = (tr_memory *)TR_A(s, post_memory);
  int any = 0;
  for (int i = 0; s->o && i < s->o->npost; ++i) any |= s->o->post[i].kind == TR_POST_WRAP && memory[i].known;
  if (!any) return;
  double moved[tr_state_width(s)], dq[k->nq + 4], now[s->o->nout + 1], next[s->o->nout + 1], fastest = s->set.rate;
  k->qdot(y, y + k->nq, TR_A(s, c), dq);
  for (int i = 0; i < k->nq; ++i) fastest = fmax(fastest, fabs(dq[i]));
  const double h = ANGLE_PROBE / fastest;
  tr_copy(tr_state_width(s), y, moved);
  for (int i = 0; i < k->nq; ++i) moved[i] += h * dq[i];
  tr_evaluate_positions(s, t + h, moved, next);
  tr_evaluate_positions(s, t, y, now);
  for (int i = 0; i < s->o->npost; ++i) {
    tr_memory *last = memory + i;
    if (s->o->post[i].kind != TR_POST_WRAP) continue;
    const double v = now[s->o->post[i].column], change = next[s->o->post[i].column] - v;
    const double rate = (change - TURN * round(change / TURN)) / h;
    last->value = tr_unwrap(last, t, last->rated ? 0.5 * (last->rate + rate) : rate, v);
    last->t = t, last->rate = rate, last->rated = 1;
  }
}

static void tr_finish_columns(tr_sim *s, double *row) {
  const tr_outputs *o = s->o;
  tr_memory *memory = (tr_memory *)TR_A(s, post_memory);
  const double unloaded = tr_unloaded_force(s);
  for (int i = 0; i < o->npost; ++i) {
    const tr_post *post = o->post + i;
    double *v = row + post->column;
    tr_memory *last = memory + i;
    if (post->kind == TR_POST_TOUCH) {
      *v = fabs(*v) > unloaded;
    } else if (post->kind == TR_POST_HOLD) {
      if (!(fabs(row[post->partner]) > unloaded)) *v = last->known ? last->value : 0.0;
    } else if (last->known) {
      *v = tr_unwrap(last, row[-1], last->rate, *v);
    }
    last->known = 1, last->value = *v, last->t = row[-1];
  }
}

static void tr_finish_derivatives(tr_sim *s, const double *y, const double *z, double *derivatives) {
  const tr_outputs *o = s->o;
  double row[s->o->nout + 1], extra[TR_DOUBLES(tr_extra) + s->k->nsliders + 1];
  int any = 0;
  for (int i = 0; i < o->npost; ++i) any |= o->post[i].kind == TR_POST_HOLD;
  memset(extra, 0, sizeof extra);
  if (any) o->eval(TR_A(s, x), y, TR_A(s, co), z, TR_A(s, dy) + s->k->nq, extra, row);
  for (int i = 0; i < o->npost; ++i) {
    const tr_post *post = o->post + i;
    const int held = post->kind == TR_POST_HOLD && !(fabs(row[post->partner]) > tr_unloaded_force(s));
    if (held || post->kind == TR_POST_TOUCH) derivatives[post->column] = 0.0;
  }
}

static int tr_output_row_of(tr_sim *s, double t, double *y, double *row, int there) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int watch = s->step.watch;
  row[0] = t;
  if (!o) return TR_OK;
  s->step.watch = 0;
  s->stats.outputs++;
  const int solved = o->wants & TR_WANTS_SOLUTION || s->clock.row_index == 0;
  int ok = there || tr_project(s, t, y);
  if (!solved) tr_set_time(s, t);
  else if (ok && !there) ok = tr_rhs(s, t, y, TR_A(s, dy));
  if (ok) {
    double z[k->rows + k->neta + 1], extra[TR_DOUBLES(tr_extra) + k->nsliders + 1];
    tr_fill_extra(s, y, (tr_extra *)extra);
    if (solved) tr_expand_multipliers(s, y, z, (o->wants & TR_WANTS_SOLUTION) != 0);
    o->eval(TR_A(s, x), y, TR_A(s, co), z, TR_A(s, dy) + k->nq, extra, row + 1);
    tr_finish_columns(s, row + 1);
  }
  s->step.watch = watch;
  return !ok ? TR_FAIL_MULTIPLIERS : tr_is_finite(o->nout, row + 1) ? TR_OK : TR_FAIL_NOT_FINITE;
}

