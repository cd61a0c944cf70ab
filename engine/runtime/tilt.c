/* Balls that slide near their friction cone. Friction there goes as the root of the distance to the cone (``contact/ball.py``), which no
 * Newton iteration follows, and the distance itself is lost in round-off: at tilt u = s/|ω| it is u². With u given everything is smooth:
 * what is left is the root of φ(u) = distance(η(u)) − u², one number in [0, 1]. φ(1) ≤ 0 always; φ(0) > 0 says that the ball cannot turn
 * without sliding, and then there is a root. */
#include "modes.h"

#define NO_TILT 1e-60    /* stands for a tilt of nothing: 0 would say that none is given */
#define TILT_STEP 1e-6   /* first step from there: its square is far above round-off */
#define TILT_IS 1e-9     /* of a tilt's square: φ is no farther from 0 than round-off of the distance makes it */
#define TILT_NEAR 1e-4   /* of a tilt: so far from it, */
#define TILT_WIDENS 8.0  /* and so many times farther again and again, its root is looked for */
#define TILT_GROWS 1.5   /* to the next, where they are looked through: they are of all sizes */
#define TILT_MAX 80      /* bisections alone need 50 */
#define TILT_SWEEPS 30   /* over the tilts of several balls */
#define TILT_SAME 1e-12  /* of a tilt: a sweep that moves none by more has found them */
#define TILT_FOUND 1e-14 /* of the tilt: its last digits, which nothing depends on */
#define TILT_BRACKET 1e-15 /* of its upper end: a bracket that has closed */
#define TILT_BEYOND 1e-3 /* of the tilt at a kink: so far above it is looked whether sliding goes on; far above round-off of the distance */

/* Whether pair i is a ball that slides (a law with a kink: faster than that), so that friction may have to be found by its tilt. */
static inline int tr_slides_on_cone(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  int flag = tr_flag(tr_mode_of(s, i));
  return pair->cone && (pair->kind == TR_KIND_SET ? flag == TR_SLIPS : pair->kind == TR_KIND_KINK && flag == TR_SATURATED);
}

/* Distance of ball i to its cone (s²/|ω|²) with friction at tilt u; η holds the solution. NaN when there is none. */
static double tr_cone_at(tr_sim *s, double *eta, int i, double u) {
  tr_mode_of(s, i)->tilt = u;
  int ok = tr_newton(s, eta);
  if (ok) tr_law(s, eta);
  return ok ? tr_sliding_of(s, i)->cone : NAN;
}

/* The root of ball i above the tilt `lo`, from η; its mode holds the tilt, first u. c0: distance at the tilt `was`. Steps: the root of the
 * parabola u² = the straight line through the last two distances. */
static int tr_tilt_above(tr_sim *s, double *eta, int i, double lo, double was, double c0, double u) {
  double hi = 1.0;
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

/* The root of ball i, from η; its mode holds the tilt. Inside the cone, where it need not slide, the tilt is nothing: what a trial step
 * past the end of sliding needs. */
static int tr_tilt_of(tr_sim *s, double *eta, int i) {
  double c0 = tr_cone_at(s, eta, i, NO_TILT);
  return c0 > 0.0 ? tr_tilt_above(s, eta, i, 0.0, 0.0, c0, TILT_STEP) : c0 == c0;
}

static void tr_forget_tilts(tr_sim *s);

/* Whether the sliding of ball i, which has come from below to the kink of its law at the state just evaluated, cannot go on from there: to
 * slide faster it would have to be further inside its cone. Then φ > 0 just above the tilt it has, its root is beyond, and η is there. */
static int tr_slides_elsewhere(tr_sim *s, double *eta, int i) {
  const double kink = sqrt(fmax(tr_sliding_of(s, i)->cone, 0.0)), u = kink * (1.0 + TILT_BEYOND);
  double was[s->k->neta + 1];
  if (!(kink > 0.0)) return 0;
  memcpy(was, eta, sizeof(double) * s->k->neta);
  const int beyond = tr_cone_at(s, eta, i, u) > u * u && tr_tilt_above(s, eta, i, kink, kink, kink * kink, u);
  tr_forget_tilts(s);
  if (!beyond) memcpy(eta, was, sizeof(double) * s->k->neta);
  return beyond;
}

/* No tilt is given any more. */
static void tr_forget_tilts(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) tr_mode_of(s, i)->tilt = 0.0;
}

/* The root of ball i between the tilts a and b, at which φ is fa and fb, of unlike signs: a safeguarded secant (Illinois). */
static int tr_tilt_between(tr_sim *s, double *eta, int i, double a, double fa, double b, double fb) {
  int side = 0;
  for (int it = 0; it < TILT_MAX; ++it) {
    double m = (a * fb - b * fa) / (fb - fa);
    if (!((m - a) * (m - b) < 0.0)) m = 0.5 * (a + b);
    const double f = tr_cone_at(s, eta, i, m) - m * m;
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

/* The root of ball i that is near the tilt of the friction η: the one that has been followed, where there are several. 1 when found. */
static int tr_tilt_near(tr_sim *s, double *eta, int i) {
  double here[s->k->neta + 1];
  tr_law(s, eta);
  const double u = sqrt(fmax(tr_sliding_of(s, i)->cone, 0.0));
  if (!(u > TILT_STEP)) return 0;
  const double f = tr_cone_at(s, eta, i, u) - u * u;
  if (fabs(f) <= TILT_IS * u * u) return 1; /* where two roots meet φ does not change its sign */
  memcpy(here, eta, sizeof(double) * s->k->neta);
  for (double part = TILT_NEAR; f == f && part < 1.0; part *= TILT_WIDENS)
    for (int side = -1; side <= 1; side += 2) {
      const double v = u * (1.0 + side * part);
      memcpy(eta, here, sizeof(double) * s->k->neta);
      if (v > 1.0) continue;
      const double g = tr_cone_at(s, eta, i, v) - v * v;
      if (g * f <= 0.0) return tr_tilt_between(s, eta, i, u, f, v, g);
    }
  return 0;
}

/* A root of ball i also where φ(0) ≤ 0, between which and φ(1) ≤ 0 it may be positive: looked for from small tilts on, from η. 1 when found. */
static int tr_tilt_anywhere(tr_sim *s, double *eta, int i) {
  double last[s->k->neta + 1], lo = 0.0, c0 = 0.0;
  for (double u = TILT_STEP; u < 1.0; u *= TILT_GROWS) {
    memcpy(last, eta, sizeof(double) * s->k->neta);
    const double c = tr_cone_at(s, eta, i, u);
    if (c - u * u > 0.0) lo = u, c0 = c;
    if (!(c == c)) memcpy(eta, last, sizeof(double) * s->k->neta);
  }
  const int found = lo > 0.0 && tr_cone_at(s, eta, i, lo) > lo * lo && tr_tilt_above(s, eta, i, lo, lo, c0, lo * (1.0 + TILT_BEYOND));
  tr_forget_tilts(s);
  return found;
}

/* η by the tilts of all balls that slide near their cones, each found in turn while the others keep theirs. */
static int tr_newton_by_all_tilts(tr_sim *s, double *eta) {
  int balls = 0, ok = 1, moved = 1;
  for (int i = 0; i < s->k->nsliders; ++i) balls += tr_slides_on_cone(s, i);
  for (int sweep = 0; balls > 1 && ok && moved && sweep < TILT_SWEEPS; ++sweep) {
    moved = 0;
    for (int i = 0; i < s->k->nsliders && ok; ++i) {
      if (!tr_slides_on_cone(s, i)) continue;
      double was = tr_mode_of(s, i)->tilt;
      ok = tr_tilt_of(s, eta, i);
      moved |= !(fabs(tr_mode_of(s, i)->tilt - was) <= TILT_SAME * was);
    }
  }
  tr_forget_tilts(s);
  return balls > 1 && ok && !moved;
}

/* η by the tilt near the one that ball i has had with the frictions `warm`. 1 when found. */
static int tr_newton_by_tilt_of(tr_sim *s, const double *warm, int i) {
  double *eta = TR_A(s, z) + s->k->active;
  memcpy(eta, warm, sizeof(double) * s->k->neta);
  const int found = tr_tilt_near(s, eta, i);
  tr_forget_tilts(s);
  return found;
}

/* The same of the first ball that slides near its cone for which there is one: from no friction Newton's method may come to one inside the
 * cone, which is no root. */
static int tr_newton_by_its_tilt(tr_sim *s, const double *warm) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_slides_on_cone(s, i) && tr_newton_by_tilt_of(s, warm, i)) return 1;
  return 0;
}

/* η by the tilt of one ball that slides near its cone, tried in turn, then of all; 1 when found. */
static int tr_newton_by_tilt(tr_sim *s, const double *warm) {
  double *eta = TR_A(s, z) + s->k->active;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_slides_on_cone(s, i)) continue;
    if (tr_newton_by_tilt_of(s, warm, i)) return 1;
    memcpy(eta, warm, sizeof(double) * s->k->neta);
    const int found = tr_tilt_of(s, eta, i);
    tr_forget_tilts(s);
    if (found) return 1;
  }
  memcpy(eta, warm, sizeof(double) * s->k->neta);
  return tr_newton_by_all_tilts(s, eta);
}
