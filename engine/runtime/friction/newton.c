/* Newton's method on the complement equations η = law(N(η)), with conditions of rest for held pairs (theory, "Complement
 * equations"). */
#include "friction/friction.h"


static void tr_form_rest_rows(tr_sim *s, const double *eta, double *r, double *J) {
  TR_NEED(s, TR_HAS_HELD | TR_HAS_ROWS);
  const tr_kernel *k = s->k;
  int e = k->neta;
  const int *row = tr_row_kinds(s);
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e;
  if (s->friction.shared) k->held(TR_A(s, NN), TR_A(s, share), TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
  if (s->friction.impending_laws) tr_evaluate_impending_laws(s);
  for (int m = 0, at = 0; m < k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
      if (row[i] == TR_ROW_REST) {
        double acc = Q0[i], inv = 1.0 / Qe[i + i * e];
        for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j], J[i + j * e] = Qe[i + j * e] * inv;
        r[i] = -acc * inv;
      } else if (row[i] == TR_ROW_FREE) {
        for (int j = 0; j < e; ++j) J[i + j * e] = i == j;
        r[i] = -eta[i];
      } else if (row[i] == TR_ROW_SHARE) {
        r[i] = tr_form_share_row(s, m, at, i, eta, J);
      } else if (row[i] == TR_ROW_STORED) {
        r[i] = tr_form_stored_row(s, m, i, eta, J);
      } else if (row[i] == TR_ROW_FULL) {
        r[i] = tr_form_full_row(s, m, at, i, eta, J);
      }
    }
    at += k->element[pair->element].needs;
  }
}

/* Add the step r to eta. `step` and `size` receive the largest entries of r and of eta, divided by the levers. Because of this
 * division, torques of a small mechanism count as much as forces. */
TR_SIZED void tr_apply_newton_step(const int e, const double *r, const double *per_lever, double *eta, double *step, double *size) {
  *step = *size = 0.0;
  TR_UNROLL
  for (int i = 0; i < e; ++i) {
    const double change = fabs(r[i]) * per_lever[i], now = fabs(eta[i] += r[i]) * per_lever[i];
    *step = change > *step ? change : *step; /* like fmax, a comparison ignores NaN; it takes one instruction */
    *size = now > *size ? now : *size;
  }
}

/* Change the residual r and the Jacobian J to those of the equations with only the fraction 1 − `eased` of friction. */
static void tr_ease_friction(const tr_sim *s, const double *eta, double *r, double *J) {
  int e = s->k->neta;
  double part = 1.0 - s->friction.eased;
  for (int i = 0; i < e; ++i) r[i] = part * TR_A(s, law)[i] - eta[i];
  for (int j = 0; j < e; ++j)
    for (int i = 0; i < e; ++i) J[i + j * e] = part * J[i + j * e] + (i == j) * (1.0 - part);
}

/* tr_newton for e frictions. Without loops, three frictions need no LU factors; with loops, tr_is_unstable_root needs them. */
TR_SIZED int tr_newton_of_size(tr_sim *s, const int e, const int factored, double *eta) {
  const tr_kernel *k = s->k;
  const double *lever = TR_A(s, lever), *law = TR_A(s, law);
  int *perm = (int *)TR_A(s, perm) + k->active;
  double *J = TR_A(s, lu), last = INFINITY, size, step, r[e + 1], per_lever[e + 1];
  const tr_law_arguments at = tr_arguments_of_laws(s);
  TR_UNROLL
  for (int i = 0; i < e; ++i) per_lever[i] = lever[i] > 0.0 ? 1.0 / lever[i] : 1.0;
  for (int it = 1; it <= NEWTON_MAX; ++it) {
    if (tr_is_cancelled(s, (double)e * e * (e + k->nn))) return 0;
    tr_evaluate_laws_at(s, &at, e, eta);
    tr_form_law_jacobian_of_size(s, e);
    TR_UNROLL
    for (int i = 0; i < e; ++i) r[i] = law[i] - eta[i];
    if (s->friction.eased > 0.0) tr_ease_friction(s, eta, r, J);
    if (s->friction.held) tr_form_rest_rows(s, eta, r, J);
    if (e == 1) {
      if (!(fabs(J[0]) > NO_PIVOT)) return 0;
      r[0] /= J[0];
    } else if (!factored) {
      if (!tr_solve_three(J, r)) return 0;
    } else {
      if (!tr_lu(e, J, perm)) return 0;
      tr_lu_solve(e, J, perm, r);
    }
    tr_apply_newton_step(e, r, per_lever, eta, &step, &size);
    s->stats.newton_iterations++;
    if (!(step < INFINITY)) return 0;
    if (step <= NEWTON_EXACT * size || (step <= NEWTON_QUADRATIC * size && step <= NEWTON_SHRINKS * last) || size == 0.0) {
      if (it > s->stats.newton_most) s->stats.newton_most = it;
      return 1;
    }
    last = step;
  }
  return 0;
}

static int tr_newton(tr_sim *s, double *eta) {
  const int e = s->k->neta;
  if (e == 1) return tr_newton_of_size(s, 1, 0, eta);
  return e == 3 && !s->k->active ? tr_newton_of_size(s, 3, 0, eta) : tr_newton_of_size(s, e, 1, eta);
}

/* Like tr_newton. If the direction of a group's load requires the opposite impending motion, the motion is reversed, and the
 * equations are solved again. */
static int tr_newton_with_sense(tr_sim *s, double *eta) {
  if (!tr_newton(s, eta)) return 0;
  if (!s->friction.shared || !tr_reverse_impending(s, eta) || tr_newton(s, eta)) return 1;
  memset(eta, 0, sizeof(double) * s->k->neta);
  return tr_newton(s, eta);
}

/* Like tr_newton, but the values of balls follow from the axes of their impending motion (``load_sharing_rows.c``). Used for groups
 * at rest that have no solution if the values are the friction of the balls. */
static int tr_newton_with_axis_shares(tr_sim *s, const double *warm) {
  double *eta = TR_A(s, z) + s->k->active;
  if (!s->friction.impending_laws) return 0;
  s->friction.impending_laws = 0;
  memcpy(eta, warm, sizeof(double) * s->k->neta);
  if (tr_newton(s, eta)) return 1;
  memset(eta, 0, sizeof(double) * s->k->neta);
  return tr_newton(s, eta);
}

/* Whether the last root of tr_newton would be unstable with stiff contacts (theory, "Complement equations"). At such a root, the
 * determinant of Newton's matrix is negative; without friction it is 1. Only loops need this test; without loops, a root ends where
 * the sign changes (``diagnosis/continuation_past_fold.c``). With shared loads the sign has no meaning. */
static int tr_is_unstable_root(const tr_sim *s) {
  const int e = s->k->neta, r = tr_open_count(s);
  if (!s->k->active || s->friction.shared) return 0;
  const int sense = e == 1 ? (TR_A(s, lu)[0] < 0.0 ? -1 : 1) : tr_lu_determinant_sign(e, TR_A(s, lu), (const int *)TR_A(s, perm) + s->k->active);
  return sense * (r ? tr_lu_determinant_sign(r, TR_A(s, openF), (const int *)TR_A(s, openP)) : 1) < 0;
}
