/* Balls that slide near their friction cone. Friction there goes as the root of the distance to the cone (``contact/ball.py``), which no
 * Newton iteration follows, and the distance itself is lost in round-off: at tilt u = s/|ω| it is u². With u given everything is smooth:
 * what is left is the root of φ(u) = distance(η(u)) − u², one number in [0, 1]. φ(1) ≤ 0 always; φ(0) > 0 says that the ball cannot turn
 * without sliding, and then there is a root. */
#include "modes.h"

#define NO_TILT 1e-60    /* stands for a tilt of nothing: 0 would say that none is given */
#define TILT_STEP 1e-6   /* first step from there: its square is far above round-off */
#define TILT_MAX 80      /* bisections alone need 50 */
#define TILT_FOUND 1e-14 /* of the tilt: its last digits, which nothing depends on */
#define TILT_BRACKET 1e-15 /* of its upper end: a bracket that has closed */

/* Whether the pair is a ball that slides, and so may come near its cone. */
static inline int tr_slides_on_cone(const tr_sim *s, int i) {
  return tr_pair_of(s, i)->cone && tr_is_set(s, i) && tr_flag(tr_mode_of(s, i)) == TR_SLIPS;
}

/* Distance of ball i to its cone (s²/|ω|²) with friction at tilt u; η holds the solution. NaN when there is none. */
static double tr_cone_at(tr_sim *s, double *eta, int i, double u) {
  tr_mode_of(s, i)->tilt = u;
  int ok = tr_newton(s, eta);
  if (ok) tr_law(s, eta);
  tr_mode_of(s, i)->tilt = 0.0;
  return ok ? tr_sliding_of(s, i)->border : NAN;
}

/* The root of ball i, from η. Steps: the root of the parabola u² = the straight line through the last two distances. */
static int tr_tilt_of(tr_sim *s, double *eta, int i) {
  double c0 = tr_cone_at(s, eta, i, NO_TILT), u = TILT_STEP, was = 0.0, lo = 0.0, hi = 1.0;
  if (!(c0 > 0.0)) return 0;
  for (int it = 0; it < TILT_MAX; ++it) {
    double c = tr_cone_at(s, eta, i, u), slope = (c - c0) / (u - was);
    if (!(c == c)) return 0;
    if (c - u * u > 0.0) lo = u; else hi = u;
    double half = 0.5 * slope, rest = c - slope * u, root = sqrt(fmax(half * half + rest, 0.0));
    double next = half > 0.0 ? half + root : rest / (root - half);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (fabs(next - u) <= TILT_FOUND * u + NO_TILT || hi - lo <= TILT_BRACKET * hi) return 1;
    was = u, c0 = c, u = next;
  }
  return 0;
}

/* η by the tilt of one ball that slides near its cone, tried in turn; 1 when found. */
static int tr_newton_by_tilt(tr_sim *s, const double *warm) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_slides_on_cone(s, i)) continue;
    double *eta = TR_A(s, z) + s->k->active;
    memcpy(eta, warm, sizeof(double) * s->k->neta);
    if (tr_tilt_of(s, eta, i)) return 1;
  }
  return 0;
}
