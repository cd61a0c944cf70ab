/* Certificates of a solution (theory, "Certificate"): contraction of the fixed-point iteration, residual of the complement
 * equations, number of roots. */
#include "checks/checks.h"

#define KRYLOV 64       /* largest dimension of the Krylov subspace */
#define KRYLOV_FIRST 5  /* dimension at which the error of the spectral radius is estimated first */
/* relative to the spectral radius: the subspace grows while the estimated error is larger; the error itself is smaller than 1e-4 */
#define CLOSE_RADIUS 1e-5
#define INVARIANT 1e-10    /* relative to the image of a vector: a smaller part outside the subspace is round-off */
/* relative to the norm of a power of a matrix: at a smaller distance from rank 1, the spectral radius no longer changes */
#define ONE_DIRECTION 1e-9
/* number of squarings: the 2^30th root of the norm of the 2^30th power equals the spectral radius within 1e-8 */
#define SQUARINGS 30
#define SAME_ROOT 1e-7     /* relative to the largest friction of a root: closer roots are equal */
/* relative to the largest load: roots within this distance are equal; covers a root that is zero up to round-off */
#define SAME_AS_NONE 1e-14

/* The fixed-point iteration of the linearised laws. N (nn): loads of the solution; null pointer: the matrix of Newton's method is
 * used. large: largest absolute value in N. */
typedef struct {
  const double *N;
  double large;
} tr_iteration;

/* Lever of friction i. Frictions of the iteration are surface forces, so that torques of small joints count as much as forces. */
static inline double tr_lever_of(const tr_sim *s, int i) { return TR_A(s, lever)[i] > 0.0 ? TR_A(s, lever)[i] : 1.0; }

/* u ← law'(N) R v, where R is the response of the loads N to frictions. A pass over the bodies gives R v. */
static void tr_iterate_recursive(tr_sim *s, const tr_iteration *it, const double *v, double *u) {
  const tr_kernel *k = s->k;
  const int e = k->neta;
  double less[e], N[k->nn], borne[e + k->active], acc[e + k->active], *D = TR_A(s, dn), most = 0.0;
  for (int i = 0; i < e; ++i) most = fmax(most, fabs(v[i]));
  /* the scale makes the effect of v larger than round-off */
  for (int i = 0; i < e; ++i) less[i] = -TR_A(s, z)[k->active + i] - v[i] * it->large / most;
  k->respond(TR_A(s, c), TR_A(s, w), less, N, borne, acc);
  for (int m = 0; m < k->nelements; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j) {
      double sum = 0.0;
      for (int q = 0; q < el->needs; ++q) sum += D[el->dn0 + j + q * el->neta] * (N[el->n0 + q] - it->N[el->n0 + q]);
      u[el->eta0 + j] = tr_row_kind(s, el->eta0 + j) == TR_ROW_LAW ? sum * most / it->large : 0.0;
    }
  }
}

/* u ← law'(N) R v. */
static void tr_iterate(tr_sim *s, const tr_iteration *it, const double *v, double *u) {
  const int e = s->k->neta;
  double eta[e];
  for (int i = 0; i < e; ++i) eta[i] = v[i] * tr_lever_of(s, i);
  if (it->N) {
    tr_iterate_recursive(s, it, eta, u);
  } else {
    memcpy(u, eta, sizeof eta);
    tr_add_columns(e, e, TR_A(s, lu), eta, -1.0, u);
    for (int i = 0; i < e && s->friction.held; ++i)
      if (tr_row_kinds(s)[i] != TR_ROW_LAW) u[i] = 0.0;
  }
  for (int i = 0; i < e; ++i) u[i] /= tr_lever_of(s, i);
}

/* square ← P² (n columns of length w, a multiple of TR_LANES). Returns its Frobenius norm. off: distance of P from rank 1, measured
 * as the norm of the square minus the trace times P. */
static double tr_square(int n, int w, const double *P, double trace, double *square, double *off) {
  double size[TR_LANES] = {0.0}, far[TR_LANES] = {0.0}, sizes = 0.0, fars = 0.0;
  for (int j = 0; j < n; ++j)
    for (int b = 0; b < w; b += TR_LANES) {
      tr_vec sum = *(const tr_vec *)(P + b) * P[j * w];
      for (int m = 1; m < n; ++m) sum += *(const tr_vec *)(P + b + m * w) * P[m + j * w];
      const tr_vec gap = sum - *(const tr_vec *)(P + b + j * w) * trace;
      *(tr_vec *)(square + b + j * w) = sum;
      *(tr_vec *)size += sum * sum, *(tr_vec *)far += gap * gap;
    }
  for (int i = 0; i < TR_LANES; ++i) sizes += size[i], fars += far[i];
  *off = sqrt(fars);
  return sqrt(sizes);
}

/* Spectral radius of the first n rows and columns of H (Hessenberg, columns of length KRYLOV), by squaring. The power of H is stored
 * as a power of 2 times a matrix P with entries near 1. The root of the power is taken once, at the end. last: share of the last
 * basis vector in the eigenvector, times the condition number of the eigenvalue. In a power of rank 1, the last row has this share,
 * and the trace is the product of the left and the right eigenvector. */
static double tr_spectral_radius(int n, const double *H, double *last) {
  const int w = (n + TR_LANES - 1) / TR_LANES * TR_LANES;
  double exponent = 0.0, power = 1.0, norm = 0.0, trace = 0.0, row = 0.0, off = INFINITY;
  double P[KRYLOV * KRYLOV], square[KRYLOV * KRYLOV];
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < w; ++i) {
      P[i + j * w] = i < n && i <= j + 1 ? H[i + KRYLOV * j] : 0.0;
      norm = tr_max_or_nan(norm, fabs(P[i + j * w]));
    }
  for (int k = 0; k < SQUARINGS && norm > 0.0 && norm < INFINITY; ++k, power *= 0.5) {
    int shift;
    frexp(norm, &shift);
    const double unit = ldexp(1.0, -shift);
    exponent += shift * power;
    for (int i = 0; i < w * n; ++i) P[i] *= unit;
    trace = 0.0;
    for (int i = 0; i < n; ++i) trace += P[i + w * i];
    norm = tr_square(n, w, P, trace, square, &off);
    if (off <= ONE_DIRECTION * norm) break;
    memcpy(P, square, sizeof(double) * w * n);
  }
  for (int i = 0; i < n; ++i) row += P[n - 1 + w * i] * P[n - 1 + w * i];
  *last = sqrt(row) / fabs(trace);
  if (!(norm > 0.0 && norm < INFINITY)) return norm;
  /* in a power of rank 1, the nonzero eigenvalue is the trace */
  return pow(2.0, exponent) * pow(off <= ONE_DIRECTION * norm ? fabs(trace) : norm, power);
}

/* Spectral radius of the iteration. Arnoldi's method restricts the iteration to a Krylov space with an orthonormal basis. The space
 * grows until the radius of the restriction H is that of the iteration. The start has the signs of the frictions, as most dominant
 * eigenvectors have. Its sizes are unequal, so that it has a part in eigenvectors of symmetric mechanisms. They do not depend on the
 * sizes of the frictions, because a small mechanism beside a large one may have the larger radius. */
static double tr_iteration_radius(tr_sim *s, const tr_iteration *it) {
  const int e = s->k->neta;
  const double *eta = TR_A(s, z) + s->k->active;
  double H[KRYLOV * KRYLOV], basis[KRYLOV * e + 1], u[e + 1], size = 0.0, last;
  for (int i = 0; i < e; ++i) basis[i] = copysign(1.0 + 0.1 * i, eta[i]), size += basis[i] * basis[i];
  for (int i = 0; i < e; ++i) basis[i] /= sqrt(size);
  for (int n = 1, next = KRYLOV_FIRST;; ++n) {
    tr_iterate(s, it, basis + (n - 1) * e, u);
    const double image = sqrt(tr_dot(u, u, e));
    for (int m = 0; m < n; ++m) {
      const double *b = basis + m * e, along = H[m + KRYLOV * (n - 1)] = tr_dot(b, u, e);
      for (int i = 0; i < e; ++i) u[i] -= along * b[i];
    }
    const double rest = sqrt(tr_dot(u, u, e));
    const int whole = n == KRYLOV || n == e || !(rest > INVARIANT * image);
    if (whole || n == next) {
      const double radius = tr_spectral_radius(n, H, &last);
      if (whole || rest * last <= CLOSE_RADIUS * radius) return radius;
      next = n + 1 + n / 5;
    }
    H[n + KRYLOV * (n - 1)] = rest;
    for (int i = 0; i < e; ++i) basis[n * e + i] = u[i] / rest;
  }
}

static double tr_contraction(tr_sim *s) {
  const tr_kernel *k = s->k;
  double law[k->neta + 1], *N = TR_A(s, NN);
  tr_iteration it = {0, NO_LOAD};
  if (!k->neta) return 0.0;
  TR_NEED(s, TR_HAS_SOLUTION);
  if (k->begin && s->step.recursive && !s->step.mapped && tr_factor_without_friction(s)) {
    k->laws(N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, law, TR_A(s, dn), TR_A(s, sliding));
    for (int i = 0; i < k->nn; ++i) it.large = fmax(it.large, fabs(N[i]));
    it.N = N;
  } else {
    tr_evaluate_laws(s, TR_A(s, z) + k->active);
    tr_form_law_jacobian(s);
  }
  return tr_iteration_radius(s, &it);
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
