/* Tangents along recorded steps: the variational equation, integrated with the explicit method of the run.
 *
 * A state with its tangents is one vector [y | derivatives by parameter 1 | by parameter 2 | …]. At each stage the multipliers z
 * follow from R(z) = 0. The factors of ∂R/∂z at the last stage correct z until z settles. One pass of the unit's derivatives along
 * all multipliers and all parameters then gives new factors and the tangents. The host handles events. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#define SETTLED_MULTIPLIERS 1e-13 /* × the largest multiplier: last correction; the matrix is constant over such a small change */
#define SETTLED_AFTER 2e-13       /* × the largest multiplier: last correction by new factors, which change it slightly */
#define NO_MULTIPLIERS 1e-200     /* smallest correction that counts, for multipliers that are all zero */
#define NEAR_MULTIPLIERS 0.1      /* × the largest multiplier: largest correction by the factors of an earlier stage */
#define CONTRACTION 0.25          /* largest ratio of successive corrections with which the last factors are used */
#define REGULAR_PIVOTS 1e-4       /* smallest pivot over largest: above this, the scaled matrix is clearly regular */
#define MOST_CORRECTIONS 20       /* largest number of corrections by new factors */

typedef struct tr_march {
  tr_sim *s;
  const tr_tangents *g;
  const tr_explicit *method;
  size_t width;                              /* number of doubles of a state with its tangents, padded */
  double *K, *start, *now, *x, *f, *df, *seeds, *column_seeds, *A, *scale, *change, *old, *before, *kept, *all;
  int *perm, solved;                         /* solved: whether the factors belong to a recent stage */
} tr_march;

static double *tr_take(double *work, size_t *used, size_t count) {
  double *at = work ? work + *used : 0;
  *used += TR_PAD(count + 1);
  return at;
}

static int tr_seed_width(const tr_tangents *g) { return g->ny + g->nz + g->np + 1; }
static int tr_column_width(const tr_tangents *g) { return g->n + g->nall + g->nv + g->np + 1; }
static double *tr_derivatives_by(const tr_march *c, int row) { return c->df + (size_t)row * c->g->nf; }

/* Divide the work space among the arrays. Returns the number of doubles used. */
static size_t tr_divide_work(tr_march *c, double *work) {
  const tr_tangents *g = c->g;
  const size_t nz = g->nz, rows = nz + g->m;
  size_t used = 0;
  c->width = TR_PAD((size_t)g->n * (1 + g->m));
  c->K = tr_take(work, &used, c->width * TR_STAGES);
  c->start = tr_take(work, &used, c->width), c->now = tr_take(work, &used, c->width);
  c->x = tr_take(work, &used, g->nx), c->f = tr_take(work, &used, g->nf);
  c->df = tr_take(work, &used, rows * g->nf), c->seeds = tr_take(work, &used, rows * tr_seed_width(g));
  c->column_seeds = tr_take(work, &used, (size_t)g->m * tr_column_width(g));
  c->A = tr_take(work, &used, nz * nz), c->scale = tr_take(work, &used, 2 * nz);
  c->change = tr_take(work, &used, nz), c->old = tr_take(work, &used, nz * TR_STAGES);
  c->before = tr_take(work, &used, nz), c->kept = tr_take(work, &used, nz), c->all = tr_take(work, &used, g->nall);
  c->perm = (int *)tr_take(work, &used, nz);
  return used;
}

size_t tr_tangents_work(const tr_tangents *g) {
  tr_march c = {.g = g};
  return tr_divide_work(&c, 0);
}

/* -- multipliers ------------------------------------------------------------------------------------------------------------------- */

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
  return least > REGULAR_PIVOTS * most;
}

/* b ← (∂R/∂z)⁻¹ b with the present factors. */
static void tr_apply_factors(const tr_march *c, double *b) {
  const int nz = c->g->nz;
  for (int i = 0; i < nz; ++i) b[i] /= c->scale[i];
  tr_lu_solve(nz, c->A, c->perm, b);
  for (int i = 0; i < nz; ++i) b[i] /= c->scale[nz + i];
}

/* Compute the correction of the multipliers from the residuals in f. Returns its largest component, divided by the largest
 * multiplier. */
static double tr_correction(tr_march *c) {
  const int nz = c->g->nz;
  memcpy(c->change, c->f + c->g->residual, sizeof(double) * nz);
  tr_apply_factors(c, c->change);
  const double most = tr_largest_size(nz, c->change);
  if (!tr_is_finite(nz, c->change)) return INFINITY;
  return most < NO_MULTIPLIERS ? 0.0 : most / fmax(tr_largest_size(nz, c->g->z), most);
}

/* Evaluate f, and correct the multipliers with the factors of an earlier stage until they settle or no longer improve. If the first
 * correction is large, the extrapolated start is poor. Then start again from `before`, the multipliers of the last stage. */
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

/* Add dz times the derivatives by the multipliers to f, or to tangents of f. */
static void tr_add_by_multipliers(const tr_march *c, const double *dz, double sign, double *f) {
  for (int j = 0; j < c->g->nz; ++j) {
    const double *by = tr_derivatives_by(c, j), a = sign * dz[j];
    for (int i = 0; i < c->g->nf; ++i) f[i] += a * by[i];
  }
}

/* Evaluate f, z and the tangents of f at time t and state y with tangents S. In df, the tangents of f follow the rows of the
 * multipliers; there, the tangents of z replace those of the residuals. Returns 0 if z has no clear solution. */
static int tr_tangents_at(tr_march *c, double t, const double *y, const double *S) {
  const tr_tangents *g = c->g;
  const int nz = g->nz, wide = tr_seed_width(g);
  tr_signals(TR_A(c->s, tables), c->s->k->ntables, t, c->x);
  for (int k = 0; k < g->m; ++k) memcpy(c->seeds + (size_t)(nz + k) * wide, S + (size_t)k * g->n, sizeof(double) * g->ny);
  for (int again = 0;; ++again) {
    if (again) g->point(c->x, y, g->c, g->z, 0, 0, g->w, c->f);
    else tr_settle_multipliers(c, y);
    g->along(c->x, y, g->c, g->z, 0, 0, g->w, nz + g->m, c->seeds, wide, c->df, g->nf);
    if (!nz) return 1;
    c->solved = tr_factor_multipliers(c);
    if (!c->solved || again == MOST_CORRECTIONS) return c->solved = 0;
    const double size = tr_correction(c);
    for (int j = 0; j < nz; ++j) g->z[j] -= c->change[j];
    if (size <= SETTLED_AFTER) break;
  }
  tr_add_by_multipliers(c, c->change, -1.0, c->f);
  for (int k = nz; k < nz + g->m; ++k) {
    double *df = tr_derivatives_by(c, k);
    memcpy(c->change, df + g->residual, sizeof(double) * nz);
    tr_apply_factors(c, c->change);
    tr_add_by_multipliers(c, c->change, -1.0, df);
    for (int j = 0; j < nz; ++j) df[g->residual + j] = -c->change[j];
  }
  return 1;
}

/* -- steps ------------------------------------------------------------------------------------------------------------------------- */

/* Give each sliding pair of several components that is momentarily at rest the speed `slow` along its frozen direction. Its
 * direction of friction is then the limit before rest, and its velocity perpendicular to this direction has no tangent. */
static void tr_keep_slip_direction(const tr_march *c, double *y, double *S) {
  const tr_tangents *g = c->g;
  for (int p = 0; p < g->turning; ++p) {
    const int *at = g->turn + 5 * p, n = at[1], *place = at + 2;
    const tr_mode *mode = (const tr_mode *)(c->x + at[0]);
    double size = 0.0, speed = 0.0;
    for (int i = 0; i < n; ++i) size += mode->direction[i] * mode->direction[i], speed += y[place[i]] * y[place[i]];
    size = sqrt(size);
    if (tr_mode_flag(mode) == TR_STUCK || !(size > 0.0) || !(sqrt(speed) < g->slow)) continue;
    for (int i = 0; i < n; ++i) y[place[i]] = g->slow * mode->direction[i] / size;
    for (int k = 0; k < g->m; ++k) {
      double *dy = S + (size_t)k * g->n, sum = 0.0;
      for (int i = 0; i < n; ++i) sum += mode->direction[i] / size * dy[place[i]];
      for (int i = 0; i < n; ++i) dy[place[i]] = mode->direction[i] / size * sum;
    }
  }
}

/* Slopes, at time t, of the state with its tangents in c->now. Returns 0 if the multipliers have no clear solution. */
static int tr_tangent_slopes(tr_march *c, double t, double *slopes) {
  const tr_tangents *g = c->g;
  tr_keep_slip_direction(c, c->now, c->now + g->n);
  if (!tr_tangents_at(c, t, c->now, c->now + g->n)) return 0;
  memcpy(slopes, c->f, sizeof(double) * g->n);
  for (int k = 0; k < g->m; ++k) memcpy(slopes + (size_t)(k + 1) * g->n, tr_derivatives_by(c, g->nz + k), sizeof(double) * g->n);
  return 1;
}

/* Extrapolate the multipliers of earlier stages to stage i. */
static void tr_extrapolate_multipliers(const tr_march *c, int i) {
  const double *weight = c->method->lead + i * c->method->stages;
  const int nz = c->g->nz;
  memset(c->g->z, 0, sizeof(double) * nz);
  for (int k = 0; k < i; ++k)
    for (int j = 0; j < nz && weight[k] != 0.0; ++j) c->g->z[j] += weight[k] * c->old[(size_t)k * nz + j];
}

/* Integrate the tangents from t to t + h. If a stage has no clear solution, returns 0 and changes nothing. */
static int tr_march_step(tr_march *c, double t, double h, const double *y) {
  const tr_tangents *g = c->g;
  const tr_explicit *m = c->method;
  const int vectors = (int)(c->width / TR_LANES), nz = g->nz;
  memcpy(c->kept, g->z, sizeof(double) * nz), memcpy(c->before, g->z, sizeof(double) * nz);
  memcpy(c->start, y, sizeof(double) * g->n);
  memcpy(c->start + g->n, g->S, sizeof(double) * g->n * g->m);
  memcpy(c->now, c->start, sizeof(double) * c->width);
  for (int i = 0; i < m->stages; ++i) {
    if (i) {
      m->argument(i, vectors, h, (tr_vec *)c->start, (tr_vec *)c->K, (tr_vec *)c->now);
      memcpy(c->old + (size_t)(i - 1) * nz, g->z, sizeof(double) * nz);
      memcpy(c->before, g->z, sizeof(double) * nz);
      tr_extrapolate_multipliers(c, i);
    }
    if (!tr_tangent_slopes(c, t + m->c[i] * h, c->K + (size_t)i * c->width)) {
      memcpy(g->z, c->kept, sizeof(double) * nz);
      return 0;
    }
  }
  m->solution(vectors, h, (tr_vec *)c->start, (tr_vec *)c->K, (tr_vec *)c->now);
  memcpy(g->S, c->now + g->n, sizeof(double) * g->n * g->m);
  for (int i = 0; i < g->nrates; ++i) g->speeds[i] = fmax(g->speeds[i], fabs(c->f[g->rates + i]));
  return 1;
}

/* As tr_tangents_at, at the state y with the tangents g->S. */
static int tr_tangents_of_state(tr_march *c, double t, const double *y) {
  const tr_tangents *g = c->g;
  memcpy(c->now, y, sizeof(double) * g->n);
  memcpy(c->now + g->n, g->S, sizeof(double) * g->n * g->m);
  tr_keep_slip_direction(c, c->now, c->now + g->n);
  memcpy(c->kept, g->z, sizeof(double) * g->nz), memcpy(c->before, g->z, sizeof(double) * g->nz);
  if (tr_tangents_at(c, t, c->now, c->now + g->n)) return 1;
  memcpy(g->z, c->kept, sizeof(double) * g->nz);
  return 0;
}

/* Columns and their derivatives (m × columns) at the state y and time t. Returns 0 if this state has no clear solution. */
static int tr_tangent_columns(tr_march *c, double t, const double *y, double *value, double *derivatives) {
  const tr_tangents *g = c->g;
  const int wide = tr_column_width(g), nz = g->nz;
  if (!tr_tangents_of_state(c, t, y)) return 0;
  memset(c->all, 0, sizeof(double) * g->nall);
  memset(c->column_seeds, 0, sizeof(double) * wide * g->m);
  for (int j = 0; j < nz; ++j) c->all[g->place[j]] = g->z[j];
  for (int k = 0; k < g->m; ++k) {
    double *seed = c->column_seeds + (size_t)k * wide;
    const double *df = tr_derivatives_by(c, nz + k);
    memcpy(seed, g->S + (size_t)k * g->n, sizeof(double) * g->n);
    for (int j = 0; j < nz; ++j) seed[g->n + g->place[j]] = df[g->residual + j];
    memcpy(seed + g->n + g->nall, df + g->nq, sizeof(double) * g->nv);
    memcpy(seed + g->n + g->nall + g->nv, g->dp + (size_t)k * g->np, sizeof(double) * g->np);
  }
  g->column_point(c->x, y, g->co, c->all, c->f + g->nq, g->extra, g->wo, value);
  g->column_along(c->x, y, g->co, c->all, c->f + g->nq, g->extra, g->wo, g->m, c->column_seeds, wide, derivatives, g->columns);
  return 1;
}

static void tr_begin_march(tr_march *c) {
  const tr_tangents *g = c->g;
  const int wide = tr_seed_width(g), rows = g->nz + g->m;
  tr_divide_work(c, g->work);
  c->method = tr_method_of(c->s)->explicit;
  memset(c->K, 0, sizeof(double) * c->width * TR_STAGES), memset(c->start, 0, sizeof(double) * c->width);
  memset(c->seeds, 0, sizeof(double) * wide * rows);
  for (int j = 0; j < g->nz; ++j) c->seeds[(size_t)j * wide + g->ny + j] = 1.0;
  for (int k = 0; k < g->m; ++k) memcpy(c->seeds + (size_t)(g->nz + k) * wide + g->ny + g->nz, g->dp + (size_t)k * g->np, sizeof(double) * g->np);
}

/* Set the external values of an evaluation. */
static void tr_set_external(const tr_march *c, const double *x, double inside) {
  memcpy(c->x, x, sizeof(double) * c->g->nx);
  ((tr_moment *)c->x)->inside = inside;
}

int tr_evaluate_tangents(tr_sim *s, const tr_tangents *g, double t, const double *y, const double *x, double *f, double *df) {
  tr_march c = {.s = s, .g = g};
  tr_begin_march(&c);
  memcpy(c.x, x, sizeof(double) * g->nx);
  if (!tr_tangents_of_state(&c, t, y)) return 0;
  memcpy(f, c.f, sizeof(double) * g->nf);
  memcpy(df, tr_derivatives_by(&c, g->nz), sizeof(double) * g->nf * g->m);
  return 1;
}

int tr_march_tangents(tr_sim *s, const tr_tangents *g, int count, const double *t, const double *y, size_t next, const double *x, const double *after,
                      const int *stops, const int *sampled, double *values, double *derivatives) {
  tr_march c = {.s = s, .g = g};
  tr_begin_march(&c);
  for (int k = 0; k < count; ++k) {
    tr_set_external(&c, x + (size_t)k * g->nx, 0.5 * (t[k] + t[k + 1]));
    if (!tr_march_step(&c, t[k], t[k + 1] - t[k], y + k * next)) return 2 * k;
    if (stops[k]) return 2 * k + 1;
    if (!sampled[k]) continue;
    tr_set_external(&c, after + (size_t)(k + 1) * g->nx, t[k + 1] + JUST_AFTER);
    if (!tr_tangent_columns(&c, t[k + 1], y + (k + 1) * next, values, derivatives)) return 2 * k + 1;
    values += g->columns, derivatives += (size_t)g->m * g->columns;
  }
  return 2 * count;
}

int tr_record_steps(tr_sim *s, double target, int most, double *rows, long capacity, double *t, double *y, double *x, int *made) {
  const int width = s->ny + s->nworks;
  *made = 0;
  for (int i = 0; i < most; ++i) {
    const double before = s->clock.t;
    long count;
    const int code = tr_advance(s, target, 1, rows, capacity, &count);
    s->events.count = 0;
    if (s->clock.t > before) {
      t[*made] = s->clock.t;
      memcpy(y + (size_t)*made * width, TR_A(s, y), sizeof(double) * width);
      memcpy(x + (size_t)*made * s->k->nx, TR_A(s, x), sizeof(double) * s->k->nx);
      ++*made;
    }
    if (code != TR_MORE && code != TR_EVENTS_FULL && code != TR_ROWS_FULL && code != TR_OK) return code;
  }
  return TR_MORE;
}
