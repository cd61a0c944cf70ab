/* Exact derivative of ẏ = F by state and time: dF/dy = F_y − F_z R_z⁻¹ R_y. R are the residuals whose roots are the multipliers z.
 * The elimination of z follows the order of the right-hand side. */
#include "integrators/integrators.h"

/* Set the right-hand sides of the rows of stuck pairs (tr_form_rest_rows). R: derivatives of these pairs' accelerations. */
static void tr_rest_rows_shift(tr_sim *s, const double *R, const double *lam, double *deta) {
  const tr_kernel *k = s->k;
  const int *row = tr_row_kinds(s);
  const double *Ql = map_Ql(k, TR_A(s, maps)), *Qe = TR_A(s, Q) + k->neta;
  for (int i = 0; i < k->neta; ++i) {
    if (row[i] == TR_ROW_LAW) continue;
    deta[i] = 0.0;
    if (row[i] != TR_ROW_REST) continue;
    double a = R[i];
    for (int q = 0; q < k->active; ++q) a += Ql[i + q * k->neta] * lam[q];
    deta[i] = -a / Qe[i + i * k->neta];
  }
}

static int tr_multiplier_derivatives(tr_sim *s, const double *J, int ld, const tr_reaction_choice *choice, double *dz) {
  TR_NEED(s, TR_HAS_SOLUTION);
  tr_form_all_maps(s);
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, n = k->nn, cols = s->ny + 1, top = s->ny, open = choice ? tr_open_count(s) : 0;
  const double *Nl = map_Nl(k, TR_A(s, maps)), *dn = TR_A(s, dn);
  double *lu = TR_A(s, lu), b[a + 1], lam[a + 1], shift[n + 1];
  int *perm = (int *)TR_A(s, perm) + a;
  if (e) {
    tr_form_law_jacobian(s);
    if (s->friction.held) tr_form_rest_rows(s, TR_A(s, z) + a, TR_A(s, r), lu);
    if (!tr_lu(e, lu, perm)) return 0;
  }
  for (int j = 0; j < cols; ++j) {
    const double *R = J + (size_t)j * ld + top;
    double *out = dz + (size_t)j * (a + e), *deta = out + a;
    for (int i = 0; i < a; ++i) b[i] = -R[i];
    for (int c = 0; c < k->nunilateral; ++c)
      if (tr_is_contact_open(s, c)) b[tr_active_row(s, c)] = 0.0;
    if (a) tr_solve_loops(s, b, lam);
    if (choice && choice->r) tr_follow_choice(s, choice, j, R + a + e, lam);
    for (int i = 0; i < a; ++i) out[i] = lam[i];
    if (!e) continue;
    memset(shift, 0, sizeof shift);
    tr_add_columns(n, a, Nl, lam, 1.0, shift);
    for (int i = 0; i < e; ++i) deta[i] = -R[a + i];
    for (int m = 0; m < k->nelements; ++m) {
      const tr_element *el = k->element + m;
      const double *D = dn + el->dn0;
      for (int r = 0; r < el->neta; ++r)
        for (int i = 0; i < el->needs; ++i) deta[el->eta0 + r] += D[r + i * el->neta] * shift[el->n0 + i];
    }
    if (s->friction.held) tr_rest_rows_shift(s, R + a, lam, deta);
    tr_lu_solve(e, lu, perm, deta);
    tr_add_columns(a, e, TR_A(s, T), deta, -1.0, out);
    for (int q = 0; q < e && open; ++q) { /* the open reactions depend on friction, too */
      double x[open];
      for (int p = 0; p < open; ++p) x[p] = TR_A(s, openY)[p + q * open] * deta[q];
      tr_add_columns(a, open, TR_A(s, openV), x, 1.0, out);
    }
  }
  return 1;
}

static int tr_jacobian_at(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  int nz = k->active + k->neta, top = s->ny, ld = tr_jacobian_rows(s), cols = s->ny + 1;
  double *J = TR_A(s, jac), *z = TR_A(s, z);
  if (!tr_rhs(s, t, y, TR_A(s, dy))) return 0;
  if (k->neta) tr_evaluate_laws(s, z + k->active);
  tr_jacobian_columns(s, y, z, cols + nz, J);
  s->stats.jacobians++;
  TR_MADE(s, TR_HAS_JACOBIAN);
  if (nz == 0) return 1;
  double *dz = TR_A(s, jw);
  tr_reaction_choice choice = tr_linearise_choice(s, y, J);
  if (!tr_multiplier_derivatives(s, J, ld, &choice, dz)) return 0;
  for (int q = 0; q < cols; ++q)
    for (int m = 0; m < nz; ++m) {
      double a = dz[m + (size_t)q * nz];
      const double *Fz = J + (size_t)(cols + m) * ld;
      double *col = J + (size_t)q * ld;
      if (a != 0.0)
        for (int i = 0; i < top; ++i) col[i] += Fz[i] * a;
    }
  return 1;
}
