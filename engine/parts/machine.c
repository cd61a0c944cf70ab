/* Walks along the tapes of a scene that is made of parts (tape.py): calls of parts with the places of what they read and write. The functions
 * that hosts call are those of a kernel; the scene is found through the first of the constants. */
#include "machine.h"

/* -- functions of the machine itself ------------------------------------------------------------------------------------------- */

void tr_m_zero(double *const *a, const int *how) { memset(a[0], 0, sizeof(double) * how[0]); }

void tr_m_copy(double *const *a, const int *how) { memcpy(a[1], a[0], sizeof(double) * how[0]); }

void tr_m_gather(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[2][i] = how[1 + i] >= 0 ? a[0][how[1 + i]] : a[1][-1 - how[1 + i]];
}

void tr_m_add(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[1][i] += a[0][i];
}

void tr_m_combine(double *const *a, const int *how) {
  const int n = how[0];
  memcpy(a[3], a[0], sizeof(double) * n);
  for (int k = 0; k < how[1]; ++k) {
    const double *column = a[1] + (size_t)k * how[2], z = a[2][k];
    for (int i = 0; i < n; ++i) a[3][i] += column[i] * z;
  }
}

void tr_m_pick(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[1][i] = a[0][how[1 + i]];
}

void tr_m_scale(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[2][i] = a[0][i] * a[1][0];
}

void tr_m_product(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[2][0] += how[1] * a[0][i] * a[1][i];
}

void tr_m_dots(double *const *a, const int *how) {
  for (int k = 0; k < how[1]; ++k) {
    const double *row = a[0] + (size_t)k * how[2];
    double sum = 0.0;
    for (int i = 0; i < how[0]; ++i) sum += row[i] * a[1][i];
    a[2][(size_t)k * how[3]] += sum;
  }
}

void tr_m_along(double *const *a, const int *how) {
  for (int k = 0; k < how[1]; ++k)
    for (int i = 0; i < how[0]; ++i) a[2][i] += a[0][(size_t)k * how[0] + i] * a[1][k];
}

void tr_m_spread(double *const *a, const int *how) {
  for (int k = 0; k < how[1]; ++k)
    for (int i = 0; i < how[0]; ++i) a[2][i] += a[0][(size_t)k * how[2] + i] * a[1][k];
}

void tr_m_gram(double *const *a, const int *how) {
  for (int i = 0; i < how[1]; ++i) a[2][i] += dot(how[0], a[0] + (size_t)i * how[2], a[1]);
}

void tr_m_couple(double *const *a, const int *how) {
  for (int j = 0; j < how[2]; ++j)
    for (int i = 0; i < (how[7] ? j + 1 : how[1]); ++i) {
      double *out = a[2] + i + (size_t)j * how[5], sum = how[6] ? 0.0 : *out;
      *out = a[3][j + (size_t)i * how[5]] = sum + dot(how[0], a[0] + (size_t)i * how[3], a[1] + (size_t)j * how[4]);
    }
}

void tr_m_wrenches(double *const *a, const int *how) {
  memset(a[2], 0, sizeof(double) * how[0] * how[3]);
  for (int k = 0; k < how[3]; ++k) {
    double *column = a[2] + (size_t)k * how[0];
    for (int i = 0; i < 6; ++i) column[how[1] + i] += a[0][6 * how[4 + k] + i];
    for (int i = 0; i < 6; ++i) column[how[2] + i] += a[1][6 * how[4 + k] + i];
  }
}

void tr_m_piece(double *const *a, const int *how) {
  const double *starts = a[1], x = a[0][0];
  int low = 0, high = how[0] - 1;
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (x >= starts[middle]) low = middle;
    else high = middle - 1;
  }
  a[2][0] = starts[low];
  memcpy(a[2] + 1, starts + how[0] + 4 * low, sizeof(double) * 4);
}

void (*const tr_machine_parts[])(double *const *, const int *) = {
    tr_m_zero, tr_m_copy, tr_m_gather, tr_m_add, tr_m_combine, tr_m_pick, tr_m_scale, tr_m_product, tr_m_dots, tr_m_along, tr_m_spread,
    tr_m_gram, tr_m_couple, tr_m_wrenches, tr_meet, tr_grip, tr_factor_loops, tr_solve_loops,
    tr_m_piece, tr_m_foot,
};

/* -- functions of a kernel ------------------------------------------------------------------------------------------------------ */

void tr_parts_prepare(const void *scene, const double *p, double *c) {
  const tr_scene *s = scene;
  memcpy(c, &s, sizeof s);
  BASES([P] = (double *)p, [C] = c);
  walk(s, &s->prepare, base);
}

void tr_parts_stage1(const double *x, const double *y, const double *c, double *w, double *maps, double *dy, double *power) {
  const tr_scene *s = scene_of(c);
  double t[s->stage1.scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [W] = w, [MAPS] = maps, [DY] = dy, [POWER] = power, [T] = t);
  walk(s, &s->stage1, base);
}

void tr_parts_stage2(const double *x, const double *y, const double *c, const double *w, const double *z, double *dy, double *power) {
  const tr_scene *s = scene_of(c);
  double t[s->stage2.scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [W] = (double *)w, [Z] = (double *)z, [DY] = dy, [POWER] = power, [T] = t);
  walk(s, &s->stage2, base);
}

static void at_state(const tr_scene *s, const tr_tape *tape, const double *x, const double *y, const double *c, double *out) {
  double t[tape->scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [OUT] = out, [T] = t);
  walk(s, tape, base);
}

void tr_parts_closure(const double *x, const double *y, const double *c, double *h) {
  at_state(scene_of(c), &scene_of(c)->closure, x, y, c, h);
}

void tr_parts_events(const double *x, const double *y, const double *c, double *g) {
  at_state(scene_of(c), &scene_of(c)->events, x, y, c, g);
}

void tr_parts_energy(const double *x, const double *y, const double *c, double *out) {
  at_state(scene_of(c), &scene_of(c)->energy, x, y, c, out);
}

static void of_friction(const tr_scene *s, const tr_tape *tape, const double *n, const double *r, const double *x, const double *c, double *out,
                        double *dn, double *speed) {
  double t[tape->scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [N] = (double *)n, [R] = (double *)r, [U] = (double *)r, [OUT] = out, [DN] = dn, [SPEED] = speed, [T] = t);
  walk(s, tape, base);
}

void tr_parts_laws(const double *n, const double *r, const double *x, const double *c, double *e, double *dn, double *v) {
  of_friction(scene_of(c), &scene_of(c)->laws, n, r, x, c, e, dn, v);
}

void tr_parts_laws_alone(const double *n, const double *r, const double *x, const double *c, double *e, double *v) {
  of_friction(scene_of(c), &scene_of(c)->laws_alone, n, r, x, c, e, 0, v);
}

void tr_parts_held(const double *n, const double *u, const double *x, const double *c, double *hold, double *dn) {
  of_friction(scene_of(c), &scene_of(c)->held, n, u, x, c, hold, dn, 0);
}

void tr_parts_held_alone(const double *n, const double *u, const double *x, const double *c, double *hold) {
  of_friction(scene_of(c), &scene_of(c)->held_alone, n, u, x, c, hold, 0, 0);
}

void tr_parts_pressed(const double *n, const double *r, const double *x, const double *c, double *more, double *dn) {
  of_friction(scene_of(c), &scene_of(c)->pressed, n, r, x, c, more, dn, 0);
}

void tr_parts_qdot(const double *y, const double *v, const double *c, double *dq) {
  const tr_scene *s = scene_of(c);
  double t[s->qdot.scratch + 1];
  BASES([C] = (double *)c, [Y] = (double *)y, [R] = (double *)v, [OUT] = dq, [T] = t);
  walk(s, &s->qdot, base);
}

void tr_parts_begin(const double *x, const double *y, const double *c, double *w, double *maps, double *dy) {
  const tr_scene *s = scene_of(c);
  double t[s->begin.scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [W] = w, [MAPS] = maps, [DY] = dy, [T] = t);
  walk(s, &s->begin, base);
}

void tr_parts_narrow(const double *c, double *w, const double *moves, const double *dn, double *pivots) {
  const tr_scene *s = scene_of(c);
  double t[s->narrow.scratch + 1];
  BASES([C] = (double *)c, [W] = w, [U] = (double *)moves, [DN] = (double *)dn, [OUT] = pivots, [T] = t);
  walk(s, &s->narrow, base);
}

void tr_parts_respond(const double *c, double *w, const double *less, double *n, double *borne, double *acc) {
  const tr_scene *s = scene_of(c);
  double t[s->respond.scratch + 1];
  BASES([C] = (double *)c, [W] = w, [U] = (double *)less, [N] = n, [OUT] = borne, [A] = acc, [T] = t);
  walk(s, &s->respond, base);
}

void tr_parts_answer(const double *c, double *w, const double *less, double *n, double *acc) {
  const tr_scene *s = scene_of(c);
  double t[s->answer.scratch + 1];
  BASES([C] = (double *)c, [W] = w, [U] = (double *)less, [N] = n, [A] = acc, [T] = t);
  walk(s, &s->answer, base);
}

void tr_parts_shift(const double *c, double *w, const double *gap, double *dv) {
  const tr_scene *s = scene_of(c);
  double t[s->shift.scratch + 1];
  BASES([C] = (double *)c, [W] = w, [U] = (double *)gap, [OUT] = dv, [T] = t);
  walk(s, &s->shift, base);
}

void tr_parts_derive(const double *x, const double *y, const double *c, double *w, const double *z, double *dy, double *power) {
  const tr_scene *s = scene_of(c);
  double t[s->derive.scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [W] = w, [Z] = (double *)z, [DY] = dy, [POWER] = power, [T] = t);
  walk(s, &s->derive, base);
}

static void of_row(const tr_tape *tape, const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra,
                   double *out) {
  const tr_scene *s = scene_of(c);
  double t[tape->scratch + 1];
  BASES([C] = (double *)c, [X] = (double *)x, [Y] = (double *)y, [Z] = (double *)z, [A] = (double *)a, [EXTRA] = (double *)extra, [OUT] = out, [T] = t);
  walk(s, tape, base);
}

void tr_parts_eval(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *out) {
  of_row(&scene_of(c)->eval, x, y, c, z, a, extra, out);
}

void tr_parts_contacts(const double *x, const double *y, const double *c, const double *z, const double *a, double *out) {
  of_row(&scene_of(c)->contacts, x, y, c, z, a, 0, out);
}

void tr_parts_kappa(const double *x, const double *y, const double *c, const double *z, const double *a, double *out) {
  of_row(&scene_of(c)->kappa, x, y, c, z, a, 0, out);
}
