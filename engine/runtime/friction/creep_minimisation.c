/* Friction at rest of any number of pairs as one minimisation (theory, "Many pairs").
 *
 * With fixed loads the problem is convex: minimise ½|w − w₀|² + Σ cap |x| over w. w contains the accelerations in the metric of the
 * masses, and w₀ the accelerations without friction. x = B w contains the surface accelerations of the pairs, and cap the
 * capacities of the pairs. The minimum is the limit ε → 0 of creeping friction, cap x/√(x² + ε²). Newton's method solves the
 * problem for a decreasing sequence of ε. For each ε, it starts from the last result. The line search on the convex objective
 * always succeeds. Each iteration updates the loads. The result is only a start for the exact equations; their solution is then
 * checked against the laws. The maps are the only data of the mechanism. */
#include "friction/friction.h"

#define CREEP_NEXT 0.05 /* ratio of successive ε; the first ε is the acceleration that the pair's own friction causes */
#define CREEP_LAST 1e-10 /* last ε, relative to the first ε */
#define CREEP_STEPS 5 /* largest number of Newton steps for each ε but the last */
#define CREEP_STEPS_LAST 40 /* largest number of Newton steps for the last ε */
#define CREEP_FOUND 1e-10 /* relative to the friction: if a Newton step changes friction by less, the iteration has converged */
#define CREEP_HALVES 20 /* largest number of halvings of a step until the objective decreases */
#define CREEP_SLOPE 1e-4 /* relative to the decrease predicted by the slope: smallest accepted decrease (Armijo) */

static void tr_creep_collect_multipliers(const tr_sim *s, tr_creep_problem *c) {
  c->m = 0;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    c->first[q] = c->m;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
      if (!tr_is_prescribed(s, i)) c->index[c->m++] = i;
  }
  c->first[c->n] = c->m;
}

static void tr_creep_factor_responses(const tr_sim *s, tr_creep_problem *c) {
  const int m = c->m;
  const double *lever = TR_A(s, lever);
  double A[m * m + 1], L[m * m + 1], d[m + 1];
  int perm[m + 1];
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < m; ++i) A[i + j * m] = tr_freedom_response(s, c->index[i], c->index[j]) * lever[c->index[i]] * lever[c->index[j]];
  for (int i = 0; i < m; ++i) d[i] = tr_response_scale(s, c->index[i], tr_freedom_response(s, c->index[i], c->index[i])) / lever[c->index[i]];
  c->r = tr_cholesky(m, A, d, L, perm, 0, RANK_PIVOT, RANK_PIVOT);
  for (int i = 0; i < m; ++i)
    for (int k = 0; k < c->r; ++k) c->B[perm[i] * c->r + k] = k <= i ? L[i + k * m] / d[perm[i]] : 0.0;
  for (int k = 0; k < c->r; ++k) c->lead[k] = perm[k];
}

/* Compute w₀, the accelerations without the friction of the problem's pairs. Other pairs have their friction from z. */
static void tr_creep_free_accelerations(tr_sim *s, tr_creep_problem *c) {
  tr_form_all_maps(s);
  const int e = s->k->neta;
  double others[e];
  memcpy(others, TR_A(s, z) + s->k->active, sizeof others);
  for (int i = 0; i < c->m; ++i) others[c->index[i]] = 0.0;
  for (int k = 0; k < c->r; ++k) {
    const double *row = c->B + c->lead[k] * c->r;
    const int i = c->index[c->lead[k]];
    double acc = tr_held_acceleration(s, i, others) * TR_A(s, lever)[i];
    for (int p = 0; p < k; ++p) acc -= row[p] * c->w0[p];
    c->w0[k] = acc / row[k];
  }
}

/* Set ε of every pair to `part` times the acceleration that its own friction causes. */
static void tr_creep_set_epsilon(tr_creep_problem *c, double part) {
  for (int q = 0; q < c->n; ++q) {
    double own = 0.0;
    for (int i = c->first[q] * c->r; i < c->first[q + 1] * c->r; ++i) own += c->B[i] * c->B[i];
    c->eps[q] = fmax(part * c->cap[q] * own, NO_CAPACITY);
  }
}

/* Remove from x of pair q the component that friction does not oppose: for a ball, the component along its force. */
static void tr_creep_project_ball(const tr_sim *s, const tr_creep_problem *c, int q, double *x) {
  const double *f = TR_A(s, NN) + s->k->element[tr_pair_of(s, c->pairs[q])->element].n0;
  double F = f[0] * f[0] + f[1] * f[1] + f[2] * f[2], along;
  if (!tr_pair_of(s, c->pairs[q])->cone || c->first[q + 1] - c->first[q] < 3 || !(F > 0.0)) return;
  along = (f[0] * x[0] + f[1] * x[1] + f[2] * x[2]) / F;
  for (int j = 0; j < 3; ++j) x[j] -= along * f[j];
}

/* Surface accelerations x = B w of all pairs. across: whether the result contains, for a ball, only the components perpendicular to
 * its force. */
static void tr_creep_surface_accelerations(const tr_sim *s, const tr_creep_problem *c, const double *w, int across, double *x) {
  for (int i = 0; i < c->m; ++i) {
    x[i] = 0.0;
    for (int k = 0; k < c->r; ++k) x[i] += c->B[i * c->r + k] * w[k];
  }
  for (int q = 0; q < c->n && across; ++q) tr_creep_project_ball(s, c, q, x + c->first[q]);
}

/* √(x² + ε²) of pair q. */
static double tr_creep_smoothed_size(const tr_creep_problem *c, int q) {
  double sum = c->eps[q] * c->eps[q];
  for (int i = c->first[q]; i < c->first[q + 1]; ++i) sum += c->x[i] * c->x[i];
  return sqrt(sum);
}

/* The objective at w. Writes the surface accelerations to c->x. */
static double tr_creep_objective(const tr_sim *s, tr_creep_problem *c, const double *w) {
  double sum = 0.0;
  tr_creep_surface_accelerations(s, c, w, 1, c->x);
  for (int k = 0; k < c->r; ++k) sum += 0.5 * (w[k] - c->w0[k]) * (w[k] - c->w0[k]);
  for (int q = 0; q < c->n; ++q) sum += c->cap[q] * tr_creep_smoothed_size(c, q);
  return sum;
}

/* Add Σ left_i right_iᵀ, a sum of `many` terms, to the lower triangle of H (r rows, column-major). Each vector has v entries; the
 * entries from index `wide` on are zero. */
static void tr_creep_add_products(int r, int wide, int many, int v, const double *left, const double *right, double *H) {
  for (int p = 0; p < wide; ++p) {
    double *column = H + (size_t)p * r;
    for (int k = p; k < wide; k += TR_LANES) {
      tr_vec sum = *(tr_vec *)(column + k);
      for (int i = 0; i < many; ++i) sum += left[i * v + p] * *(const tr_vec *)(right + i * v + k);
      *(tr_vec *)(column + k) = sum;
    }
  }
}

/* Write the rows of B of pair q to P (v entries each), projected if the pair is a ball. Returns the number of entries after which
 * all rows are zero. */
static int tr_creep_rows(const tr_sim *s, const tr_creep_problem *c, int q, int v, double *P) {
  const int first = c->first[q], n = c->first[q + 1] - first;
  int wide = 0;
  double column[3];
  memset(P, 0, sizeof(double) * n * v);
  for (int k = 0; k < c->r; ++k) {
    for (int i = 0; i < n; ++i) {
      column[i] = c->B[(first + i) * c->r + k];
      if (column[i] != 0.0) wide = k + 1;
    }
    tr_creep_project_ball(s, c, q, column);
    for (int i = 0; i < n; ++i) P[i * v + k] = column[i];
  }
  return wide;
}

/* Gradient g and Hessian H of the objective at w. H (r×r, column-major) is stored as its lower triangle, with room for one SIMD
 * vector behind it. */
static void tr_creep_gradient_hessian(const tr_sim *s, const tr_creep_problem *c, double *g, double *H) {
  const int r = c->r, v = TR_PAD(r) + 4;
  double right[5 * v], left[5 * v], *U = right + 3 * v, *X = right + 4 * v;
  memset(H, 0, sizeof(double) * r * r);
  memset(right, 0, sizeof right);
  for (int k = 0; k < r; ++k) g[k] = c->w[k] - c->w0[k], H[k + k * r] = 1.0;
  for (int q = 0; q < c->n; ++q) {
    const int first = c->first[q], n = c->first[q + 1] - first, wide = tr_creep_rows(s, c, q, v, right);
    const double speed = tr_creep_smoothed_size(c, q), stiff = c->cap[q] / speed;
    /* for one component: factor of the curvature */
    const double turned = n == 1 ? 1.0 - c->u[first] * c->x[first] / (c->cap[q] * speed) : 1.0;
    for (int k = 0; k < wide; ++k) {
      U[k] = X[k] = 0.0;
      for (int i = 0; i < n; ++i) {
        U[k] += right[i * v + k] * c->u[first + i] / c->cap[q], X[k] += right[i * v + k] * c->x[first + i] / speed;
        left[i * v + k] = stiff * turned * right[i * v + k];
      }
      g[k] += c->cap[q] * X[k];
      left[3 * v + k] = -0.5 * stiff * X[k], left[4 * v + k] = -0.5 * stiff * U[k];
    }
    for (int k = wide; k < v; ++k) U[k] = X[k] = 0.0;
    tr_creep_add_products(r, wide, n, v, left, right, H);
    if (n > 1) tr_creep_add_products(r, wide, 2, v, left + 3 * v, U, H);
  }
}

/* Update the frictions for the change dw of w, by the linearised equations and within the capacities. */
static void tr_creep_update_frictions(const tr_sim *s, tr_creep_problem *c, const double *dw) {
  double dx[c->m + 1];
  tr_creep_surface_accelerations(s, c, dw, 1, dx);
  for (int q = 0; q < c->n; ++q) {
    const double speed = tr_creep_smoothed_size(c, q), stiff = c->cap[q] / speed;
    double along = 0.0, size = 0.0;
    for (int i = c->first[q]; i < c->first[q + 1]; ++i) along += c->x[i] * dx[i] / speed;
    for (int i = c->first[q]; i < c->first[q + 1]; ++i) {
      c->u[i] = stiff * (c->x[i] + dx[i]) - c->u[i] / speed * along;
      size += c->u[i] * c->u[i];
    }
    size = sqrt(size) / c->cap[q];
    for (int i = c->first[q]; i < c->first[q + 1] && size > 1.0; ++i) c->u[i] /= size;
  }
}

/* Write the frictions into z. */
static void tr_creep_store_frictions(tr_sim *s, const tr_creep_problem *c) {
  for (int i = 0; i < c->m; ++i) TR_A(s, z)[s->k->active + c->index[i]] = c->u[i] * TR_A(s, lever)[c->index[i]];
}

/* Evaluate loads and capacities at the frictions in z. law[i] = 1: multiplier i belongs to a sliding pair, and gets the friction of
 * its law. */
static void tr_creep_update_loads(tr_sim *s, tr_creep_problem *c, const int *law) {
  const tr_kernel *k = s->k;
  double *eta = TR_A(s, z) + k->active;
  tr_evaluate_laws(s, eta);
  for (int i = 0; i < k->neta; ++i)
    if (law[i]) eta[i] = TR_A(s, law)[i];
  tr_evaluate_capacities(s);
  for (int q = 0; q < c->n; ++q) c->cap[q] = fmax(c->share * tr_hold_of(s, c->pairs[q])->capacity, NO_CAPACITY);
}

/* One primal-dual Newton step on w and u, after Chan, Golub and Mulet (1999), who minimise a similar sum of norms. Newton steps on
 * w alone would converge slowly for small ε. */
static void tr_creep_step(tr_sim *s, tr_creep_problem *c) {
  const int r = c->r;
  double H[r * r + 4], L[r * r + 1], g[r + 1], dw[r + 1], d[r + 1], w[r + 1], slope = 0.0, cut = 1.0;
  int perm[r + 1];
  const double sum = tr_creep_objective(s, c, c->w);
  tr_creep_gradient_hessian(s, c, g, H);
  for (int k = 0; k < r; ++k) d[k] = 1.0 / sqrt(H[k + k * r]);
  const int rank = tr_cholesky(r, H, d, L, perm, 0, 0.0, 0.0);
  tr_cholesky_solve(r, rank, L, perm, d, g, dw);
  for (int k = 0; k < r; ++k) slope += g[k] * dw[k];
  for (int half = 0; half < CREEP_HALVES; ++half, cut *= 0.5) {
    for (int k = 0; k < r; ++k) w[k] = c->w[k] - cut * dw[k];
    if (tr_creep_objective(s, c, w) <= sum - CREEP_SLOPE * cut * slope) break;
  }
  for (int k = 0; k < r; ++k) dw[k] = w[k] - c->w[k];
  tr_creep_surface_accelerations(s, c, c->w, 1, c->x);
  tr_creep_update_frictions(s, c, dw);
  memcpy(c->w, w, sizeof(double) * r);
}

static void tr_creep_minimise(tr_sim *s, tr_creep_problem *c, const int *law) {
  double *eta = TR_A(s, z) + s->k->active, old[s->k->neta + 1];
  tr_creep_update_loads(s, c, law);
  tr_creep_free_accelerations(s, c);
  memcpy(c->w, c->w0, sizeof(double) * c->r);
  memset(c->u, 0, sizeof(double) * c->m);
  for (double part = 1.0; part >= CREEP_LAST; part *= CREEP_NEXT) {
    const int last = part * CREEP_NEXT < CREEP_LAST;
    tr_creep_set_epsilon(c, part);
    for (int it = 0; it < (last ? CREEP_STEPS_LAST : CREEP_STEPS) && !tr_is_cancelled(s, (double)c->r * c->r * (c->m + c->r)); ++it) {
      double changed = 0.0, size = 0.0;
      memcpy(old, eta, sizeof(double) * s->k->neta);
      tr_creep_step(s, c);
      tr_creep_store_frictions(s, c);
      tr_creep_update_loads(s, c, law);
      tr_creep_free_accelerations(s, c);
      for (int i = 0; i < s->k->neta; ++i) {
        changed = fmax(changed, fabs(eta[i] - old[i]) / TR_A(s, lever)[i]), size = fmax(size, fabs(eta[i]) / TR_A(s, lever)[i]);
      }
      s->stats.creeps++;
      if (changed <= CREEP_FOUND * size) break;
    }
  }
  tr_creep_surface_accelerations(s, c, c->w, 0, c->x);
}
