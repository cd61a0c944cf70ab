/* Friction at rest as one problem for any number of pairs (METHOD, "Many pairs").
 *
 * With the loads as they are it is convex: of all accelerations of the mechanism those are sought that minimise ½|w − w₀|² + Σ cap |x|, w the
 * accelerations in the metric of the masses (w₀: those without friction), x = B w those at the surface of a pair. The minimum is the limit of
 * friction that creeps, cap x/√(x² + ε²), for ε → 0, and is followed along that path by Newton's method with a line search on the convex
 * sum, which cannot fail; loads are taken anew in each iteration. What comes of it is no answer before the exact equations have been solved and
 * the laws have been looked at. The mechanism is seen through its maps alone. */
#include "modes.h"

#define CREEP_NEXT 0.05     /* each ε over the one before; the first is what the pair's own friction at most accelerates, */
#define CREEP_LAST 1e-10    /* and the last this part of it */
#define CREEP_MOVES 1e3     /* times its last ε: a pair that accelerates by more slides (its friction is within 1e-6 of what it can hold) */
#define CREEP_STEPS 5       /* of Newton's method for each ε, which the next one continues; */
#define CREEP_STEPS_LAST 40 /* and for the last */
#define CREEP_FOUND 1e-10   /* of the friction: the last step of Newton's method changes no more */
#define CREEP_HALVES 20     /* of a step, until the sum decreases */
#define CREEP_SLOPE 1e-4    /* of what its slope promises: so much it has to decrease (Armijo) */

/* The problem. m: multipliers of the pairs it is about, r: freedoms they have. */
typedef struct tr_creeping {
  int n, m, r;
  const int *pairs; /* n */
  int *index;       /* m: multipliers */
  int *first;       /* n + 1: where each pair's begin among the m */
  int *lead;        /* r: those whose accelerations say all the others */
  double *B;        /* m×r, by rows */
  double *w0, *w;   /* r */
  double *x;        /* m: accelerations at the surfaces, for balls across their forces, m/s² */
  double *u;        /* m: frictions, N: an unknown beside w on the way, cap x/√(x² + ε²) at its end */
  double *cap;      /* n: capacities, N, of which may be used */
  double share;     /* this part */
  double *eps;      /* n: of each pair, m/s² */
} tr_creeping;

/* The multipliers of the pairs that are not prescribed. */
static void tr_creep_index(const tr_sim *s, tr_creeping *c) {
  c->m = 0;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    c->first[q] = c->m;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
      if (!tr_is_prescribed(s, i)) c->index[c->m++] = i;
  }
  c->first[c->n] = c->m;
}

/* B from the responses of the freedoms to friction. */
static void tr_creep_freedoms(const tr_sim *s, tr_creeping *c) {
  const int m = c->m;
  const double *arm = TR_A(s, arm);
  double A[m * m + 1], L[m * m + 1], d[m + 1];
  int perm[m + 1];
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < m; ++i) A[i + j * m] = tr_response(s, c->index[i], c->index[j]) * arm[c->index[i]] * arm[c->index[j]];
  for (int i = 0; i < m; ++i) d[i] = tr_response_unit(s, c->index[i], tr_response(s, c->index[i], c->index[i])) / arm[c->index[i]];
  c->r = tr_cholesky(m, A, d, L, perm, 0, GROUP_PIVOT, GROUP_PIVOT);
  for (int i = 0; i < m; ++i)
    for (int k = 0; k < c->r; ++k) c->B[perm[i] * c->r + k] = k <= i ? L[i + k * m] / d[perm[i]] : 0.0;
  for (int k = 0; k < c->r; ++k) c->lead[k] = perm[k];
}

/* w₀: what the pairs accelerate without their own friction, that of the others as it is in place. */
static void tr_creep_without(tr_sim *s, tr_creeping *c) {
  tr_form_all(s);
  const int e = s->k->neta;
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *eta = TR_A(s, z) + s->k->active;
  double others[e];
  memcpy(others, eta, sizeof others);
  for (int i = 0; i < c->m; ++i) others[c->index[i]] = 0.0;
  for (int k = 0; k < c->r; ++k) {
    const double *row = c->B + c->lead[k] * c->r;
    const int i = c->index[c->lead[k]];
    double acc = Q0[i];
    for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * others[j];
    acc *= TR_A(s, arm)[i];
    for (int p = 0; p < k; ++p) acc -= row[p] * c->w0[p];
    c->w0[k] = acc / row[k];
  }
}

/* ε of every pair: `part` of what its own friction at most accelerates. */
static void tr_creep_ease(tr_creeping *c, double part) {
  for (int q = 0; q < c->n; ++q) {
    double own = 0.0;
    for (int i = c->first[q] * c->r; i < c->first[q + 1] * c->r; ++i) own += c->B[i] * c->B[i];
    c->eps[q] = fmax(part * c->cap[q] * own, SHARE_NOTHING);
  }
}

/* What of x (of pair q) friction acts against: of a ball what is across the force on it. */
static void tr_creep_across(const tr_sim *s, const tr_creeping *c, int q, double *x) {
  const double *f = TR_A(s, NN) + s->k->element[tr_pair_of(s, c->pairs[q])->element].n0;
  double F = f[0] * f[0] + f[1] * f[1] + f[2] * f[2], along;
  if (!tr_pair_of(s, c->pairs[q])->cone || c->first[q + 1] - c->first[q] < 3 || !(F > 0.0)) return;
  along = (f[0] * x[0] + f[1] * x[1] + f[2] * x[2]) / F;
  for (int j = 0; j < 3; ++j) x[j] -= along * f[j];
}

/* The accelerations x of all pairs by w. */
static void tr_creep_surfaces(const tr_sim *s, const tr_creeping *c, const double *w, int across, double *x) {
  for (int i = 0; i < c->m; ++i) {
    x[i] = 0.0;
    for (int k = 0; k < c->r; ++k) x[i] += c->B[i * c->r + k] * w[k];
  }
  for (int q = 0; q < c->n && across; ++q) tr_creep_across(s, c, q, x + c->first[q]);
}

/* √(x² + ε²) of pair q. */
static double tr_creep_speed(const tr_creeping *c, int q) {
  double sum = c->eps[q] * c->eps[q];
  for (int i = c->first[q]; i < c->first[q + 1]; ++i) sum += c->x[i] * c->x[i];
  return sqrt(sum);
}

/* The sum at w, whose x is left in place. */
static double tr_creep_sum(const tr_sim *s, tr_creeping *c, const double *w) {
  double sum = 0.0;
  tr_creep_surfaces(s, c, w, 1, c->x);
  for (int k = 0; k < c->r; ++k) sum += 0.5 * (w[k] - c->w0[k]) * (w[k] - c->w0[k]);
  for (int q = 0; q < c->n; ++q) sum += c->cap[q] * tr_creep_speed(c, q);
  return sum;
}

/* Add Σ left_i right_iᵀ to the lower triangle of H (by columns, r rows) where both are not beyond `wide`; `many` vectors of `v`. */
static void tr_creep_add(int r, int wide, int many, int v, const double *left, const double *right, double *H) {
  for (int p = 0; p < wide; ++p) {
    double *column = H + (size_t)p * r;
    for (int k = p; k < wide; k += TR_LANES) {
      tr_vec sum = *(tr_vec *)(column + k);
      for (int i = 0; i < many; ++i) sum += left[i * v + p] * *(const tr_vec *)(right + i * v + k);
      *(tr_vec *)(column + k) = sum;
    }
  }
}

/* Rows of B of pair q, of a ball across the force on it, in P (each of v); how far they are not zero. */
static int tr_creep_rows(const tr_sim *s, const tr_creeping *c, int q, int v, double *P) {
  const int first = c->first[q], n = c->first[q + 1] - first;
  int wide = 0;
  double column[3];
  memset(P, 0, sizeof(double) * n * v);
  for (int k = 0; k < c->r; ++k) {
    for (int i = 0; i < n; ++i) {
      column[i] = c->B[(first + i) * c->r + k];
      if (column[i] != 0.0) wide = k + 1;
    }
    tr_creep_across(s, c, q, column);
    for (int i = 0; i < n; ++i) P[i * v + k] = column[i];
  }
  return wide;
}

/* Gradient g and matrix H (r×r, lower triangle by columns, a vector of room behind it) of the sum at w. */
static void tr_creep_slopes(const tr_sim *s, const tr_creeping *c, double *g, double *H) {
  const int r = c->r, v = TR_PAD(r) + 4;
  double right[5 * v], left[5 * v], *U = right + 3 * v, *X = right + 4 * v;
  memset(H, 0, sizeof(double) * r * r);
  memset(right, 0, sizeof right);
  for (int k = 0; k < r; ++k) g[k] = c->w[k] - c->w0[k], H[k + k * r] = 1.0;
  for (int q = 0; q < c->n; ++q) {
    const int first = c->first[q], n = c->first[q + 1] - first, wide = tr_creep_rows(s, c, q, v, right);
    const double speed = tr_creep_speed(c, q), stiff = c->cap[q] / speed;
    const double turned = n == 1 ? 1.0 - c->u[first] * c->x[first] / (c->cap[q] * speed) : 1.0; /* along a line all is one row */
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
    tr_creep_add(r, wide, n, v, left, right, H);
    if (n > 1) tr_creep_add(r, wide, 2, v, left + 3 * v, U, H);
  }
}

/* Frictions after w has moved by dw from where x is of: those of the linearised equations, but no more than the pairs can hold. */
static void tr_creep_follow(const tr_sim *s, tr_creeping *c, const double *dw) {
  double dx[c->m + 1];
  tr_creep_surfaces(s, c, dw, 1, dx);
  for (int q = 0; q < c->n; ++q) {
    const double speed = tr_creep_speed(c, q), stiff = c->cap[q] / speed;
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

/* The frictions put in place. */
static void tr_creep_frictions(tr_sim *s, const tr_creeping *c) {
  for (int i = 0; i < c->m; ++i) TR_A(s, z)[s->k->active + c->index[i]] = c->u[i] * TR_A(s, arm)[c->index[i]];
}

/* Loads and capacities at the frictions in place; what moves has the friction of its law (multipliers for which law[i] is 1). */
static void tr_creep_loads(tr_sim *s, tr_creeping *c, const int *law) {
  const tr_kernel *k = s->k;
  double *eta = TR_A(s, z) + k->active;
  tr_law(s, eta);
  for (int i = 0; i < k->neta; ++i)
    if (law[i]) eta[i] = TR_A(s, law)[i];
  tr_holding(s);
  for (int q = 0; q < c->n; ++q) c->cap[q] = fmax(c->share * tr_hold_of(s, c->pairs[q])->capacity, SHARE_NOTHING);
}

/* One step of Newton's method, on w and u (as Chan, Golub and Mulet 1999 for another sum of lengths: on w alone it is slow where ε is small). */
static void tr_creep_step(tr_sim *s, tr_creeping *c) {
  const int r = c->r;
  double H[r * r + 4], L[r * r + 1], g[r + 1], dw[r + 1], d[r + 1], w[r + 1], slope = 0.0, cut = 1.0;
  int perm[r + 1];
  const double sum = tr_creep_sum(s, c, c->w);
  tr_creep_slopes(s, c, g, H);
  for (int k = 0; k < r; ++k) d[k] = 1.0 / sqrt(H[k + k * r]);
  const int rank = tr_cholesky(r, H, d, L, perm, 0, 0.0, 0.0);
  tr_cholesky_solve(r, rank, L, perm, d, g, dw);
  for (int k = 0; k < r; ++k) slope += g[k] * dw[k];
  for (int half = 0; half < CREEP_HALVES; ++half, cut *= 0.5) {
    for (int k = 0; k < r; ++k) w[k] = c->w[k] - cut * dw[k];
    if (tr_creep_sum(s, c, w) <= sum - CREEP_SLOPE * cut * slope) break;
  }
  for (int k = 0; k < r; ++k) dw[k] = w[k] - c->w[k];
  tr_creep_surfaces(s, c, c->w, 1, c->x);
  tr_creep_follow(s, c, dw);
  memcpy(c->w, w, sizeof(double) * r);
}

/* The minimum for smaller and smaller ε, loads with it; accelerations at the surfaces are left in x, frictions in place. `law`: see
 * tr_creep_loads. */
static void tr_creep_to_rest(tr_sim *s, tr_creeping *c, const int *law) {
  double *eta = TR_A(s, z) + s->k->active, old[s->k->neta + 1];
  tr_creep_loads(s, c, law);
  tr_creep_without(s, c);
  memcpy(c->w, c->w0, sizeof(double) * c->r);
  memset(c->u, 0, sizeof(double) * c->m);
  for (double part = 1.0; part >= CREEP_LAST; part *= CREEP_NEXT) {
    const int last = part * CREEP_NEXT < CREEP_LAST;
    tr_creep_ease(c, part);
    for (int it = 0; it < (last ? CREEP_STEPS_LAST : CREEP_STEPS) && !tr_gives_up(s, (double)c->r * c->r * (c->m + c->r)); ++it) {
      double changed = 0.0, size = 0.0;
      memcpy(old, eta, sizeof(double) * s->k->neta);
      tr_creep_step(s, c);
      tr_creep_frictions(s, c);
      tr_creep_loads(s, c, law);
      tr_creep_without(s, c);
      for (int i = 0; i < s->k->neta; ++i) {
        changed = fmax(changed, fabs(eta[i] - old[i]) / TR_A(s, arm)[i]), size = fmax(size, fabs(eta[i]) / TR_A(s, arm)[i]);
      }
      s->stats.creeps++;
      if (changed <= CREEP_FOUND * size) break;
    }
  }
  tr_creep_surfaces(s, c, c->w, 0, c->x);
}
