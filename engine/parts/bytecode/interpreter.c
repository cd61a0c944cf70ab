/* Bytecode interpreter, which executes the programs of a scene (program.py). A program is a list of calls of ops with operands.
 * Hosts call the functions of this file like those of a compiled kernel. The first constant in c contains the address of the
 * scene. */
#include "interpreter.h"

/* -- builtin ops; operands and integers: ``Builtin`` in program.py ------------------------------------------------------------- */

void tr_op_zero(double *const *a, const int *how) { memset(a[0], 0, sizeof(double) * how[0]); }

void tr_op_copy(double *const *a, const int *how) { memcpy(a[1], a[0], sizeof(double) * how[0]); }

void tr_op_gather(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[2][i] = how[1 + i] >= 0 ? a[0][how[1 + i]] : a[1][-1 - how[1 + i]];
}

void tr_op_add(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[1][i] += a[0][i];
}

void tr_op_combine(double *const *a, const int *how) {
  const int n = how[0];
  memcpy(a[3], a[0], sizeof(double) * n);
  for (int k = 0; k < how[1]; ++k) {
    const double *column = a[1] + (size_t)k * how[2], z = a[2][k];
    for (int i = 0; i < n; ++i) a[3][i] += column[i] * z;
  }
}

void tr_op_select(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[1][i] = a[0][how[1 + i]];
}

void tr_op_scale(double *const *a, const int *how) {
  for (int i = 0; i < how[0]; ++i) a[2][i] = a[0][i] * a[1][0];
}

void tr_op_add_dot(double *const *a, const int *how) {
  a[2][0] += how[1] * dot(how[0], a[0], a[1]);
}

void tr_op_add_row_dots(double *const *a, const int *how) {
  for (int k = 0; k < how[1]; ++k) {
    a[2][(size_t)k * how[3]] += dot(how[0], a[0] + (size_t)k * how[2], a[1]);
  }
}

void tr_op_add_columns(double *const *a, const int *how) {
  for (int k = 0; k < how[1]; ++k)
    for (int i = 0; i < how[0]; ++i) a[2][i] += a[0][(size_t)k * how[0] + i] * a[1][k];
}

void tr_op_add_strided_columns(double *const *a, const int *how) {
  for (int k = 0; k < how[1]; ++k)
    for (int i = 0; i < how[0]; ++i) a[2][i] += a[0][(size_t)k * how[2] + i] * a[1][k];
}

void tr_op_add_transposed_product(double *const *a, const int *how) {
  for (int i = 0; i < how[1]; ++i) a[2][i] += dot(how[0], a[0] + (size_t)i * how[2], a[1]);
}

void tr_op_mirrored_product(double *const *a, const int *how) {
  for (int j = 0; j < how[2]; ++j)
    for (int i = 0; i < (how[7] ? j + 1 : how[1]); ++i) {
      double *out = a[2] + i + (size_t)j * how[5], sum = how[6] ? 0.0 : *out;
      *out = a[3][j + (size_t)i * how[5]] = sum + dot(how[0], a[0] + (size_t)i * how[3], a[1] + (size_t)j * how[4]);
    }
}

void tr_op_wrench_columns(double *const *a, const int *how) {
  memset(a[2], 0, sizeof(double) * how[0] * how[3]);
  for (int k = 0; k < how[3]; ++k) {
    double *column = a[2] + (size_t)k * how[0];
    for (int i = 0; i < 6; ++i) column[how[1] + i] += a[0][6 * how[4 + k] + i];
    for (int i = 0; i < 6; ++i) column[how[2] + i] += a[1][6 * how[4 + k] + i];
  }
}

void tr_op_curve_piece(double *const *a, const int *how) {
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

void tr_op_shared(double *const *a, const int *how) {
  const tr_scene *s = scene_of(a[0]);
  const tr_program range = {.length = how[1], .code = s->shared.code + how[0]};
  BASES([C] = a[0], [X] = a[1], [Y] = a[2], [W] = a[3], [MAPS] = a[4], [T] = a[5]);
  execute(s, &range, base);
}

void (*const tr_builtin_ops[])(double *const *, const int *) = {
    tr_op_zero, tr_op_copy, tr_op_gather, tr_op_add, tr_op_combine, tr_op_select, tr_op_scale, tr_op_add_dot, tr_op_add_row_dots, tr_op_add_columns, tr_op_add_strided_columns,
    tr_op_add_transposed_product, tr_op_mirrored_product, tr_op_wrench_columns, tr_op_transposed_product, tr_op_cut_joint_friction, tr_op_factor_loops, tr_op_solve_loops,
    tr_op_curve_piece, tr_op_curve_foot, tr_op_shared,
};

/* -- functions of a kernel ------------------------------------------------------------------------------------------------------ */

void tr_parts_prepare(const void *scene, const double *p, double *c) {
  const tr_scene *s = scene;
  memcpy(c, &s, sizeof s);
  BASES([P] = (double *)p, [C] = c);
  execute(s, &s->prepare, base);
}

/* Execute a program of the scene; c contains the address of the scene. The last arguments give an array for each space that the
 * program uses. */
#define EXECUTE(c, program, ...)                                        \
  do {                                                                  \
    const tr_scene *s = scene_of(c);                                    \
    double t[s->program.scratch + 1];                                   \
    BASES([C] = (double *)(c), [T] = t, __VA_ARGS__);                   \
    execute(s, &s->program, base);                                      \
  } while (0)
#define IN(a) ((double *)(a)) /* programs do not write arrays that a host passes as const */

void tr_parts_stage1(const double *x, const double *y, const double *c, double *w, double *maps, double *dy, double *power) {
  EXECUTE(c, stage1, [X] = IN(x), [Y] = IN(y), [W] = w, [MAPS] = maps, [DY] = dy, [POWER] = power);
}

void tr_parts_stage2(const double *x, const double *y, const double *c, const double *w, const double *z, double *dy, double *power) {
  EXECUTE(c, stage2, [X] = IN(x), [Y] = IN(y), [W] = IN(w), [Z] = IN(z), [DY] = dy, [POWER] = power);
}

void tr_parts_closure(const double *x, const double *y, const double *c, double *h) {
  EXECUTE(c, closure, [X] = IN(x), [Y] = IN(y), [OUT] = h);
}

void tr_parts_events(const double *x, const double *y, const double *c, double *g) {
  EXECUTE(c, events, [X] = IN(x), [Y] = IN(y), [OUT] = g);
}

void tr_parts_energy(const double *x, const double *y, const double *c, double *out) {
  EXECUTE(c, energy, [X] = IN(x), [Y] = IN(y), [OUT] = out);
}

void tr_parts_laws(const double *n, const double *r, const double *x, const double *c, double *e, double *dn, double *v) {
  EXECUTE(c, laws, [X] = IN(x), [N] = IN(n), [R] = IN(r), [OUT] = e, [DN] = dn, [SPEED] = v);
}

void tr_parts_laws_alone(const double *n, const double *r, const double *x, const double *c, double *e, double *v) {
  EXECUTE(c, laws_alone, [X] = IN(x), [N] = IN(n), [R] = IN(r), [OUT] = e, [SPEED] = v);
}

void tr_parts_held(const double *n, const double *u, const double *x, const double *c, double *hold, double *dn) {
  EXECUTE(c, held, [X] = IN(x), [N] = IN(n), [R] = IN(u), [U] = IN(u), [OUT] = hold, [DN] = dn);
}

void tr_parts_held_alone(const double *n, const double *u, const double *x, const double *c, double *hold) {
  EXECUTE(c, held_alone, [X] = IN(x), [N] = IN(n), [R] = IN(u), [U] = IN(u), [OUT] = hold);
}

void tr_parts_pressed(const double *n, const double *r, const double *u, const double *x, const double *c, double *more, double *dn) {
  EXECUTE(c, pressed, [X] = IN(x), [N] = IN(n), [R] = IN(r), [U] = IN(u), [OUT] = more, [DN] = dn);
}

void tr_parts_qdot(const double *y, const double *v, const double *c, double *dq) {
  EXECUTE(c, qdot, [Y] = IN(y), [R] = IN(v), [OUT] = dq);
}

void tr_parts_begin(const double *x, const double *y, const double *c, double *w, double *maps, double *dy) {
  EXECUTE(c, begin, [X] = IN(x), [Y] = IN(y), [W] = w, [MAPS] = maps, [DY] = dy);
}

void tr_parts_narrow(const double *c, double *w, const double *moves, const double *dn, double *pivots) {
  EXECUTE(c, narrow, [W] = w, [U] = IN(moves), [DN] = IN(dn), [OUT] = pivots);
}

void tr_parts_respond(const double *c, double *w, const double *less, double *n, double *borne, double *acc) {
  EXECUTE(c, respond, [W] = w, [U] = IN(less), [N] = n, [OUT] = borne, [A] = acc);
}

void tr_parts_answer(const double *c, double *w, const double *less, double *n, double *acc) {
  EXECUTE(c, answer, [W] = w, [U] = IN(less), [N] = n, [A] = acc);
}

void tr_parts_shift(const double *c, double *w, const double *gap, double *dv) {
  EXECUTE(c, shift, [W] = w, [U] = IN(gap), [OUT] = dv);
}

void tr_parts_derive(const double *x, const double *y, const double *c, double *w, const double *z, double *dy, double *power) {
  EXECUTE(c, derive, [X] = IN(x), [Y] = IN(y), [W] = w, [Z] = IN(z), [DY] = dy, [POWER] = power);
}

void tr_parts_eval(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *out) {
  EXECUTE(c, eval, [X] = IN(x), [Y] = IN(y), [Z] = IN(z), [A] = IN(a), [EXTRA] = IN(extra), [OUT] = out);
}

void tr_parts_contacts(const double *x, const double *y, const double *c, const double *z, const double *a, double *out) {
  EXECUTE(c, contacts, [X] = IN(x), [Y] = IN(y), [Z] = IN(z), [A] = IN(a), [OUT] = out);
}

void tr_parts_kappa(const double *x, const double *y, const double *c, const double *z, const double *a, double *out) {
  EXECUTE(c, kappa, [X] = IN(x), [Y] = IN(y), [Z] = IN(z), [A] = IN(a), [OUT] = out);
}
