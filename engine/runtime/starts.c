/* Other starts of Newton's iteration on the complement equations, where the usual ones (the last friction, none, a ball's tilt) have found
 * nothing and the run would end: friction that grows from none to its whole along a path, then chance. In order of cost. */
#include "modes.h"

#define PART_FIRST 0.25  /* of friction: the first step of its growth; */
#define PART_GROWS 1.5   /* a step that succeeds makes the next longer, one that fails shorter by half, */
#define PART_LEAST 1e-3  /* down to this */
#define CHANCES 24       /* starts by chance, within multiples of the friction that the forces without it would cause */
#define FAR 1e6          /* times that friction: Newton's iteration has run away along a direction in which friction makes just itself */
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

/* Whether every pair is on the branch its mode says, at the solution in place: sliding faster than the law's kink or not, inside a ball's
 * cone or not. */
static int tr_fits_branches(const tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    const tr_sliding *v = tr_sliding_of(s, i);
    int flag = tr_flag(tr_mode_of(s, i));
    if (pair->kind == TR_KIND_KINK && (flag == TR_SATURATED) != (fabs(v->speed) > v->border)) return 0;
    if (pair->kind == TR_KIND_SET && pair->cone && flag != TR_STUCK && (flag == TR_CONE) != (v->cone < 0.0)) return 0;
  }
  return 1;
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

/* Whether what Newton's iteration has come to is of a size that a root can be; the law there is then in place. */
static int tr_is_near(tr_sim *s, const double *size, const double *eta) {
  double most = 0.0, load = 0.0;
  for (int i = 0; i < s->k->neta; ++i) most = fmax(most, fabs(eta[i])), load = fmax(load, size[i]);
  tr_law(s, eta);
  return most <= FAR * load;
}

/* Whether it is a root: of such a size, and on the branches that the modes say. */
static int tr_is_root(tr_sim *s, const double *size, const double *eta) { return tr_is_near(s, size, eta) && tr_fits_branches(s); }

/* Whether all that is amiss at the solution in place is that balls that are to slide are inside their cones: where modes are decided they
 * then turn about their contacts (``settle.c``, ``start.c``), and from there that root is near. */
static int tr_balls_would_spin(tr_sim *s) {
  tr_mode modes[s->k->nsliders + 1];
  tr_keep_modes(s, modes);
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set(s, i) && tr_slides_on_cone(s, i) && tr_sliding_of(s, i)->cone < 0.0) tr_mode_of(s, i)->flag = TR_CONE;
  int fits = tr_fits_branches(s);
  tr_put_modes(s, modes);
  return fits;
}

/* η from any of these, where it is on the branches that the modes say; failing that, where balls have to turn about their contacts. */
static int tr_newton_anywhere(tr_sim *s, double *eta) {
  double size[s->k->neta], spinning[s->k->neta];
  int spins = 0;
  unsigned seed = 12345u;
  tr_start_sizes(s, size);
  for (int start = 0; start <= CHANCES; ++start) { /* the first is the path */
    if (start) tr_chance(s, size, start, &seed, eta);
    if (!(start ? tr_newton(s, eta) : tr_newton_by_parts(s, eta))) continue;
    if (!tr_is_near(s, size, eta)) continue;
    if (tr_fits_branches(s)) return 1;
    if (!spins && tr_balls_would_spin(s)) memcpy(spinning, eta, sizeof spinning), spins = 1;
  }
  if (spins) memcpy(eta, spinning, sizeof spinning), tr_law(s, eta);
  return spins;
}
