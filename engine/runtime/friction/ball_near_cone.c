/* Balls that slide near their friction cone (theory, "Ball near its cone"). Near the cone, friction varies as the square root of
 * the distance to the cone (``contact/ball_in_socket.py``), and Newton's method does not converge. The distance is u², where u =
 * s/|ω| is the tilt. For small tilts, u² is below round-off.
 *
 * With a prescribed u, the equations for η are smooth. The remaining problem is the root of φ(u) = distance(η(u)) − u² in [0, 1].
 * φ(1) ≤ 0 always. If φ(0) > 0, the ball cannot spin without sliding, and a root exists. */
#include "friction/friction.h"

#define NO_TILT 1e-60 /* stands for a tilt of zero, because a zero in the mode means that no tilt is prescribed */
#define TILT_STEP 1e-6 /* first tilt; its square is far above round-off */
#define TILT_IS 1e-9 /* relative to the square of a tilt: a smaller residual φ is round-off */
#define TILT_NEAR 1e-4 /* relative to a tilt: first distance from this tilt in the search for a root near it */
#define TILT_WIDENS 8.0 /* ratio of successive distances in the search near a tilt */
#define TILT_GROWS 1.5 /* ratio of successive tilts in the search over all tilts */
#define TILT_MAX 80 /* largest number of iterations; bisections alone need 50 */
#define TILT_SWEEPS 30 /* largest number of sweeps over the tilts of several balls */
#define TILT_SAME 1e-12 /* relative to a tilt: if the last sweep changed no tilt by more, the sweeps have converged */
#define TILT_FOUND 1e-14 /* relative to the tilt: a smaller change of the tilt has no effect */
#define TILT_BRACKET 1e-15 /* relative to the upper end of the bracket: a narrower bracket has converged */
#define TILT_BEYOND 1e-3 /* relative to the tilt at the kink: sliding is tried at a tilt larger by this much; far above round-off */

/* Distance s²/|ω|² of ball i to its cone at the tilt u. eta receives the solution. Returns NaN if there is no solution. */
static double tr_cone_distance_at_tilt(tr_sim *s, double *eta, int i, double u) {
  tr_mode_of(s, i)->tilt = u;
  int ok = tr_newton(s, eta);
  if (ok) tr_evaluate_laws(s, eta);
  return ok ? tr_sliding_of(s, i)->cone : NAN;
}

/* Find the root of ball i above the tilt `lo`, starting from eta and the tilt u. The tilt is stored in the mode of the ball. c0:
 * distance at the tilt `was`. Each step intersects the parabola u² with the secant through two values of the distance. Returns 1 on
 * success. */
static int tr_find_tilt_above(tr_sim *s, double *eta, int i, double lo, double was, double c0, double u) {
  double hi = 1.0;
  for (int it = 0; it < TILT_MAX; ++it) {
    double c = tr_cone_distance_at_tilt(s, eta, i, u), slope = (c - c0) / (u - was);
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

static int tr_find_tilt(tr_sim *s, double *eta, int i) {
  double c0 = tr_cone_distance_at_tilt(s, eta, i, NO_TILT);
  return c0 > 0.0 ? tr_find_tilt_above(s, eta, i, 0.0, 0.0, c0, TILT_STEP) : c0 == c0;
}

static void tr_clear_tilts(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_pair_of(s, i)->cone) tr_mode_of(s, i)->tilt = 0.0;
}

static int tr_find_tilt_beyond_kink(tr_sim *s, double *eta, int i) {
  const double kink = sqrt(fmax(tr_sliding_of(s, i)->cone, 0.0)), u = kink * (1.0 + TILT_BEYOND);
  double was[s->k->neta + 1];
  if (!(kink > 0.0)) return 0;
  memcpy(was, eta, sizeof(double) * s->k->neta);
  const int beyond = tr_cone_distance_at_tilt(s, eta, i, u) > u * u && tr_find_tilt_above(s, eta, i, kink, kink, kink * kink, u);
  tr_clear_tilts(s);
  if (!beyond) memcpy(eta, was, sizeof(double) * s->k->neta);
  return beyond;
}

/* Find the root of ball i between the tilts a and b, by the Illinois method (safeguarded secant). The values fa and fb of φ have
 * opposite signs. Returns 1 on success. */
static int tr_find_tilt_between(tr_sim *s, double *eta, int i, double a, double fa, double b, double fb) {
  int side = 0;
  for (int it = 0; it < TILT_MAX; ++it) {
    double m = (a * fb - b * fa) / (fb - fa);
    if (!((m - a) * (m - b) < 0.0)) m = 0.5 * (a + b);
    const double f = tr_cone_distance_at_tilt(s, eta, i, m) - m * m;
    if (!(f == f)) return 0;
    if (f * fb > 0.0) {
      b = m, fb = f;
      if (side == 1) fa *= 0.5;
      side = 1;
    } else {
      a = m, fa = f;
      if (side == -1) fb *= 0.5;
      side = -1;
    }
    if (f == 0.0 || fabs(b - a) <= TILT_FOUND * fmax(a, b)) return 1;
  }
  return 0;
}

/* Find the root of ball i near the tilt that belongs to the last root eta. Returns 1 on success. */
static int tr_find_tilt_near(tr_sim *s, double *eta, int i) {
  double here[s->k->neta + 1];
  tr_evaluate_laws(s, eta);
  const double u = sqrt(fmax(tr_sliding_of(s, i)->cone, 0.0));
  if (!(u > TILT_STEP)) return 0;
  const double f = tr_cone_distance_at_tilt(s, eta, i, u) - u * u;
  if (fabs(f) <= TILT_IS * u * u) return 1;
  memcpy(here, eta, sizeof(double) * s->k->neta);
  for (double part = TILT_NEAR; f == f && part < 1.0; part *= TILT_WIDENS)
    for (int side = -1; side <= 1; side += 2) {
      const double v = u * (1.0 + side * part);
      memcpy(eta, here, sizeof(double) * s->k->neta);
      if (v > 1.0) continue;
      const double g = tr_cone_distance_at_tilt(s, eta, i, v) - v * v;
      if (g * f <= 0.0) return tr_find_tilt_between(s, eta, i, u, f, v, g);
    }
  return 0;
}

static int tr_search_tilt(tr_sim *s, double *eta, int i) {
  double last[s->k->neta + 1], lo = 0.0, c0 = 0.0;
  for (double u = TILT_STEP; u < 1.0; u *= TILT_GROWS) {
    memcpy(last, eta, sizeof(double) * s->k->neta);
    const double c = tr_cone_distance_at_tilt(s, eta, i, u);
    if (c - u * u > 0.0) lo = u, c0 = c;
    if (!(c == c)) memcpy(eta, last, sizeof(double) * s->k->neta);
  }
  const int found = lo > 0.0 && tr_cone_distance_at_tilt(s, eta, i, lo) > lo * lo && tr_find_tilt_above(s, eta, i, lo, lo, c0, lo * (1.0 + TILT_BEYOND));
  tr_clear_tilts(s);
  return found;
}

/* Find η by searches for the tilts of all sliding balls, if there are at least two. A sweep solves for one tilt after another.
 * Returns 1 on success. */
static int tr_newton_by_all_tilts(tr_sim *s, double *eta) {
  int balls = 0, ok = 1, moved = 1;
  for (int i = 0; i < s->k->nsliders; ++i) balls += tr_is_sliding_ball(s, i);
  for (int sweep = 0; balls > 1 && ok && moved && sweep < TILT_SWEEPS; ++sweep) {
    moved = 0;
    for (int i = 0; i < s->k->nsliders && ok; ++i) {
      if (!tr_is_sliding_ball(s, i)) continue;
      double was = tr_mode_of(s, i)->tilt;
      ok = tr_find_tilt(s, eta, i);
      moved |= !(fabs(tr_mode_of(s, i)->tilt - was) <= TILT_SAME * was);
    }
  }
  tr_clear_tilts(s);
  return balls > 1 && ok && !moved;
}

/* Find η by a search near the tilt that ball i has at the frictions `warm`. Returns 1 on success. */
static int tr_newton_by_ball_tilt(tr_sim *s, const double *warm, int i) {
  double *eta = TR_A(s, z) + s->k->active;
  memcpy(eta, warm, sizeof(double) * s->k->neta);
  const int found = tr_find_tilt_near(s, eta, i);
  tr_clear_tilts(s);
  return found;
}

/* Call tr_newton_by_ball_tilt for one sliding ball after another, until a root is found. (From zero friction, Newton's method may
 * instead find an invalid root inside the cone.) */
static int tr_newton_by_near_tilt(tr_sim *s, const double *warm) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_sliding_ball(s, i) && tr_newton_by_ball_tilt(s, warm, i)) return 1;
  return 0;
}

/* Find η by the tilt of one sliding ball, tried for one ball after another. If no ball gives a root, find η by the tilts of all
 * balls. Returns 1 on success. */
static int tr_newton_by_any_tilt(tr_sim *s, const double *warm) {
  double *eta = TR_A(s, z) + s->k->active;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_is_sliding_ball(s, i)) continue;
    if (tr_newton_by_ball_tilt(s, warm, i)) return 1;
    memcpy(eta, warm, sizeof(double) * s->k->neta);
    const int found = tr_find_tilt(s, eta, i);
    tr_clear_tilts(s);
    if (found) return 1;
  }
  memcpy(eta, warm, sizeof(double) * s->k->neta);
  return tr_newton_by_all_tilts(s, eta);
}
