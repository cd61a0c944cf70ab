/* Runs whose steps are an importer's own (model exchange): ẏ in modes that stay, what tells when one ends, and what then becomes of it.
 *
 * Everything is a function of (t, y) and of what was kept at the last event, completed step, or state at which the importer asked for indicators
 * and all were positive: modes, directions, and the multipliers from which a branch of friction is followed. Each pair has two numbers that
 * are positive while its mode lasts: what ends it, and what ends the branch or the direction within it; each stop has one; the last says
 * whether friction has an answer. They are shifted by less than matters, so that none is zero just after what it tells of. */
#include "modes.h"

#define SHIFT_SPEED 1e-10  /* of the pair's own speed unit: one that has just started may be so much slower than not at all */
#define SHIFT_RATIO 1e-10  /* of the friction ratio (as TOL_RELEASE) */
#define SHIFT_KINK 1e-9    /* of the kink speed (as TOL_KINK) */
#define SHIFT_STOP 1e-11   /* of the length, or rad */
#define ENDS_SPEED 1e-8    /* of that unit: sliding of several components ends when it is slower (as CAPTURE_SPEED) */
#define BEGUN_SPEED 1e-6   /* of that unit: faster than that it has begun, and its direction is that of its motion */
#define DRIFT 1.0          /* × the tolerance, of the length (rad): by so much loops may come open before they are closed again, */
#define DRIFT_TURN 1e-6    /* and the square of a quaternion's length may be off */
#define FAR_BRANCH 0.02    /* of the friction of a pair: from where it was kept it changes by more where it goes to another branch, or on a long way, */
#define FOLLOWED_PARTS 8   /* which then is made in so many parts */
#define NOMINAL 0.1        /* of the scene's scales: BDF methods lose by so much more than the engine's own (fmu/README.md) */
#define PASSED 1e-10       /* s, and of the time: a break this near is reached */

/* How often each pair and stop has ended its mode at the present event. */
static inline double *tr_handled(const tr_sim *s) { return TR_A(s, told) + 2 * s->k->nsliders + s->k->nstops + 1; }

/* What is read off tables and drives at t: that which holds between the last break and the next, wherever the importer's solver looks. */
static void tr_moment_between_breaks(tr_sim *s) {
  const double *b = TR_A(s, breaks);
  const int next = s->clock.next_break;
  double inside = s->clock.t;
  if (next > 0) inside = fmax(inside, b[next - 1] + JUST_AFTER);
  if (next < s->clock.nbreaks) inside = fmin(inside, b[next] - JUST_AFTER);
  tr_moment_of(s)->inside = inside;
}

/* The next time at which something changes by itself, s; INFINITY: never. */
double tr_next_break(const tr_sim *s) {
  return s->clock.next_break < s->clock.nbreaks ? TR_A(s, breaks)[s->clock.next_break] : INFINITY;
}

/* The same of a run whose own steps may have gone further: after t. */
double tr_break_after(const tr_sim *s, double t) {
  for (int i = 0; i < s->clock.nbreaks; ++i)
    if (TR_A(s, breaks)[i] > t) return TR_A(s, breaks)[i];
  return INFINITY;
}

/* Numbers of the state that an importer integrates: y, and the works that columns ask for. */
int tr_states(const tr_sim *s) { return s->ny + s->nworks; }

/* Make (t, y) what the importer says. y: tr_states numbers, 0: as it is. */
void tr_place(tr_sim *s, double t, const double *y) {
  s->clock.t = t;
  if (y) tr_copy(tr_states(s), y, TR_A(s, y));
}

/* Surface speed of pair i, m/s, less than nothing where it slides the other way than its mode says. State evaluated. */
static double tr_speed_in_mode(const tr_sim *s, int i) {
  if (tr_pair_of(s, i)->nrates == 1) return tr_sliding_of(s, i)->speed;
  if (tr_frozen_length(s, i) > TR_LINE) return tr_speed_along(s, i);
  return tr_turned_back(s, i) ? -tr_pair_speed(s, i) : tr_pair_speed(s, i);
}

/* Of a pair of several components that slides: until its direction is anew, or its line is left. */
static double tr_keeps_way(const tr_sim *s, int i) {
  const double speed = tr_pair_speed(s, i), unit = tr_own_speed(s, i);
  if (tr_starts_sliding(s, i)) return BEGUN_SPEED - speed / unit;
  if (!(tr_frozen_length(s, i) > TR_LINE)) return 1.0;
  if (!(TR_A(s, slow)[i] > 0.0)) return BEGUN_SPEED - speed / unit;
  if (!(speed > ENDS_SPEED * unit)) return 1.0;
  const double along = tr_speed_along(s, i) / speed;
  return LINE_LEFT * LINE_LEFT - fmax(0.0, 1.0 - along * along);
}

/* The two numbers of pair i with a set-valued law. */
static void tr_tell_set(tr_sim *s, int i, double *z) {
  const int flag = tr_flag(tr_mode_of(s, i));
  z[1] = 1.0;
  if (flag == TR_STUCK) {
    const double ratio = tr_ratio(s, i), moves = tr_moves_along(s, i);
    z[0] = fmin((1.0 + SHIFT_RATIO - ratio) / (1.0 + ratio), 1.0 - moves);
    return;
  }
  z[0] = (tr_speed_in_mode(s, i) - TR_A(s, slow)[i]) / tr_own_speed(s, i);
  if (tr_pair_of(s, i)->nrates > 1) z[1] = tr_keeps_way(s, i);
  z[1] = fmin(z[1], tr_cone_left(s, i));
}

/* The same with a law that has a kink at a speed: the other side of that, and where the sliding turns round in between. */
static void tr_tell_kink(tr_sim *s, int i, double *z) {
  const double speed = tr_sliding_of(s, i)->speed, kink = tr_sliding_of(s, i)->border;
  const tr_zone *zone = tr_zone_of(s, i);
  const int turned = zone->reversal == zone->reversal;
  z[0] = SHIFT_KINK + (tr_slides(s, i) ? speed / kink - 1.0 : 1.0 - fabs(speed) / kink);
  z[1] = zone->inside && !turned ? SHIFT_SPEED + tr_along(s, i) / s->set.rate : 1.0;
}

/* All numbers at the state just evaluated. */
static void tr_tell(tr_sim *s) {
  const int pairs = s->k->nsliders;
  double *z = TR_A(s, told), *of_stops = z + 2 * pairs;
  if (s->friction.still) tr_holding_now(s);
  for (int i = 0; i < pairs; ++i, z += 2) {
    z[0] = z[1] = 1.0;
    if (tr_is_set(s, i)) tr_tell_set(s, i, z);
    else if (tr_is_turn(s, i)) z[0] = SHIFT_SPEED + tr_sliding_of(s, i)->speed / tr_own_speed(s, i);
    else if (tr_pair_of(s, i)->kind == TR_KIND_KINK) tr_tell_kink(s, i, z);
  }
  tr_depths(s, TR_A(s, y), of_stops);
  for (int j = 0; j < s->k->nstops; ++j) of_stops[j] = SHIFT_STOP + (tr_pressed(s, j) ? of_stops[j] : -of_stops[j]);
  of_stops[s->k->nstops] = 1.0;
}

/* Where they are, and ẏ that was evaluated with them. */
const double *tr_rates_known(const tr_sim *s) { return TR_A(s, dy); }
const double *tr_told(const tr_sim *s) { return TR_A(s, told); }

/* ẏ at the block's (t, y), from the multipliers `from`; then from those found, so that it does not matter where the iteration began. */
static int tr_rhs_from(tr_sim *s, const double *from) {
  tr_copy(tr_nz(s), from, TR_A(s, z));
  for (int twice = 0; twice <= (s->k->neta > 0); ++twice)
    if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0;
  return tr_finite(tr_states(s), TR_A(s, dy));
}

/* Whether the friction of a pair just found is not what it was where it was kept: it may be another branch. */
static int tr_is_far(const tr_sim *s) {
  const double *is = TR_A(s, z) + s->k->active, *was = TR_A(s, zold) + s->k->active;
  for (int p = 0; p < s->k->nsliders; ++p) {
    const tr_pair *pair = tr_pair_of(s, p);
    double change = 0.0, size = 0.0;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) change += fabs(is[i] - was[i]), size += fabs(is[i]) + fabs(was[i]);
    if (change > FAR_BRANCH * size) return 1;
  }
  return 0;
}

/* ẏ at the block's (t, y), its friction followed from the state at which it was kept, in parts of the way. */
static int tr_rhs_followed(tr_sim *s) {
  const int n = tr_width(s);
  const double *from = TR_A(s, K) + n, *y = TR_A(s, y);
  double *between = TR_A(s, ytmp);
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  for (int p = 1; p < FOLLOWED_PARTS; ++p) {
    const double part = (double)p / FOLLOWED_PARTS;
    for (int i = 0; i < n; ++i) between[i] = from[i] + part * (y[i] - from[i]);
    if (!tr_rhs(s, s->step.t0 + part * (s->clock.t - s->step.t0), between, TR_A(s, dy))) return 0;
  }
  return tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_finite(tr_states(s), TR_A(s, dy));
}

/* ẏ at the block's (t, y) in the modes in force. */
static int tr_rhs_in_modes(tr_sim *s) {
  s->step.watch = 0;
  tr_moment_between_breaks(s);
  const int found = tr_rhs_from(s, TR_A(s, zold));
  return (found && !tr_is_far(s)) || !s->k->neta ? found : tr_rhs_followed(s);
}

/* The same with what tells when a mode ends. Where friction has no answer, beyond an event that the importer is to find, ẏ goes on with the
 * multipliers of the last evaluation that had one, and the last number is negative. 0: not even that. */
const double *tr_rates_in_modes(tr_sim *s) {
  if (tr_rhs_in_modes(s)) {
    tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zend));
    tr_tell(s);
    return TR_A(s, dy);
  }
  TR_A(s, told)[2 * s->k->nsliders + s->k->nstops] = -1.0;
  if (!s->k->neta) return 0;
  tr_maps_of(s, TR_A(s, y));
  tr_form_maps(s);
  tr_stage2(s, TR_A(s, y), TR_A(s, zend), TR_A(s, dy));
  if (s->friction.still) tr_keep_still(s, TR_A(s, dy));
  return tr_finite(tr_states(s), TR_A(s, dy)) ? TR_A(s, dy) : 0;
}

/* The speed at which the sliding of pair i ends from now on, m/s. State evaluated. */
static void tr_arm(tr_sim *s, int i) {
  const double unit = tr_own_speed(s, i);
  double *slow = TR_A(s, slow) + i;
  const int several = tr_pair_of(s, i)->nrates > 1 && tr_is_set(s, i) && tr_slides(s, i);
  const double speed = several ? tr_speed_in_mode(s, i) : 0.0;
  if (several && !tr_starts_sliding(s, i) && speed > 2.0 * ENDS_SPEED * unit) *slow = ENDS_SPEED * unit;
  else if (!(*slow > 0.0 && speed > *slow)) *slow = -SHIFT_SPEED * unit;
}

/* The multipliers in place are those of the present modes at the block's (t, y), from where they are followed. */
static void tr_keep_answer(tr_sim *s) {
  tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zold)), tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zend));
  tr_copy(tr_width(s), TR_A(s, y), TR_A(s, K) + tr_width(s));
  s->step.t0 = s->clock.t;
}

/* The importer has asked for indicators at the state just evaluated, as importers do of steps they accept: where all modes last the branch of
 * friction is followed from here. */
void tr_follow(tr_sim *s) {
  for (int i = 0; i <= 2 * s->k->nsliders + s->k->nstops; ++i)
    if (!(TR_A(s, told)[i] > 0.0)) return;
  tr_keep_answer(s);
}

/* A step of the importer is complete at the block's (t, y), just evaluated: what is kept follows. */
static void tr_keep_up(tr_sim *s) {
  tr_keep_answer(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const int several = tr_pair_of(s, i)->nrates > 1 && tr_slides(s, i);
    if (several && !tr_is_set(s, i)) tr_freeze(s, i);
    if (several && tr_is_set(s, i) && tr_frozen_length(s, i) < STILL_FROZEN * TR_FROZEN && tr_speed_in_mode(s, i) > ENDS_SPEED * tr_own_speed(s, i))
      tr_freeze(s, i);
    tr_arm(s, i);
  }
}

/* Whether the loops, or quaternions, have come open at the block's state by more than may be. */
static int tr_has_drifted(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  double *h = TR_A(s, h_res), pos = 0.0, vel = 0.0;
  for (int i = 0; i < k->nquat; ++i) {
    const double *e = y + k->quat[i];
    if (fabs(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] - 1.0) > DRIFT_TURN) return 1;
  }
  if (!k->active || !s->set.project) return 0;
  k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
  tr_residual(s, h, &pos, &vel);
  return !(fmax(pos, vel) <= DRIFT * s->set.rtol);
}

/* After a step of the importer: whether it is to handle an event. */
int tr_completed(tr_sim *s) {
  if (s->clock.t > tr_next_break(s) + PASSED * fmax(1.0, fabs(s->clock.t))) return 1;
  if (!tr_rhs_in_modes(s)) return 1;
  tr_keep_up(s);
  return tr_has_drifted(s);
}

/* Begin at the block's (t, y) with the modes in force and the multipliers in place: ẏ, 0 where there is none. */
const double *tr_arm_here(tr_sim *s) {
  tr_keep_answer(s);
  memset(TR_A(s, slow), 0, sizeof(double) * s->k->nsliders);
  if (!tr_rhs_in_modes(s)) return 0;
  tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zend));
  tr_keep_up(s);
  tr_tell(s);
  return TR_A(s, dy);
}

/* The row of columns at the block's (t, y), in the modes in force. TR_OK, or why there is none. */
int tr_row_in_modes(tr_sim *s, double *row) {
  tr_moment_between_breaks(s);
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  return tr_row(s, row);
}

/* The size that an importer is to measure a state by (``NOMINAL`` of fmu/exchange.py). */
double tr_nominal(const tr_sim *s, int i) { return NOMINAL * (i < s->ny ? TR_A(s, scale)[i] : s->set.energy); }
