/* Onset direction of a pair of two or three components (theory, "Onset of sliding"). A pair that starts to slide in direction d has
 * the velocity α t d; its acceleration has a direction â(d). Then dd/d ln t = â(d) − d. An onset direction is a solution of â(d) =
 * d. A direction attracts if the motion returns to it after a small turn. If it repels, the motion leaves it at once.
 *
 * At t = 0, d turns infinitely fast, because dd/d ln t is finite. The first step is therefore short, with a frozen direction whose
 * norm outweighs the velocity (TR_FROZEN). The direction stays frozen while the speed is below the tolerance of velocities, which
 * bounds the error.
 *
 * Newton's method on the sphere of directions starts from several directions. Fixed-point iteration would converge too slowly near
 * wedging. */
#include "modes/modes.h"

#define SAME_DIRECTION 1e-9 /* unit vectors with a smaller difference are on one line; the difference is round-off */
#define TURN_FOUND 1e-12    /* rad: the search has converged if direction and acceleration differ by a smaller angle */
/* rad: the search has also converged below this angle, if no step reduces it (round-off of multipliers) */
#define TURN_NEARLY 1e-8
#define LONGEST_TURN 0.5 /* rad: longest Newton step; limited, because the start may be far from a solution */
/* in units of √rtol / rate scale: least onset step; within this step, the direction drifts by less than the tolerance */
#define ONSET_STEP 0.3

enum { TR_ONSET_NONE, TR_ONSET_REPELS, TR_ONSET_ATTRACTS, TR_ONSET_FAINT };

static double tr_longest_onset_step(tr_sim *s, const double *dv) {
  double least = INFINITY;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_starting_to_slide(s, i)) continue;
    double size = 0.0;
    for (int j = 0; j < pair->nrates; ++j) {
      double a = (pair->v0 >= 0 ? dv[pair->v0 + j] : tr_acceleration_by_maps(s, pair->eta0 + j)) * TR_A(s, lever)[pair->eta0 + j];
      size += a * a;
    }
    double slow = size > 0.0 ? 0.5 * tr_onset_speed(s) / sqrt(size) : 0.0;
    least = fmin(least, fmax(ONSET_STEP * sqrt(s->set.rtol) / s->set.rate, slow));
  }
  return least;
}

static int tr_is_onset_too_fast(const tr_sim *s, const double *y, double h) {
  if (h <= 1.001 * ONSET_STEP * sqrt(s->set.rtol) / s->set.rate) return 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double size = 0.0;
    if (!tr_is_starting_to_slide(s, i)) continue;
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) {
      double v = y[s->k->nq + pair->v0 + j] * TR_A(s, lever)[pair->eta0 + j];
      size += v * v;
    }
    if (sqrt(size) > 4.0 * tr_onset_speed(s)) return 1;
  }
  return 0;
}

/* Norm of a trial direction. Impulse steps use ON_LINE, because friction must not reverse with the rate at the step's start. */
static inline double tr_onset_length(const tr_sim *s) { return s->moreau.h > 0.0 ? ON_LINE : TR_FROZEN; }

/* Compute `dir`, the unit direction of the acceleration of pair i if it starts to slide along d. If the acceleration is faint, dir
 * = d. Returns 0 if no multipliers are found. */
static int tr_acceleration_direction(tr_sim *s, int i, const double *d, double *dir) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_mode *m = tr_mode_of(s, i);
  const double length = tr_onset_length(s);
  for (int j = 0; j < 3; ++j) m->direction[j] = j < pair->nrates ? length * d[j] / TR_A(s, lever)[pair->eta0 + j] : 0.0;
  for (int part = 0; part < 3; ++part) { /* solved three times, because the force decides whether a ball slides or spins */
    if (tr_mode_flag(m) == TR_STUCK) m->flag = TR_SLIPS;
    if (!tr_solve_in_modes(s)) return 0;
    int cone = pair->cone && tr_sliding_of(s, i)->cone < 0.0;
    if ((tr_mode_flag(m) == TR_CONE) == cone) break;
    m->flag = cone ? TR_CONE : TR_SLIPS;
  }
  tr_pair_acceleration(s, i, dir);
  double size = tr_make_unit(pair->nrates, dir);
  if (size <= tr_faint_acceleration(s, i)) memcpy(dir, d, sizeof(double) * pair->nrates);
  return size < INFINITY;
}

/* Tangent basis t (n − 1 vectors) at the unit vector d. */
static void tr_tangent_basis(int n, const double *d, double t[2][3]) {
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
  tr_make_unit(3, t[0]);
  for (int j = 0; j < 3; ++j) t[1][j] = d[(j + 1) % 3] * t[0][(j + 2) % 3] - d[(j + 2) % 3] * t[0][(j + 1) % 3];
}

/* Components f, along the tangents t, of the difference between the acceleration's direction `dir` and d. Returns the norm of f. */
static double tr_direction_difference(int n, const double *d, const double *dir, double t[2][3], double *f) {
  double size = 0.0;
  for (int p = 0; p < n - 1; ++p) {
    f[p] = 0.0;
    for (int j = 0; j < n; ++j) f[p] += (dir[j] - d[j]) * t[p][j];
    size += f[p] * f[p];
  }
  return sqrt(size);
}

/* Derivative J of tr_direction_difference by the tangent components of d, from differences. Returns 0 on failure. */
static int tr_direction_difference_slope(tr_sim *s, int i, const double *d, double t[2][3], const double *f, double J[2][2]) {
  int n = tr_pair_of(s, i)->nrates;
  for (int p = 0; p < n - 1; ++p) {
    double moved[3], there[3], g[2];
    for (int j = 0; j < n; ++j) moved[j] = d[j] + TURN_TRIED * t[p][j];
    tr_make_unit(n, moved);
    if (!tr_acceleration_direction(s, i, moved, there)) return 0;
    tr_direction_difference(n, moved, there, t, g);
    for (int q = 0; q < n - 1; ++q) J[q][p] = (g[q] - f[q]) / TURN_TRIED;
  }
  return 1;
}

/* Classify the stability (TR_ONSET_…) of the direction d, which is a solution. */
static int tr_classify_onset(tr_sim *s, int i, const double *d, const double *dir, double t[2][3], const double *f) {
  int n = tr_pair_of(s, i)->nrates;
  double J[2][2], here[3];
  if (!(tr_dot(d, dir, n) > 0.0) || !tr_direction_difference_slope(s, i, d, t, f, J)) return TR_ONSET_NONE;
  if (!tr_acceleration_direction(s, i, d, here)) return TR_ONSET_NONE;
  if (J[0][0] == 0.0 && (n == 2 || J[1][1] == 0.0)) return TR_ONSET_FAINT;
  int attracts = n == 2 ? J[0][0] < 0.0 : J[0][0] + J[1][1] < 0.0 && J[0][0] * J[1][1] > J[0][1] * J[1][0];
  return attracts ? TR_ONSET_ATTRACTS : TR_ONSET_REPELS;
}

/* Newton's method from d to a stationary direction, which replaces d. Returns the stability of this direction; TR_ONSET_NONE
 * without convergence. */
static int tr_find_onset_from(tr_sim *s, int i, double *d) {
  int n = tr_pair_of(s, i)->nrates;
  double dir[3], t[2][3], f[2], g[2], J[2][2];
  if (!tr_acceleration_direction(s, i, d, dir)) return TR_ONSET_NONE;
  for (int it = 0; it < 40; ++it) {
    tr_tangent_basis(n, d, t);
    double best = tr_direction_difference(n, d, dir, t, f), step[2] = {0.0, 0.0};
    if (best <= TURN_FOUND) return tr_classify_onset(s, i, d, dir, t, f);
    if (!tr_direction_difference_slope(s, i, d, t, f, J)) return TR_ONSET_NONE;
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
      tr_make_unit(n, moved);
      if (!tr_acceleration_direction(s, i, moved, there)) continue;
      better = tr_direction_difference(n, moved, there, t, g) < best;
      if (better) memcpy(d, moved, sizeof moved), memcpy(dir, there, sizeof there);
    }
    if (!better) return best <= TURN_NEARLY ? tr_classify_onset(s, i, d, dir, t, f) : TR_ONSET_NONE;
  }
  return TR_ONSET_NONE;
}

/* Largest difference between the unit vectors of two directions that count as the same, at the present solution. In an impulse
 * step, speeds that count as rest cause a larger difference. */
static double tr_same_direction(tr_sim *s, int i) {
  double acc[3];
  if (!(s->moreau.h > 0.0)) return SAME_DIRECTION;
  tr_pair_acceleration(s, i, acc);
  return SAME_DIRECTION + tr_rest_speed(tr_speed_unit(s)) / (s->moreau.h * tr_make_unit(tr_pair_of(s, i)->nrates, acc));
}

/* Find the direction in which pair i starts to slide; its mode contains a guess. An attracting direction is preferred. A repelling
 * direction is accepted if there is no other, or if it equals the guess. Symmetric motion (a ball that swings in a plane) then
 * stays symmetric. near: 1 accepts only the direction found from the guess, and only within a right angle of the guess. Returns 0
 * if there is no direction. */
static int tr_find_onset(tr_sim *s, int i, int near) {
  const tr_pair *pair = tr_pair_of(s, i);
  int n = pair->nrates, found = 0;
  double d[3], other[3], guess[3], length = tr_frozen_length(s, i);
  double huge = length > TR_LINE ? ON_LINE : length > STILL_FROZEN * TR_FROZEN ? TR_FROZEN : 1.0;
  for (int j = 0; j < n; ++j) guess[j] = tr_mode_of(s, i)->direction[j] * TR_A(s, lever)[pair->eta0 + j] / huge;
  int guessed = tr_make_unit(n, guess) > 0.0;
  for (int q = guessed ? -2 : 0; q < (near ? -1 : 26); ++q) {
    if (q < 0) { /* first the guess, then its reverse */
      for (int j = 0; j < n; ++j) d[j] = q == -2 ? guess[j] : -guess[j];
    } else if (n == 2) { /* a grid of directions */
      d[0] = cos(TURN * q / 26.0), d[1] = sin(TURN * q / 26.0);
    } else {
      int c = q < 13 ? q : q + 1;
      d[0] = c % 3 - 1, d[1] = c / 3 % 3 - 1, d[2] = c / 9 - 1;
      tr_make_unit(3, d);
    }
    double first[3], moved = 0.0;
    memcpy(first, d, sizeof first);
    int kind = tr_find_onset_from(s, i, d);
    for (int j = 0; j < n; ++j) moved = fmax(moved, fabs(d[j] - first[j]));
    if (near && !(tr_dot(d, guess, n) > 0.0)) return 0;
    if (kind == TR_ONSET_FAINT) return 1;
    if (kind != TR_ONSET_NONE && q < 0 && moved <= tr_same_direction(s, i)) { /* the pair moves along a line */
      if (s->moreau.h > 0.0 && !tr_acceleration_direction(s, i, first, d)) return 0;
      for (int j = 0; j < 3; ++j) tr_mode_of(s, i)->direction[j] *= ON_LINE / tr_onset_length(s);
      return 1;
    }
    if (kind == TR_ONSET_ATTRACTS) return 1;
    if (kind == TR_ONSET_REPELS && !found) memcpy(other, d, sizeof other), found = 1;
  }
  return found && tr_find_onset_from(s, i, other) != TR_ONSET_NONE;
}
