/* Walks along directions (directions.py): four at once, each number that they may change with a vector beside it. Vectors lie in cells;
 * a call that no direction has reached is passed over, and what it would write is zero. */
#include <math.h>
#include <stdlib.h>

#include "machine.h"

typedef double tr_vec __attribute__((vector_size(32), aligned(8)));
#define LANES 4

/* -- functions of vectors: of values (a, b), vectors beside them, and what is written ------------------------------------------- */

void tr_v_pick(double *const *a, const int *how) {
  const tr_vec *from = (tr_vec *)a[0];
  tr_vec *out = (tr_vec *)a[1];
  for (int i = 0; i < how[0]; ++i) out[i] = from[how[1 + i]];
}

void tr_v_gather(double *const *a, const int *how) {
  const tr_vec *from = (tr_vec *)a[0];
  tr_vec *out = (tr_vec *)a[1];
  for (int i = 0; i < how[0]; ++i) out[i] = how[1 + i] >= 0 ? from[how[1 + i]] : (tr_vec){0.0};
}

void tr_v_scale(double *const *a, const int *how) {
  const tr_vec *da = (tr_vec *)a[2], *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int i = 0; i < how[0]; ++i) out[i] = da[i] * a[1][0] + a[0][i] * db[0];
}

void tr_v_product(double *const *a, const int *how) {
  const tr_vec *da = (tr_vec *)a[2], *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int i = 0; i < how[0]; ++i) out[0] += (double)how[1] * (da[i] * a[1][i] + a[0][i] * db[i]);
}

void tr_v_dots(double *const *a, const int *how) {
  const tr_vec *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int k = 0; k < how[1]; ++k) {
    const double *row = a[0] + (size_t)k * how[2];
    const tr_vec *drow = (tr_vec *)a[2] + (size_t)k * how[2];
    for (int i = 0; i < how[0]; ++i) out[(size_t)k * how[3]] += drow[i] * a[1][i] + row[i] * db[i];
  }
}

void tr_v_spread(double *const *a, const int *how) {
  const tr_vec *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int k = 0; k < how[1]; ++k) {
    const double *column = a[0] + (size_t)k * how[2];
    const tr_vec *dcolumn = (tr_vec *)a[2] + (size_t)k * how[2];
    for (int i = 0; i < how[0]; ++i) out[i] += dcolumn[i] * a[1][k] + column[i] * db[k];
  }
}

/* -- the walk ---------------------------------------------------------------------------------------------------------------------- */

static inline int reached(const char *live, const int *cells, int count) {
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < cells[2 * i + 1]; ++k)
      if (live[cells[2 * i] + k]) return 1;
  return 0;
}

/* What is not reached is zero. */
static inline void clear(const tr_directions *d, char *live, tr_vec *v, const int *cells, int count) {
  for (int i = 0; i < count; ++i)
    for (int k = cells[2 * i], end = k + cells[2 * i + 1]; k < end; ++k)
      if (live[k]) memset(v + d->cell[k], 0, sizeof(tr_vec) * (d->cell[k + 1] - d->cell[k])), live[k] = 0;
}

static void follow(const tr_scene *s, const tr_directions *d, double *const *base, char *live) {
  double *a[MOST_PLACES];
  for (const int *code = d->code, *end = code + d->length; code < end;) {
    const int places = code[1], numbers = code[2], ins = code[3], outs = code[4] + code[5];
    const int *in = code + 6, *out = in + 2 * ins, *at = out + 2 * outs, *how = at + 2 * places;
    if (reached(live, in, ins)) {
      for (int i = 0; i < places; ++i) a[i] = base[at[2 * i]] + at[2 * i + 1];
      s->part[code[0]](a, how);
      for (int i = 0; i < outs; ++i) memset(live + out[2 * i], 1, out[2 * i + 1]);
    } else {
      clear(d, live, (tr_vec *)base[D], out, code[4]);
    }
    code = how + numbers;
  }
}

/* Direction q into a lane, or out of it again. */
static void seed(const tr_directions *d, int q, int lane, double by, const double *x, double *v, char *live) {
  for (int i = d->first[q]; i < d->first[q + 1]; ++i) {
    const int *e = d->seed + 3 * i; /* vector, cell, where in x its size is (−1: one) */
    v[LANES * e[0] + lane] += by * (e[2] < 0 ? 1.0 : x[e[2]]);
    live[e[1]] = by != 0.0;
  }
}

static void unseed(const tr_directions *d, int q, double *v, char *live) {
  for (int i = d->first[q]; i < d->first[q + 1]; ++i) {
    const int *e = d->seed + 3 * i;
    memset(v + LANES * e[0], 0, sizeof(tr_vec)), live[e[1]] = 0;
  }
}

static void column(const tr_directions *d, const double *v, int lane, double *out) {
  for (int r = 0; r < d->rows; ++r) out[r] = d->row[r] < 0 ? 0.0 : v[LANES * d->row[r] + lane];
}

/* Room for a point: values, then vectors, then which cells are reached. */
static double *vectors_of(const tr_scene *s, double *w) { return w + s->point.scratch; }
static char *cells_of(const tr_scene *s, double *w) { return (char *)(vectors_of(s, w) + LANES * s->directions->vectors); }

/* Values at a point, and those asked for in out. a, extra, out: 0 where tapes do not name them. */
void tr_parts_d_point(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *w,
                      double *out) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [A] = (double *)a, [EXTRA] = (double *)extra, [T] = w,
        [OUT] = out);
  walk(s, &s->point, base);
  memset(vectors_of(s, w), 0, sizeof(tr_vec) * d->vectors), memset(cells_of(s, w), 0, d->cells);
}

/* Derivatives at that point along directions, each by sizes of all that may change: `count` of them, so far behind each other. */
void tr_parts_d_along(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *w,
                      int count, const double *sizes, size_t next, double *out, size_t next_out) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  double *v = vectors_of(s, w);
  char *live = cells_of(s, w);
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [A] = (double *)a, [EXTRA] = (double *)extra, [T] = w,
        [D] = v);
  for (int k = 0; k < count; k += LANES) {
    const int lanes = count - k < LANES ? count - k : LANES;
    for (int i = 0; i < lanes; ++i)
      for (int q = 0; q < d->directions; ++q)
        if (sizes[(k + i) * next + q] != 0.0) seed(d, q, i, sizes[(k + i) * next + q], x, v, live);
    follow(s, d, base, live);
    for (int i = 0; i < lanes; ++i) column(d, v, i, out + (k + i) * next_out);
    for (int q = 0; q < d->directions; ++q) unseed(d, q, v, live);
  }
}

/* All columns of a Jacobian. */
void tr_parts_j_eval(const double *x, const double *y, const double *c, const double *z, double *w, double *J) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  double *v = vectors_of(s, w);
  char *live = cells_of(s, w);
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [T] = w, [D] = v);
  tr_parts_d_point(x, y, c, z, 0, 0, w, 0);
  for (int q = 0; q < d->directions; q += LANES) {
    const int *which = d->order + q, lanes = d->directions - q < LANES ? d->directions - q : LANES;
    for (int i = 0; i < lanes; ++i) seed(d, which[i], i, 1.0, x, v, live);
    follow(s, d, base, live);
    for (int i = 0; i < lanes; ++i) column(d, v, i, J + (size_t)which[i] * d->rows);
    for (int i = 0; i < lanes; ++i) unseed(d, which[i], v, live);
  }
}

/* -- the linear unit: rates and residuals, and (beside) columns ---------------------------------------------------------------------- */

void tr_parts_l_prepare(const void *scene, const double *p, double *c) {
  const tr_scene *s = scene;
  tr_parts_prepare(s, p, c), tr_parts_prepare(s->beside, p, c + s->nc);
}

static void once(const double *x, const double *y, const double *c, const double *z, const double *a, const double *sizes, double *out) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  double *w = malloc(sizeof(double) * (s->point.scratch + (size_t)LANES * d->vectors + d->cells / sizeof(double) + 1));
  for (int r = 0; r < d->rows; ++r) out[r] = NAN;
  if (!w) return;
  tr_parts_d_point(x, y, c, z, a, 0, w, 0);
  tr_parts_d_along(x, y, c, z, a, 0, w, 1, sizes, 0, out, 0);
  free(w);
}

void tr_parts_l_rates(const double *x, const double *y, const double *c, const double *z, const double *sizes, double *out) {
  once(x, y, c, z, 0, sizes, out);
}

void tr_parts_l_columns(const double *x, const double *y, const double *c, const double *z, const double *a, const double *sizes, double *out) {
  once(x, y, c + scene_of(c)->nc, z, a, sizes, out);
}
