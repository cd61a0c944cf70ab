/* Certificates of a solution (theory, "Certificate"): contraction of the fixed-point iteration, residual of the complement
 * equations, number of roots. */
#include "checks/checks.h"

/* dimension of the Krylov subspace. The contraction is exact with up to 8 frictions, otherwise an estimate (theory,
 * "Verification"). */
#define KRYLOV 8
#define INVARIANT 1e-10    /* relative to the image of a vector: a smaller part outside the subspace is round-off */
/* relative to the norm of a power of a matrix: at a smaller distance from rank 1, the spectral radius no longer changes */
#define ONE_DIRECTION 1e-9
/* number of squarings: the 2^30th root of the norm of the 2^30th power equals the spectral radius within 1e-8 */
#define SQUARINGS 30
#define SAME_ROOT 1e-7     /* relative to the largest friction of a root: closer roots are equal */
/* relative to the largest load: roots within this distance are equal; covers a root that is zero up to round-off */
#define SAME_AS_NONE 1e-14

/* The fixed-point iteration of the linearised laws. N0 (nn): loads without friction, N; null pointer: the matrix of Newton's method
 * is used. large: largest absolute value in N0. */
typedef struct {
  const double *N0;
  double large;
} tr_iteration;

/* u ← law'(N) R v, where R is the response of the loads N to frictions. A pass over the bodies gives R v. */
static void tr_iterate_recursive(tr_sim *s, const tr_iteration *it, const double *v, double *u) {
  const tr_kernel *k = s->k;
  const int e = k->neta;
  double less[e], N[k->nn], borne[e + k->active], acc[e + k->active], *D = TR_A(s, dn), most = 0.0;
  for (int i = 0; i < e; ++i) most = fmax(most, fabs(v[i]));
  for (int i = 0; i < e; ++i) less[i] = -v[i] * it->large / most; /* the scale makes the effect of v larger than round-off */
  k->respond(TR_A(s, c), TR_A(s, w), less, N, borne, acc);
  for (int m = 0; m < k->nelements; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j) {
      double sum = 0.0;
      for (int q = 0; q < el->needs; ++q) sum += D[el->dn0 + j + q * el->neta] * (N[el->n0 + q] - it->N0[el->n0 + q]);
      u[el->eta0 + j] = tr_row_kind(s, el->eta0 + j) == TR_ROW_LAW ? sum * most / it->large : 0.0;
    }
  }
}

/* u ← law'(N) R v. */
static void tr_iterate(tr_sim *s, const tr_iteration *it, const double *v, double *u) {
  const int e = s->k->neta;
  if (it->N0) {
    tr_iterate_recursive(s, it, v, u);
    return;
  }
  memcpy(u, v, sizeof(double) * e);
  tr_add_columns(e, e, TR_A(s, lu), v, -1.0, u);
  for (int i = 0; i < e && s->friction.held; ++i)
    if (tr_row_kinds(s)[i] != TR_ROW_LAW) u[i] = 0.0;
}

/* Arnoldi's method: H (KRYLOV × KRYLOV) ← the iteration on an orthonormal basis of a Krylov space. Returns the dimension. */
static int tr_restrict_iteration(tr_sim *s, const tr_iteration *it, double *H) {
  const int e = s->k->neta;
  double basis[KRYLOV * e + 1], u[e + 1], size = 0.0;
  for (int i = 0; i < e; ++i) basis[i] = 1.0 + 0.1 * i, size += basis[i] * basis[i];
  for (int i = 0; i < e; ++i) basis[i] /= sqrt(size);
  for (int n = 0; n < KRYLOV; ++n) {
    tr_iterate(s, it, basis + n * e, u);
    const double image = sqrt(tr_dot(u, u, e));
    for (int m = 0; m <= n; ++m) {
      const double *b = basis + m * e, along = H[m + KRYLOV * n] = tr_dot(b, u, e);
      for (int i = 0; i < e; ++i) u[i] -= along * b[i];
    }
    const double rest = sqrt(tr_dot(u, u, e));
    if (n + 1 == KRYLOV || n + 1 == e || !(rest > INVARIANT * image)) return n + 1;
    H[n + 1 + KRYLOV * n] = rest;
    for (int i = 0; i < e; ++i) basis[(n + 1) * e + i] = u[i] / rest;
  }
  return KRYLOV;
}

/* Spectral radius of H (n × n, columns of length KRYLOV), by squaring. Overwrites H. The power of H is stored as a power of 2 times
 * a matrix with entries near 1. The root of the power is taken once, at the end. */
static double tr_spectral_radius(int n, double *H) {
  double exponent = 0.0, power = 1.0, norm = 0.0, trace = 0.0;
  for (int k = 0;; ++k, power *= 0.5) {
    double square[KRYLOV * KRYLOV], off = 0.0, size = 0.0;
    int shift;
    norm = trace = 0.0;
    for (int i = 0; i < n; ++i) trace += H[i + KRYLOV * i];
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) norm = tr_max_or_nan(norm, fabs(H[i + KRYLOV * j]));
    if (!(norm > 0.0 && norm < INFINITY)) return norm;
    if (k == SQUARINGS) return pow(2.0, exponent) * pow(norm, power);
    frexp(norm, &shift);
    const double unit = ldexp(1.0, -shift);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        double sum = 0.0;
        for (int m = 0; m < n; ++m) sum += unit * H[i + KRYLOV * m] * (unit * H[m + KRYLOV * j]);
        square[i + KRYLOV * j] = sum;
        size = fmax(size, fabs(sum)), off = fmax(off, fabs(sum - unit * trace * (unit * H[i + KRYLOV * j])));
      }
    if (off <= ONE_DIRECTION * size) return pow(2.0, exponent) * pow(fabs(trace), power); /* the nonzero eigenvalue is the trace */
    exponent += shift * power;
    for (int j = 0; j < n; ++j) memcpy(H + KRYLOV * j, square + KRYLOV * j, sizeof(double) * n);
  }
}

static double tr_contraction(tr_sim *s) {
  const tr_kernel *k = s->k;
  const int e = k->neta, n = k->nn;
  double H[KRYLOV * KRYLOV] = {0.0}, N0[n + 1], law[e + 1], less[e + 1], borne[e + k->active + 1], acc[e + k->active + 1];
  tr_iteration it = {0, NO_LOAD};
  if (!e) return 0.0;
  TR_NEED(s, TR_HAS_SOLUTION);
  if (k->begin && s->step.recursive && !s->step.mapped && tr_factor_without_friction(s)) {
    k->laws(TR_A(s, NN), map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, law, TR_A(s, dn), TR_A(s, sliding));
    memset(less, 0, sizeof less);
    k->respond(TR_A(s, c), TR_A(s, w), less, N0, borne, acc);
    for (int i = 0; i < n; ++i) it.large = fmax(it.large, fabs(N0[i]));
    it.N0 = N0;
  } else {
    tr_evaluate_laws(s, TR_A(s, z) + k->active);
    tr_form_law_jacobian(s);
  }
  const int dimension = tr_restrict_iteration(s, &it, H);
  return tr_spectral_radius(dimension, H);
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
  memcpy(z, TR_A(s, z), sizeof(double) * tr_z_length(s)); /* stores the multipliers, because the run continues with them */
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
