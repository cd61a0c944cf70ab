/* What walks along tapes, for all functions that do. */
#ifndef TR_MACHINE_H
#define TR_MACHINE_H
#include <string.h>

#include "tr_abi.h"

enum { K, P, C, X, Y, W, MAPS, DY, Z, T, N, R, U, OUT, DN, SPEED, A, EXTRA, POWER, D, SPACES };

#define MOST_PLACES 32 /* of a call */
#define BASES(...) double *const base[SPACES] = {[K] = (double *)s->constants, __VA_ARGS__}

void tr_parts_prepare(const void *scene, const double *p, double *c);

static inline const tr_scene *scene_of(const double *c) {
  const tr_scene *scene;
  memcpy(&scene, c, sizeof scene);
  return scene;
}

static inline void walk(const tr_scene *s, const tr_tape *tape, double *const *base) {
  double *a[MOST_PLACES];
  for (const int *code = tape->code, *end = code + tape->length; code < end;) {
    const int places = code[1], numbers = code[2], *at = code + 3, *how = at + 2 * places;
    for (int i = 0; i < places; ++i) a[i] = base[at[2 * i]] + at[2 * i + 1];
    s->part[code[0]](a, how);
    code = how + numbers;
  }
}
/* Two sums that do not wait for each other. */
static inline double dot(int n, const double *a, const double *b) {
  double sum = 0.0, next = 0.0;
  int k = 0;
  for (; k + 1 < n; k += 2) sum += a[k] * b[k], next += a[k + 1] * b[k + 1];
  if (k < n) sum += a[k] * b[k];
  return sum + next;
}

void tr_meet(double *const *a, const int *how); /* of many loops that rub (``coupled.c``) */
void tr_grip(double *const *a, const int *how);
void tr_factor_loops(double *const *a, const int *how);
void tr_solve_loops(double *const *a, const int *how);
void tr_m_foot(double *const *a, const int *how); /* of curves (``foot.c``) */
#endif
