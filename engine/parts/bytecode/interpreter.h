/* Execution of bytecode programs, shared by interpreter.c and interpreter_tangent.c. */
#ifndef TR_INTERPRETER_H
#define TR_INTERPRETER_H
#include <string.h>

#include "tr_abi.h"

enum { K, P, C, X, Y, W, MAPS, DY, Z, T, N, R, U, OUT, DN, SPEED, A, EXTRA, POWER, D, NONE, SPACES };

#define MOST_OPERANDS 32 /* largest number of operands of one call */
#define BASES(...) double *const base[SPACES] = {[K] = (double *)s->constants, __VA_ARGS__}

void tr_parts_prepare(const void *scene, const double *p, double *c);

static inline const tr_scene *scene_of(const double *c) {
  const tr_scene *scene;
  memcpy(&scene, c, sizeof scene);
  return scene;
}

/* Addresses of the operands of one call, from the last to the first; a case for each number of operands. */
#define OPERAND(i) case (i) + 1: a[i] = base[at[2 * (i)]] + at[2 * (i) + 1]; /* fall through */
#define FOUR_OPERANDS(i) OPERAND((i) + 3) OPERAND((i) + 2) OPERAND((i) + 1) OPERAND(i)

static inline void execute(const tr_scene *s, const tr_program *program, double *const *base) {
  double *a[MOST_OPERANDS];
  for (const int *code = program->code, *end = code + program->length; code < end;) {
    const int operands = code[1], numbers = code[2], *at = code + 3, *how = at + 2 * operands;
    switch (operands) {
      FOUR_OPERANDS(28) FOUR_OPERANDS(24) FOUR_OPERANDS(20) FOUR_OPERANDS(16) FOUR_OPERANDS(12) FOUR_OPERANDS(8) FOUR_OPERANDS(4) FOUR_OPERANDS(0)
    }
    s->op[code[0]](a, how);
    code = how + numbers;
  }
}
/* Dot product, by two independent sums whose additions the processor overlaps. */
static inline double dot(int n, const double *a, const double *b) {
  double sum = 0.0, next = 0.0;
  int k = 0;
  for (; k + 1 < n; k += 2) sum += a[k] * b[k], next += a[k + 1] * b[k + 1];
  if (k < n) sum += a[k] * b[k];
  return sum + next;
}

void tr_op_transposed_product(double *const *a, const int *how); /* defined in ops_loop_factor.c */
void tr_op_cut_joint_friction(double *const *a, const int *how);
void tr_op_factor_loops(double *const *a, const int *how);
void tr_op_solve_loops(double *const *a, const int *how);
void tr_op_curve_foot(double *const *a, const int *how); /* defined in ops_curve_foot.c */
#endif
