/* The direction in which a pair of two or three components starts to slide: one along which it then accelerates, and to which the
 * sliding returns when it is turned a little (from v = α t d the direction follows dd/d ln t = â(d) − d; one that repels is left at
 * once).
 *
 * The relaxation is infinitely fast at first, so the first step is made with the direction frozen (a frozen direction of length HUGE
 * outweighs the velocity, ``friction.base.HAIR``) and is short; it stays frozen while the speed is below the tolerance of velocities,
 * which bounds the error.
 *
 * Newton on the sphere of directions (fixed-point iteration stalls for large friction near wedging), from several starts. */
#include "modes.h"

#define TR_FROZEN 1e126 /* length of a frozen direction: outweighs any velocity by more than a double's digits (its share there is 1e-120) */
#define STILL_FROZEN 1e-6 /* of that length: a direction is frozen when it is so long, whatever unit vector and levers it was made of */
#define FAINT 1e-7     /* of length · rate², and */
#define FAINT_RATIO 1e-5 /* of what friction itself accelerates: less has no direction; friction keeps the one it had while holding */
#define ONSET_SPEED 0.1 /* of rtol · speed unit: below it the direction stays frozen, */
#define ONSET_LEAST 1e-9 /* and below so much of the unit: what is slower has the direction of round-off in loops */
#define SAME_DIRECTION 1e-9 /* of a unit vector: that of a motion along a line, found again but for round-off */
#define TURN_TRIED 1e-6     /* rad: for the derivative by differences, half of a double's digits */
#define TURN_FOUND 1e-12    /* rad between direction and acceleration: found */
#define TURN_NEARLY 1e-8    /* rad: found as well as round-off in the multipliers allows, when no step makes it smaller */
#define LONGEST_TURN 0.5 /* rad: of one iteration, which may start far from any solution */
#define ONSET_STEP 0.3 /* of √rtol / rate: the direction's own drift over it is below the tolerance */

/* Surface acceleration of pair i at the solution in place. */
static void tr_pair_acceleration(tr_sim *s, int i, double *acc) {
  const tr_pair *pair = tr_pair_of(s, i);
  for (int j = 0; j < pair->nrates; ++j) acc[j] = tr_freedom_acceleration(s, pair->eta0 + j) * TR_A(s, arm)[pair->eta0 + j];
}

/* Freeze the direction of pair i where it has rates r and the speed v: as that of a first step (TR_FROZEN), from which friction turns where
 * the rates point the other way, or as that of a line (ON_LINE), from which it does not. */
static void tr_freeze_along(tr_sim *s, int i, double length, const double *r, double v) {
  for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) tr_mode_of(s, i)->direction[j] = length * r[j] / v;
}

/* Whether the pair is in its first step from rest. */
static int tr_starts_sliding(const tr_sim *s, int i) {
  double length = tr_frozen_length(s, i);
  return length > STILL_FROZEN * TR_FROZEN && length < TR_LINE;
}

/* Surface acceleration of pair i too small to have a direction, at the solution in place. */
static double tr_faint(tr_sim *s, int i) {
  tr_form_all(s);
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active, *Qe = TR_A(s, Q) + s->k->neta, *arm = TR_A(s, arm);
  double own = 0.0;
  for (int e = pair->eta0; e < pair->eta0 + pair->nrates; ++e) own = fmax(own, fabs(Qe[e + e * s->k->neta] * eta[e] * arm[e]));
  return fmax(FAINT * tr_speed_unit(s) * s->set.rate, FAINT_RATIO * own);
}

/* Speed up to which the direction of a pair in its first step from rest stays frozen. */
static double tr_onset_speed(const tr_sim *s) { return fmax(ONSET_SPEED * s->set.rtol, ONSET_LEAST) * tr_speed_unit(s); }

/* Whether the direction of pair i, with this surface speed, is to stay frozen. */
static int tr_keeps_direction(const tr_sim *s, int i, double speed) {
  return speed <= (tr_starts_sliding(s, i) ? tr_onset_speed(s) : REST_SPEED * tr_speed_unit(s));
}

/* Longest step of the pairs that start to slide: as long as their speed stays below that, however long it takes. dv: acceleration of the
 * rates. */
static double tr_onset_step(tr_sim *s, const double *dv) {
  double least = INFINITY;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_starts_sliding(s, i)) continue;
    double size = 0.0;
    for (int j = 0; j < pair->nrates; ++j) {
      double a = (pair->v0 >= 0 ? dv[pair->v0 + j] : tr_acceleration_now(s, pair->eta0 + j)) * TR_A(s, arm)[pair->eta0 + j];
      size += a * a;
    }
    double slow = size > 0.0 ? 0.5 * tr_onset_speed(s) / sqrt(size) : 0.0;
    least = fmin(least, fmax(ONSET_STEP * sqrt(s->set.rtol) / s->set.rate, slow));
  }
  return least;
}

/* Whether a pair that starts to slide has become much too fast in a step to y that was longer than it had to be. */
static int tr_onset_too_fast(const tr_sim *s, const double *y, double h) {
  if (h <= 1.001 * ONSET_STEP * sqrt(s->set.rtol) / s->set.rate) return 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double size = 0.0;
    if (!tr_starts_sliding(s, i)) continue;
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) {
      double v = y[s->k->nq + pair->v0 + j] * TR_A(s, arm)[pair->eta0 + j];
      size += v * v;
    }
    if (sqrt(size) > 4.0 * tr_onset_speed(s)) return 1;
  }
  return 0;
}

/* Length of a direction that is tried. Steps of impulses ask for friction along it whatever the rate at their start, of which it may be
 * the reverse. */
static inline double tr_onset_length(const tr_sim *s) { return s->moreau.h > 0.0 ? ON_LINE : TR_FROZEN; }

/* Direction of acceleration (unit, n) when pair i starts to slide along d; 0 when the multipliers cannot be found. */
static int tr_accelerates(tr_sim *s, int i, const double *d, double *dir) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_mode *m = tr_mode_of(s, i);
  const double length = tr_onset_length(s);
  for (int j = 0; j < 3; ++j) m->direction[j] = j < pair->nrates ? length * d[j] / TR_A(s, arm)[pair->eta0 + j] : 0.0;
  for (int part = 0; part < 3; ++part) { /* a ball slides or spins, depending on the force */
    if (tr_flag(m) == TR_STUCK) m->flag = TR_SLIPS;
    if (!tr_solve_modes(s)) return 0;
    int cone = pair->cone && tr_sliding_of(s, i)->cone < 0.0;
    if ((tr_flag(m) == TR_CONE) == cone) break;
    m->flag = cone ? TR_CONE : TR_SLIPS;
  }
  tr_pair_acceleration(s, i, dir);
  double size = tr_unit(pair->nrates, dir);
  if (size <= tr_faint(s, i)) memcpy(dir, d, sizeof(double) * pair->nrates);
  return size < INFINITY;
}

/* Tangent basis t (2×n) at d. */
static void tr_tangents(int n, const double *d, double t[2][3]) {
  if (n == 2) {
    t[0][0] = -d[1], t[0][1] = d[0];
    return;
  }
  int least = 0;
  for (int j = 1; j < 3; ++j)
    if (fabs(d[j]) < fabs(d[least])) least = j;
  double e[3] = {0.0, 0.0, 0.0};
  e[least] = 1.0;
  for (int j = 0; j < 3; ++j) t[0][j] = e[j] - d[least] * d[j];
  tr_unit(3, t[0]);
  for (int j = 0; j < 3; ++j) t[1][j] = d[(j + 1) % 3] * t[0][(j + 2) % 3] - d[(j + 2) % 3] * t[0][(j + 1) % 3];
}

/* Difference of the direction of acceleration and d, in the tangents; its size. */
static double tr_turning(int n, const double *d, const double *dir, double t[2][3], double *f) {
  double size = 0.0;
  for (int p = 0; p < n - 1; ++p) {
    f[p] = 0.0;
    for (int j = 0; j < n; ++j) f[p] += (dir[j] - d[j]) * t[p][j];
    size += f[p] * f[p];
  }
  return sqrt(size);
}

/* Derivative J (columns: tangents) of the difference. */
static int tr_turning_slope(tr_sim *s, int i, const double *d, double t[2][3], const double *f, double J[2][2]) {
  int n = tr_pair_of(s, i)->nrates;
  for (int p = 0; p < n - 1; ++p) {
    double moved[3], there[3], g[2];
    for (int j = 0; j < n; ++j) moved[j] = d[j] + TURN_TRIED * t[p][j];
    tr_unit(n, moved);
    if (!tr_accelerates(s, i, moved, there)) return 0;
    tr_turning(n, moved, there, t, g);
    for (int q = 0; q < n - 1; ++q) J[q][p] = (g[q] - f[q]) / TURN_TRIED;
  }
  return 1;
}

enum { TR_ONSET_NONE, TR_ONSET_REPELS, TR_ONSET_ATTRACTS, TR_ONSET_FAINT };

/* What the direction d, brought to a solution, is. */
static int tr_onset_kind(tr_sim *s, int i, const double *d, const double *dir, double t[2][3], const double *f) {
  int n = tr_pair_of(s, i)->nrates;
  double J[2][2], here[3];
  if (!(tr_dot(d, dir, n) > 0.0) || !tr_turning_slope(s, i, d, t, f, J)) return TR_ONSET_NONE;
  if (!tr_accelerates(s, i, d, here)) return TR_ONSET_NONE;
  if (J[0][0] == 0.0 && (n == 2 || J[1][1] == 0.0)) return TR_ONSET_FAINT;
  int attracts = n == 2 ? J[0][0] < 0.0 : J[0][0] + J[1][1] < 0.0 && J[0][0] * J[1][1] > J[0][1] * J[1][0];
  return attracts ? TR_ONSET_ATTRACTS : TR_ONSET_REPELS;
}

/* From d to the nearest direction that stays, if Newton's method finds one; what that is (TR_ONSET_…). */
static int tr_onset_from(tr_sim *s, int i, double *d) {
  int n = tr_pair_of(s, i)->nrates;
  double dir[3], t[2][3], f[2], g[2], J[2][2];
  if (!tr_accelerates(s, i, d, dir)) return TR_ONSET_NONE;
  for (int it = 0; it < 40; ++it) {
    tr_tangents(n, d, t);
    double best = tr_turning(n, d, dir, t, f), step[2] = {0.0, 0.0};
    if (best <= TURN_FOUND) return tr_onset_kind(s, i, d, dir, t, f);
    if (!tr_turning_slope(s, i, d, t, f, J)) return TR_ONSET_NONE;
    if (n == 2) {
      step[0] = -f[0] / J[0][0];
    } else {
      double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
      step[0] = (-f[0] * J[1][1] + f[1] * J[0][1]) / det, step[1] = (-f[1] * J[0][0] + f[0] * J[1][0]) / det;
    }
    double len = sqrt(step[0] * step[0] + step[1] * step[1]), cut = len > LONGEST_TURN ? LONGEST_TURN / len : 1.0;
    if (!(len < INFINITY)) return TR_ONSET_NONE;
    int better = 0;
    for (int half = 0; half < 12 && !better; ++half, cut *= 0.5) {
      double moved[3], there[3];
      for (int j = 0; j < n; ++j) moved[j] = d[j] + cut * (step[0] * t[0][j] + (n == 3 ? step[1] * t[1][j] : 0.0));
      tr_unit(n, moved);
      if (!tr_accelerates(s, i, moved, there)) continue;
      better = tr_turning(n, moved, there, t, g) < best;
      if (better) memcpy(d, moved, sizeof moved), memcpy(dir, there, sizeof there);
    }
    if (!better) return best <= TURN_NEARLY ? tr_onset_kind(s, i, d, dir, t, f) : TR_ONSET_NONE;
  }
  return TR_ONSET_NONE;
}

/* Make pair i slide from rest; its mode holds a first guess of the direction (rates). A direction that repels is taken only when there is
 * no other, or when it is exactly the guess: what is symmetric (a ball swinging in a plane) stays so. near: only a direction that is found
 * from the guess, and within a right angle of it, counts. */
static int tr_onset(tr_sim *s, int i, int near) {
  const tr_pair *pair = tr_pair_of(s, i);
  int n = pair->nrates, found = 0;
  double d[3], other[3], guess[3], length = tr_frozen_length(s, i);
  double huge = length > TR_LINE ? ON_LINE : length > STILL_FROZEN * TR_FROZEN ? TR_FROZEN : 1.0;
  for (int j = 0; j < n; ++j) guess[j] = tr_mode_of(s, i)->direction[j] * TR_A(s, arm)[pair->eta0 + j] / huge;
  int guessed = tr_unit(n, guess) > 0.0;
  for (int q = guessed ? -2 : 0; q < (near ? -1 : 26); ++q) {
    if (q < 0) { /* along the line it is known to move on: one way, then the other */
      for (int j = 0; j < n; ++j) d[j] = q == -2 ? guess[j] : -guess[j];
    } else if (n == 2) { /* directions of a grid */
      d[0] = cos(6.283185307179586 * q / 26.0), d[1] = sin(6.283185307179586 * q / 26.0);
    } else {
      int c = q < 13 ? q : q + 1;
      d[0] = c % 3 - 1, d[1] = c / 3 % 3 - 1, d[2] = c / 9 - 1;
      tr_unit(3, d);
    }
    double first[3], moved = 0.0;
    memcpy(first, d, sizeof first);
    int kind = tr_onset_from(s, i, d);
    for (int j = 0; j < n; ++j) moved = fmax(moved, fabs(d[j] - first[j]));
    if (near && !(tr_dot(d, guess, n) > 0.0)) return 0;
    if (kind == TR_ONSET_FAINT) return 1;
    if (kind != TR_ONSET_NONE && q < 0 && moved <= SAME_DIRECTION) { /* it goes on along a line: nothing turns */
      for (int j = 0; j < 3; ++j) tr_mode_of(s, i)->direction[j] *= ON_LINE / tr_onset_length(s);
      return 1;
    }
    if (kind == TR_ONSET_ATTRACTS) return 1;
    if (kind == TR_ONSET_REPELS && !found) memcpy(other, d, sizeof other), found = 1;
  }
  return found && tr_onset_from(s, i, other) != TR_ONSET_NONE;
}
