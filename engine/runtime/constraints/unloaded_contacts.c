/* Contacts of joints that only push, if they touch without load. The constraint row of such a contact depends on the rows of closed
 * contacts; the fourth foot of a box is an example. The contact counts as open, but touches: its gap stays 0 while the other
 * contacts are closed (theory, "Contact that begins and ends"). */
#include "constraints/constraints.h"

/* relative to the row's own entry of S: a row is dependent if the part that does not follow from closed contacts is smaller */
#define OWN_PART 1e-9

/* V (active) receives the open direction in which contact c, which is open, has the multiplier 1. Returns whether the contact's row
 * depends on the rows of closed contacts and loops. Requires the factor. */
static int tr_open_direction_of_contact(tr_sim *s, int c, double *V) {
  const int a = s->k->active, own = tr_active_row(s, c);
  const double *row = tr_raw_row(s, c);
  double b[a + 1];
  for (int j = 0; j < a; ++j) b[j] = -row[j];
  for (int d = 0; d < s->k->nunilateral; ++d)
    if (tr_is_contact_open(s, d)) b[tr_active_row(s, d)] = 0.0;
  tr_solve_loops(s, b, V);
  V[own] = 1.0;
  double part = 0.0;
  for (int j = 0; j < a; ++j) part += row[j] * V[j];
  return fabs(part) <= OWN_PART * row[own];
}

static int tr_is_contact_dependent(tr_sim *s, int c) {
  double V[s->k->active + 1];
  return tr_open_direction_of_contact(s, c, V);
}

static double tr_load_of_open_contact(tr_sim *s, int c) {
  const tr_kernel *k = s->k;
  const int a = k->active, m = k->nkappa;
  double V[a + 1], Q[m + 1], w[m + 1];
  if (!m) return 0.0;
  tr_open_direction_of_contact(s, c, V);
  const double *k0 = map_kappa(k, TR_A(s, maps)), *kl = k0 + m;
  memset(Q, 0, sizeof Q), memcpy(w, k0, sizeof(double) * m);
  tr_add_columns(m, a, kl, V, 1.0, Q);
  tr_add_columns(m, a + k->neta, kl, TR_A(s, z), 1.0, w);
  for (int i = 0; i < k->nelements && k->nmore; ++i)
    for (int j = 0; j < k->element[i].nmore; ++j) w[k->element[i].kappa0 + j] += TR_A(s, more)[k->element[i].more0 + j];
  return -tr_dot(Q, w, m) / tr_dot(Q, Q, m);
}
