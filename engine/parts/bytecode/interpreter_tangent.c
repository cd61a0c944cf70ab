/* Forward-mode derivatives of programs (forward_mode.py) along four directions at once. A tangent is the vector of the four
 * derivatives of a number that a direction may change. Tangents are grouped into cells. A call whose input tangents are all zero is
 * skipped; its output tangents are then zero. */
#include <math.h>
#include <stdlib.h>

#include "interpreter.h"

typedef double tr_vec __attribute__((vector_size(32), aligned(8)));
#define LANES 4

/* -- tangents of builtin ops. Operands: values a, b; tangents of a, b; tangent of the output ----------------------------------- */

void tr_tangent_select(double *const *a, const int *how) {
  const tr_vec *from = (tr_vec *)a[0];
  tr_vec *out = (tr_vec *)a[1];
  for (int i = 0; i < how[0]; ++i) out[i] = from[how[1 + i]];
}

void tr_tangent_gather(double *const *a, const int *how) {
  const tr_vec *from = (tr_vec *)a[0];
  tr_vec *out = (tr_vec *)a[1];
  for (int i = 0; i < how[0]; ++i) out[i] = how[1 + i] >= 0 ? from[how[1 + i]] : (tr_vec){0.0};
}

void tr_tangent_scale(double *const *a, const int *how) {
  const tr_vec *da = (tr_vec *)a[2], *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int i = 0; i < how[0]; ++i) out[i] = da[i] * a[1][0] + a[0][i] * db[0];
}

void tr_tangent_add_dot(double *const *a, const int *how) {
  const tr_vec *da = (tr_vec *)a[2], *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int i = 0; i < how[0]; ++i) out[0] += (double)how[1] * (da[i] * a[1][i] + a[0][i] * db[i]);
}

void tr_tangent_add_row_dots(double *const *a, const int *how) {
  const tr_vec *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int k = 0; k < how[1]; ++k) {
    const double *row = a[0] + (size_t)k * how[2];
    const tr_vec *drow = (tr_vec *)a[2] + (size_t)k * how[2];
    for (int i = 0; i < how[0]; ++i) out[(size_t)k * how[3]] += drow[i] * a[1][i] + row[i] * db[i];
  }
}

void tr_tangent_add_strided_columns(double *const *a, const int *how) {
  const tr_vec *db = (tr_vec *)a[3];
  tr_vec *out = (tr_vec *)a[4];
  for (int k = 0; k < how[1]; ++k) {
    const double *column = a[0] + (size_t)k * how[2];
    const tr_vec *dcolumn = (tr_vec *)a[2] + (size_t)k * how[2];
    for (int i = 0; i < how[0]; ++i) out[i] += dcolumn[i] * a[1][k] + column[i] * db[k];
  }
}

/* -- execution --------------------------------------------------------------------------------------------------------------------- */

static inline int is_nonzero(const char *live, const int *cells, int count) {
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < cells[2 * i + 1]; ++k)
      if (live[cells[2 * i] + k]) return 1;
  return 0;
}

/* Set the output cells of a skipped call to zero. */
static inline void clear_cells(const tr_directions *d, char *live, tr_vec *v, const int *cells, int count) {
  for (int i = 0; i < count; ++i)
    for (int k = cells[2 * i], end = k + cells[2 * i + 1]; k < end; ++k)
      if (live[k]) memset(v + d->cell[k], 0, sizeof(tr_vec) * (d->cell[k + 1] - d->cell[k])), live[k] = 0;
}

static void execute_tangents(const tr_scene *s, const tr_directions *d, double *const *base, char *live) {
  double *a[MOST_OPERANDS];
  for (const int *code = d->code, *end = code + d->length; code < end;) {
    const int operands = code[1], numbers = code[2], ins = code[3], outs = code[4] + code[5];
    const int *in = code + 6, *out = in + 2 * ins, *at = out + 2 * outs, *how = at + 2 * operands;
    if (is_nonzero(live, in, ins)) {
      for (int i = 0; i < operands; ++i) a[i] = base[at[2 * i]] + at[2 * i + 1];
      s->op[code[0]](a, how);
      for (int i = 0; i < outs; ++i) memset(live + out[2 * i], 1, out[2 * i + 1]);
    } else {
      clear_cells(d, live, (tr_vec *)base[D], out, code[4]);
    }
    code = how + numbers;
  }
}

/* ``seed`` adds direction q to a lane, multiplied by the factor ``by``. ``unseed`` sets the tangents that q changes to zero, in all
 * lanes. */
static void seed(const tr_directions *d, int q, int lane, double by, const double *x, double *v, char *live) {
  for (int i = d->first[q]; i < d->first[q + 1]; ++i) {
    const int *e = d->seed + 3 * i; /* index of the tangent, of its cell, and of its rate of change in x (−1: rate 1) */
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

static void copy_lane(const tr_directions *d, const double *v, int lane, double *out) {
  for (int r = 0; r < d->rows; ++r) out[r] = d->row[r] < 0 ? 0.0 : v[LANES * d->row[r] + lane];
}

/* The work array of a point contains values, then tangents, then a flag for each cell: 1 if the cell is nonzero. */
static double *tangents_of(const tr_scene *s, double *w) { return w + s->point.scratch; }
static char *cells_of(const tr_scene *s, double *w) { return (char *)(tangents_of(s, w) + LANES * s->directions->vectors); }

/* Set all tangents of a new work array to zero. Later passes need no clearing, because every call sets or clears its outputs. */
static void clear_tangents(const tr_scene *s, double *w) {
  memset(tangents_of(s, w), 0, sizeof(tr_vec) * s->directions->vectors), memset(cells_of(s, w), 0, s->directions->cells);
}

/* Compute the values at a point. out receives the outputs of the program. a, extra and out may be null pointers if the program does
 * not use them. */
void tr_parts_d_point(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *w,
                      double *out) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [A] = (double *)a, [EXTRA] = (double *)extra, [T] = w,
        [OUT] = out);
  execute(s, &s->point, base);
}

/* Derivatives along `count` combinations of the directions, at the point of the last ``d_point``. In its work array, the tangents
 * must be zero before the first pass. Row k of `sizes` (stride next) contains a factor for each direction. Row k of `out` (stride
 * next_out) receives the derivatives. */
void tr_parts_d_along(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *w,
                      int count, const double *sizes, size_t next, double *out, size_t next_out) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  double *v = tangents_of(s, w);
  char *live = cells_of(s, w);
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [A] = (double *)a, [EXTRA] = (double *)extra, [T] = w,
        [D] = v);
  for (int k = 0; k < count; k += LANES) {
    const int lanes = count - k < LANES ? count - k : LANES;
    for (int i = 0; i < lanes; ++i)
      for (int q = 0; q < d->directions; ++q)
        if (sizes[(k + i) * next + q] != 0.0) seed(d, q, i, sizes[(k + i) * next + q], x, v, live);
    execute_tangents(s, d, base, live);
    for (int i = 0; i < lanes; ++i) copy_lane(d, v, i, out + (k + i) * next_out);
    for (int q = 0; q < d->directions; ++q) unseed(d, q, v, live);
  }
}

/* The Jacobian J, column-major. */
void tr_parts_j_eval(const double *x, const double *y, const double *c, const double *z, double *w, double *J) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  double *v = tangents_of(s, w);
  char *live = cells_of(s, w);
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [T] = w, [D] = v);
  tr_parts_d_point(x, y, c, z, 0, 0, w, 0);
  clear_tangents(s, w);
  for (int q = 0; q < d->directions; q += LANES) {
    const int *which = d->order + q, lanes = d->directions - q < LANES ? d->directions - q : LANES;
    for (int i = 0; i < lanes; ++i) seed(d, which[i], i, 1.0, x, v, live);
    execute_tangents(s, d, base, live);
    for (int i = 0; i < lanes; ++i) copy_lane(d, v, i, J + (size_t)which[i] * d->rows);
    for (int i = 0; i < lanes; ++i) unseed(d, which[i], v, live);
  }
}

/* -- the linear unit: derivatives of rates and residuals, and of output columns (scene `beside`) ------------------------------- */

void tr_parts_l_prepare(const void *scene, const double *p, double *c) {
  const tr_scene *s = scene;
  tr_parts_prepare(s, p, c), tr_parts_prepare(s->beside, p, c + s->nc);
}

static void differentiate_once(const double *x, const double *y, const double *c, const double *z, const double *a, const double *sizes, double *out) {
  const tr_scene *s = scene_of(c);
  const tr_directions *d = s->directions;
  double *w = malloc(sizeof(double) * (s->point.scratch + (size_t)LANES * d->vectors + d->cells / sizeof(double) + 1));
  for (int r = 0; r < d->rows; ++r) out[r] = NAN;
  if (!w) return;
  tr_parts_d_point(x, y, c, z, a, 0, w, 0);
  clear_tangents(s, w);
  tr_parts_d_along(x, y, c, z, a, 0, w, 1, sizes, 0, out, 0);
  free(w);
}

void tr_parts_l_rates(const double *x, const double *y, const double *c, const double *z, const double *sizes, double *out) {
  differentiate_once(x, y, c, z, 0, sizes, out);
}

void tr_parts_l_columns(const double *x, const double *y, const double *c, const double *z, const double *a, const double *sizes, double *out) {
  differentiate_once(x, y, c + scene_of(c)->nc, z, a, sizes, out);
}
