/* Other starts of Newton's iteration on the complement equations, where the usual ones (the last friction, none, a ball's tilt) have found
 * nothing and the run would end: friction that grows from none to its whole along a path, then chance. In order of cost. */
#include "modes.h"

#define PART_FIRST 0.25  /* of friction: the first step of its growth; */
#define PART_GROWS 1.5   /* a step that succeeds makes the next longer, one that fails shorter by half, */
#define PART_LEAST 1e-3  /* down to this */
#define CHANCES 24       /* starts by chance, within multiples of the friction that the forces without it would cause */
#define NO_LOAD 1e-9     /* N or N m: least size of these */

/* The next of a fixed sequence of numbers within ±1. */
static double tr_next_number(unsigned *seed) {
  *seed = *seed * 1664525u + 1013904223u;
  return (double)(*seed >> 8) / 8388608.0 - 1.0;
}

/* Residual and Jacobian of the laws where friction is a part of what they say. */
static void tr_ease(const tr_sim *s, const double *eta, double *r, double *J) {
  int e = s->k->neta;
  double part = 1.0 - s->friction.eased;
  for (int i = 0; i < e; ++i) r[i] = part * TR_A(s, law)[i] - eta[i];
  for (int j = 0; j < e; ++j)
    for (int i = 0; i < e; ++i) J[i + j * e] = part * J[i + j * e] + (i == j) * (1.0 - part);
}

/* η along the path on which friction grows from none. */
static int tr_newton_by_parts(tr_sim *s, double *eta) {
  int e = s->k->neta, ok;
  double last[e], part = 0.0, step = PART_FIRST;
  memset(eta, 0, sizeof last);
  s->friction.eased = 1.0;
  ok = tr_newton(s, eta);
  while (ok && part < 1.0) {
    double next = fmin(part + step, 1.0);
    memcpy(last, eta, sizeof last);
    s->friction.eased = 1.0 - next;
    if (tr_newton(s, eta)) part = next, step *= PART_GROWS;
    else memcpy(eta, last, sizeof last), step *= 0.5, ok = step > PART_LEAST;
  }
  s->friction.eased = 0.0;
  return ok;
}

/* How large the friction of each pair would be in the forces without it: sizes of starts (neta). After tr_eliminate. */
static void tr_start_sizes(tr_sim *s, double *size) {
  const tr_kernel *k = s->k;
  double none[k->neta];
  memset(none, 0, sizeof none);
  tr_law(s, none);
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double most = NO_LOAD;
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) most = fmax(most, fabs(TR_A(s, law)[j]));
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) size[j] = most;
  }
}

/* A start by chance, the `which`-th. */
static void tr_chance(const tr_sim *s, const double *size, int which, unsigned *seed, double *eta) {
  double reach = which ? pow(3.0, which % 4 - 1.0) : 0.0;
  for (int i = 0; i < s->k->neta; ++i) eta[i] = reach * size[i] * tr_next_number(seed);
}

/* η from any of these. */
static int tr_newton_anywhere(tr_sim *s, double *eta) {
  double size[s->k->neta];
  unsigned seed = 12345u;
  if (tr_newton_by_parts(s, eta)) return 1;
  tr_start_sizes(s, size);
  for (int start = 1; start <= CHANCES; ++start) {
    tr_chance(s, size, start, &seed, eta);
    if (tr_newton(s, eta)) return 1;
  }
  return 0;
}
