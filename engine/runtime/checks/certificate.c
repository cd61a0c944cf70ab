/* Certificates of a solution (theory, "Certificate"): contraction of the fixed-point iteration, residual of the complement
 * equations, number of roots. */
#include "checks/checks.h"

#define CONTRACTS 24       /* number of power iterations for the contraction */
#define SAME_ROOT 1e-7     /* × the largest friction of a root: closer roots are equal */
#define SAME_AS_NONE 1e-14 /* × the largest load: a root that is zero up to round-off equals another root within this distance */

/* tr_contraction without maps, for a recursive solution. A pass over the bodies gives the loads that the frictions v cause; the
 * linearised laws then give the next v. Returns a negative number if the method does not apply. */
static double tr_contraction_recursive(tr_sim *s) {
  const tr_kernel *k = s->k;
  const int e = k->neta, n = k->nn, a = k->active;
  double *D = TR_A(s, dn), *N = TR_A(s, NN), v[e], less[e], N0[n], N1[n], borne[e + a], acc[e + a], law[e], large = NO_LOAD, size = 0.0;
  if (!s->step.recursive || s->step.mapped || !tr_factor_without_friction(s)) return -1.0;
  k->laws(N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, law, D, TR_A(s, sliding));
  memset(less, 0, sizeof less);
  k->respond(TR_A(s, c), TR_A(s, w), less, N0, borne, acc);
  for (int i = 0; i < n; ++i) large = fmax(large, fabs(N0[i]));
  for (int i = 0; i < e; ++i) v[i] = 1.0 + 0.1 * i;
  for (int it = 0; it < CONTRACTS; ++it) {
    double len = 0.0, was = 0.0, most = 0.0;
    for (int i = 0; i < e; ++i) most = fmax(most, fabs(v[i])), was += v[i] * v[i];
    if (!(was > 0.0)) return 0.0;
    for (int i = 0; i < e; ++i) less[i] = -v[i] * large / most; /* scaled so that round-off does not hide the effect of v */
    k->respond(TR_A(s, c), TR_A(s, w), less, N1, borne, acc);
    for (int m = 0; m < k->nelements; ++m) {
      const tr_element *el = k->element + m;
      for (int j = 0; j < el->neta; ++j) {
        double u = 0.0;
        for (int q = 0; q < el->needs; ++q) u += D[el->dn0 + j + q * el->neta] * (N1[el->n0 + q] - N0[el->n0 + q]);
        v[el->eta0 + j] = tr_row_kind(s, el->eta0 + j) == TR_ROW_LAW ? u * most / large : 0.0;
      }
    }
    for (int i = 0; i < e; ++i) len += v[i] * v[i];
    if (!(len > 0.0)) return 0.0;
    size = sqrt(len / was);
    for (int i = 0; i < e; ++i) v[i] /= sqrt(len);
  }
  return size;
}

static double tr_contraction(tr_sim *s) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  double *J = TR_A(s, lu), v[e + 1], u[e + 1], size = k->begin ? tr_contraction_recursive(s) : -1.0;
  if (!e) return 0.0;
  TR_NEED(s, TR_HAS_SOLUTION);
  if (size >= 0.0) return size;
  tr_evaluate_laws(s, TR_A(s, z) + k->active);
  tr_form_law_jacobian(s);
  for (int i = 0; i < e; ++i) v[i] = 1.0 + 0.1 * i;
  for (int it = 0; it < CONTRACTS; ++it) {
    double len = 0.0, was = 0.0;
    for (int i = 0; i < e; ++i) {
      u[i] = v[i];
      for (int j = 0; j < e; ++j) u[i] -= J[i + j * e] * v[j];
      if (tr_row_kinds(s)[i] != TR_ROW_LAW && s->friction.held) u[i] = 0.0;
      len += u[i] * u[i], was += v[i] * v[i];
    }
    if (!(len > 0.0) || !(was > 0.0)) return 0.0;
    size = sqrt(len / was);
    for (int i = 0; i < e; ++i) v[i] = u[i] / sqrt(len);
  }
  return size;
}

static void tr_certify(tr_sim *s) {
  s->audit.contraction = fmax(s->audit.contraction, tr_contraction(s));
  s->audit.complement = fmax(s->audit.complement, tr_complement_residual(s));
}

void tr_certify_run(tr_sim *s, tr_certificate *out) {
  s->step.watch = 0;
  if (s->k->neta && tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) tr_certify(s);
  *out = (tr_certificate){.contraction = s->audit.contraction, .complement = s->audit.complement, .open_time = s->audit.open_t,
                          .open_pair = s->audit.open_pair, .stepped = s->moreau.first_t, .dead_centre = s->audit.dead_t};
}

/* Find a root, starting from the frictions in z. Requires row kinds and maps. */
static int tr_find_root(tr_sim *s) { return tr_is_recursive(s) ? tr_newton_recursive_from(s, 0, -1) : tr_newton(s, TR_A(s, z) + s->k->active); }

/* Largest load without friction, N, which is the scale of the starts. */
static double tr_load_without_friction(tr_sim *s) {
  const double *N = TR_A(s, Np);
  double most = NO_LOAD;
  if (tr_is_recursive(s)) {
    double *eta = TR_A(s, z) + s->k->active;
    memset(eta, 0, sizeof(double) * s->k->neta);
    if (!tr_loads_by_recursion(s, eta)) return most;
    N = tr_stored_loads(s);
  }
  for (int i = 0; i < s->k->nn; ++i) most = fmax(most, fabs(N[i]));
  return most;
}

int tr_roots(tr_sim *s) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, count = 0, most = 8;
  double *eta = TR_A(s, z) + a, found[8 * e + 1], z[tr_z_length(s) + 1];
  unsigned seed = 12345u;
  if (!e) return 1;
  memcpy(z, TR_A(s, z), sizeof(double) * tr_z_length(s)); /* multipliers with which the run continues */
  s->step.watch = 0;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  if (k->sets) tr_set_row_kinds(s);
  if (!tr_is_recursive(s)) tr_form_maps_without_loops(s, s->friction.held);
  const double scale = tr_load_without_friction(s);
  for (int start = 0; start < 64 && count < most; ++start) {
    double reach = start == 0 ? 0.0 : scale * pow(10.0, (start % 8) - 4.0);
    for (int i = 0; i < e; ++i) eta[i] = reach * tr_next_random(&seed);
    if (!tr_find_root(s)) continue;
    int known = 0;
    for (int q = 0; q < count && !known; ++q) {
      double gap = 0.0, size = 0.0;
      for (int i = 0; i < e; ++i) gap = fmax(gap, fabs(eta[i] - found[q * e + i])), size = fmax(size, fabs(eta[i]));
      known = gap <= SAME_ROOT * size + SAME_AS_NONE * scale; /* the second term covers roots that are zero up to round-off */
    }
    if (!known) memcpy(found + e * count++, eta, sizeof(double) * e);
  }
  memcpy(TR_A(s, z), z, sizeof(double) * tr_z_length(s));
  s->step.recursive = 0;
  return count;
}
