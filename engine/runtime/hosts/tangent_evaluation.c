/* Tangents of f at a state: multipliers, factors of ∂R/∂z, and derivatives along all parameters.
 *
 * The multipliers z solve R(z) = 0. If the run did not record z, Newton steps with the factors of ∂R/∂z from the last stage compute
 * z. One pass of the unit's derivatives, along all multipliers and all parameters, then gives new factors and the tangents. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

/* relative to the largest multiplier: after a smaller correction, z has settled; the matrix ∂R/∂z hardly changes over such a
 * correction */
#define SETTLED_MULTIPLIERS 1e-13
/* relative to the largest multiplier, with new factors: after a smaller correction, z has settled; the tangents have this relative
 * error */
#define SETTLED_AFTER 1e-11
#define NO_MULTIPLIERS 1e-200     /* smallest size by which corrections are divided, for multipliers that are all zero */
#define NEAR_MULTIPLIERS 0.1      /* relative to the largest multiplier: largest correction with the factors of an earlier stage */
/* largest ratio of successive corrections with which the factors of an earlier stage stay in use */
#define CONTRACTION 0.25
#define MOST_CORRECTIONS 20       /* largest number of corrections, each with new factors of ∂R/∂z */

/* An integration of tangents. The arrays lie in the work space of its record. */
typedef struct tr_march {
  tr_sim *s;
  const tr_tangents *g;
  const tr_explicit *method;
  size_t width;                              /* number of doubles of a state with its tangents, padded */
  double *K, *start, *end, *now, *sample, *dense, *x, *f, *df, *seeds, *column_seeds, *A, *scale, *change, *old, *before, *all;
  int *perm, solved;                         /* solved: whether the factors come from a recent stage */
  const double *times;                       /* times of the next samples */
  int inside;                                /* number of samples inside the present step */
  double part;                               /* part of a recorded step that is made at once: 1, 1/2, 1/4, … */
  double *values, *derivatives;              /* columns of the next sample, and their derivatives (m × columns) */
} tr_march;

static int tr_seed_width(const tr_tangents *g) { return g->ny + g->nz + g->np + 1; }
static int tr_column_width(const tr_tangents *g) { return g->n + g->nall + g->nv + g->np + 1; }
static double *tr_derivatives_by(const tr_march *c, int row) { return c->df + (size_t)row * c->g->nf; }

static double *tr_take(double *work, size_t *used, size_t count) {
  double *at = work ? work + *used : 0;
  *used += TR_PAD(count + 1);
  return at;
}

/* Divide the work space among the arrays. Returns the number of doubles used. */
static size_t tr_divide_work(tr_march *c, double *work) {
  const tr_tangents *g = c->g;
  const size_t nz = g->nz, rows = nz + g->m;
  size_t used = 0;
  c->width = TR_PAD((size_t)g->n * (1 + g->m));
  c->K = tr_take(work, &used, c->width * TR_STAGES);
  c->start = tr_take(work, &used, c->width), c->end = tr_take(work, &used, c->width);
  c->now = tr_take(work, &used, c->width), c->sample = tr_take(work, &used, c->width);
  c->dense = tr_take(work, &used, c->width * TR_DENSE_ROWS);
  c->x = tr_take(work, &used, g->nx), c->f = tr_take(work, &used, g->nf);
  c->df = tr_take(work, &used, rows * g->nf), c->seeds = tr_take(work, &used, rows * tr_seed_width(g));
  c->column_seeds = tr_take(work, &used, (size_t)g->m * tr_column_width(g));
  c->A = tr_take(work, &used, nz * nz), c->scale = tr_take(work, &used, 2 * nz);
  c->change = tr_take(work, &used, nz), c->old = tr_take(work, &used, nz * TR_STAGES);
  c->before = tr_take(work, &used, nz), c->all = tr_take(work, &used, g->nall);
  c->perm = (int *)tr_take(work, &used, nz);
  return used;
}

size_t tr_tangents_work(const tr_tangents *g) {
  tr_march c = {.g = g};
  return tr_divide_work(&c, 0);
}

/* -- multipliers --------------------------------------------------------------------------------------------------------------- */

/* Factorise ∂R/∂z with scaled rows and columns. Returns 0 unless the matrix is clearly regular. */
static int tr_factor_multipliers(tr_march *c) {
  const int nz = c->g->nz;
  double *A = c->A, *row = c->scale, *column = row + nz, most = 0.0, least = INFINITY;
  for (int j = 0; j < nz; ++j) memcpy(A + (size_t)j * nz, tr_derivatives_by(c, j) + c->g->residual, sizeof(double) * nz);
  for (int i = 0; i < nz; ++i) {
    row[i] = 0.0;
    for (int j = 0; j < nz; ++j) row[i] = fmax(row[i], fabs(A[i + (size_t)j * nz]));
    if (row[i] == 0.0) row[i] = 1.0;
    for (int j = 0; j < nz; ++j) A[i + (size_t)j * nz] /= row[i];
  }
  for (int j = 0; j < nz; ++j) {
    double *a = A + (size_t)j * nz;
    column[j] = nz > 1 ? sqrt(tr_dot(a, a, nz)) : 1.0;
    if (column[j] == 0.0) column[j] = 1.0;
    for (int i = 0; i < nz; ++i) a[i] /= column[j];
  }
  if (!tr_is_finite(nz * nz, A) || !tr_lu(nz, A, c->perm)) return 0;
  for (int i = 0; i < nz; ++i) most = fmax(most, fabs(A[i + (size_t)i * nz])), least = fmin(least, fabs(A[i + (size_t)i * nz]));
  return least > c->g->regular * most;
}

/* Set c->change to (∂R/∂z)⁻¹ r with the present factors. */
static void tr_apply_factors(const tr_march *c, const double *r) {
  const int nz = c->g->nz;
  for (int i = 0; i < nz; ++i) c->change[i] = r[i] / c->scale[i];
  tr_lu_solve(nz, c->A, c->perm, c->change);
  for (int i = 0; i < nz; ++i) c->change[i] /= c->scale[nz + i];
}

/* Compute the correction of the multipliers from the residuals in f. Returns its largest component, divided by the largest
 * multiplier. */
static double tr_correction(tr_march *c) {
  const int nz = c->g->nz;
  tr_apply_factors(c, c->f + c->g->residual);
  const double most = tr_largest_size(nz, c->change);
  if (!tr_is_finite(nz, c->change)) return INFINITY;
  return most < NO_MULTIPLIERS ? 0.0 : most / fmax(tr_largest_size(nz, c->g->z), most);
}

/* Evaluate f, and correct the multipliers with the factors of an earlier stage until they settle or no longer improve. A large
 * correction shows a poor start. f is then evaluated at `before`, the multipliers of the last stage, and `solved` becomes 0. */
static void tr_settle_multipliers(tr_march *c, const double *y) {
  const tr_tangents *g = c->g;
  double last = NEAR_MULTIPLIERS;
  for (;;) {
    g->point(c->x, y, g->c, g->z, 0, 0, g->w, c->f);
    if (!c->solved || !g->nz) return;
    const double size = tr_correction(c);
    if (!(size <= NEAR_MULTIPLIERS)) memcpy(g->z, c->before, sizeof(double) * g->nz), c->solved = 0;
    else if (size <= SETTLED_MULTIPLIERS || size > last) return;
    else for (int j = 0; j < g->nz; ++j) g->z[j] -= c->change[j];
    last = CONTRACTION * size;
  }
}

/* Eliminate the multipliers from the derivatives in a row of df. The row then contains total derivatives: of f, and of z in place
 * of the residuals. */
static void tr_eliminate_multipliers(const tr_march *c, int row) {
  const int nz = c->g->nz;
  double *df = tr_derivatives_by(c, row), *residual = df + c->g->residual;
  tr_apply_factors(c, residual);
  tr_add_columns(c->g->nf, nz, c->df, c->change, -1.0, df);
  for (int j = 0; j < nz; ++j) residual[j] = -c->change[j];
}

/* Like tr_tangents_at, with the factors of ∂R/∂z. Returns 0 if z has no clear solution. */
static int tr_tangents_by_factors(tr_march *c, const double *y, const double *S, int solved) {
  const tr_tangents *g = c->g;
  const int nz = g->nz, wide = tr_seed_width(g);
  for (int k = 0; k < g->m; ++k) memcpy(c->seeds + (size_t)(nz + k) * wide, S + (size_t)k * g->n, sizeof(double) * g->ny);
  for (int again = 0;; ++again) {
    if (again || solved) g->point(c->x, y, g->c, g->z, 0, 0, g->w, c->f);
    else tr_settle_multipliers(c, y);
    g->along(c->x, y, g->c, g->z, 0, 0, g->w, nz + g->m, c->seeds, wide, c->df, g->nf);
    if (!nz) return 1;
    c->solved = tr_factor_multipliers(c);
    if (!c->solved || again == MOST_CORRECTIONS) return c->solved = 0;
    const double size = tr_correction(c);
    for (int j = 0; j < nz; ++j) g->z[j] -= c->change[j];
    if (size <= SETTLED_AFTER) break;
  }
  tr_add_columns(g->nf, nz, c->df, c->change, -1.0, c->f);
  for (int k = nz; k < nz + g->m; ++k) tr_eliminate_multipliers(c, k);
  return 1;
}

/* Evaluate f, z and the tangents of f at time t and state y with tangents S. df begins with the rows of the multipliers; the
 * tangents of f follow. In df, tangents of z replace the tangents of the residuals. solved: whether z is the solution of the run.
 * If there is no clear solution, the host searches for a solution. Returns 0 if the host fails. */
static int tr_tangents_at(tr_march *c, double t, const double *y, const double *S, int solved) {
  const tr_tangents *g = c->g;
  tr_signals(TR_A(c->s, tables), c->s->k->ntables, t, c->x);
  if (tr_tangents_by_factors(c, y, S, solved)) return 1;
  memcpy(g->z, c->before, sizeof(double) * g->nz);
  return g->host(c->x, y, S, g->z, c->f, tr_derivatives_by(c, g->nz));
}
