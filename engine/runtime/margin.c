/* How clearly an event is decided: its margin, by how much what decides it would have to be otherwise for something else to happen (METHOD,
 * "Marginal events"). Of a crossing that is by how much it would go on beyond its threshold, and how fast it crosses it; of a decision, how
 * far what sticks is from being let go and what slips from being held. An event whose margin is below the run's own error is marked. */
#include "modes.h"

#define OWN_ERROR 10.0   /* × the tolerance: what a run's states may be off by, in their units (as LAW_PART of the audit) */
#define SLOW 0.01        /* of its unit in the whole run: what crosses slower is moved by one tolerance by more than times may be off */
#define STRAYS_LEAST 1e-3 /* of the run's own error: no speed is known better, whatever the errors of steps say (others stray as well) */
#define CLEAR 1.0        /* the largest margin: a pair without load, a threshold that is gone far beyond */
#define LET_GO_WITH 1e-6 /* of the friction ratio: pairs that carry the same share as the one that is let go go with it, not by chance */
#define ENOUGH 0.01      /* of the friction ratio: an estimate of a margin that is larger will do */
#define LEAST_STRETCH 1e-3 /* of the step: over less of it no slope is measured */
#define SHIFT_CONE 2e-9 /* of s²/|ω|², in model exchange: it is known to 5e-10 at a ball's cone, whose law has lost half of its digits there */

/* What the run's states may be off by, relative to their units. */
static double tr_own_error(const tr_sim *s) { return OWN_ERROR * tr_audit_tolerance(s); }

/* The step just accepted adds to what the speeds of pairs may be off by: errors of steps have either sign. */
static void tr_strays(tr_sim *s) {
  double *trial = TR_A(s, stray), *sum = trial + s->k->nsliders;
  for (int i = 0; i < s->k->nsliders && s->k->sets; ++i) sum[i] = hypot(sum[i], trial[i]);
}

/* How far pairs and stops are beyond their modes (``tr_violation``): as last looked at, at the start and at the end of the step. */
enum { TR_NOW, TR_AT_START, TR_AT_END };
static double *tr_far(const tr_sim *s, int when) { return TR_A(s, far) + when * tr_watched(s); }

/* What was last looked at is that of the step's start or end. */
static void tr_note_far(tr_sim *s, int from, int when) {
  tr_copy(tr_watched(s), tr_far(s, from), tr_far(s, when));
  if (when == TR_AT_START) s->step.far_known = 1;
}

/* Unit of the surface speed of pair i, m/s: that of its rates times their levers (of travel: 1). */
static double tr_own_speed(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double most = 0.0;
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) most = fmax(most, TR_A(s, arm)[j] == 1.0 ? s->set.length : TR_A(s, arm)[j]);
  return most * s->set.rate;
}

/* Part of the run's own error by which what decides the event of `which` may be off: of the end of sliding what the errors of its steps in that
 * speed come to, where they are known. What moves little beside others, in steps that are short for other reasons, is known much better. */
static double tr_stray_part(const tr_sim *s, int which) {
  if (which >= s->k->nsliders || !tr_is_set(s, which) || tr_is_stuck(s, which) || tr_moving_ball(s, which)) return 1.0;
  if (tr_pair_of(s, which)->v0 < 0) return 1.0;
  const double off = OWN_ERROR * TR_A(s, stray)[s->k->nsliders + which] / tr_own_speed(s, which);
  return fmin(1.0, fmax(off / tr_own_error(s), STRAYS_LEAST));
}

/* What one tolerance of the event of `which` is in the unit that its margin has: friction ratio, speed unit, length, sine². */
static double tr_margin_unit(const tr_sim *s, int which) {
  if (which >= s->k->nsliders) return TOL_STOP / s->set.length;
  if (!tr_is_set(s, which)) return TOL_KINK * tr_sliding_of(s, which)->border / tr_own_speed(s, which);
  if (tr_is_stuck(s, which)) return TOL_RELEASE;
  return tr_moving_ball(s, which) ? TOL_CONE : TOL_SPEED * tr_speed_unit(s) / tr_own_speed(s, which);
}

/* The crossing that cuts the step short decides what is told next: from how far `which` was beyond its mode at the step's start, is where it was
 * to end, and from their parabola through nothing in between. Its margin is by how much it goes beyond at most: not where that is bent by less
 * than a tolerance of the event. */
static void tr_crosses(tr_sim *s, int which) {
  const double at = s->pending.theta, left = 1.0 - at, unit = tr_margin_unit(s, which);
  const double start = tr_far(s, TR_AT_START)[which] * unit, end = tr_far(s, TR_AT_END)[which] * unit;
  const int before = s->step.far_known && at > LEAST_STRETCH && start < 0.0, beyond = left > LEAST_STRETCH && end == end;
  s->events.margin = CLEAR, s->events.unsure = 0;
  if (s->pending.captured || !(before || beyond)) return;
  const double first = before ? -start / at : end / left, second = beyond ? end / left : first;
  const double slope = first + (second - first) * at, bend = 2.0 * (second - first);
  if (bend < -unit) s->events.margin = fmin(CLEAR, fmax(0.5 * slope * slope / -bend, end));
  const double part = tr_stray_part(s, which), gone = fabs(slope) / s->step.size * fmax(s->clock.stop - s->clock.start, 1.0 / s->set.rate);
  s->events.unsure = s->events.margin < part * tr_own_error(s) || gone < SLOW * part;
}

/* Nothing close decides what is told next. */
static void tr_is_clear(tr_sim *s) { s->events.margin = CLEAR, s->events.unsure = 0; }

/* Margin of pair i, which starts to slide where it could rest: the friction that rest would take over what it can hold, less 1. Its response
 * with the loops closed in place, and what it can hold. */
static double tr_slip_margin(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const tr_hold *hold = tr_hold_of(s, i);
  double size = 0.0, most = 0.0;
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) {
    const double arm = TR_A(s, arm)[j], acc = tr_acceleration_now(s, j) * arm;
    if (tr_is_prescribed(s, j)) continue;
    size += acc * acc, most = fmax(most, tr_response(s, j, j) * arm * arm);
  }
  if (!(most > 0.0) || tr_flag(tr_mode_of(s, i)) == TR_CONE) return CLEAR;
  return (hold->size + sqrt(size) / most) / fmax(hold->capacity, NO_FORCE) - 1.0;
}

/* The same by solving for it: how far pair i, stuck in place of sliding, is from the edge of what it can hold. Modes and friction are put back. */
static double tr_stuck_instead(tr_sim *s, int i) {
  const int nz = tr_nz(s);
  tr_mode modes[s->k->nsliders + 1];
  double z[nz + 1];
  tr_keep_modes(s, modes), tr_copy(nz, TR_A(s, z), z);
  tr_mode_of(s, i)->flag = TR_STUCK;
  const double margin = tr_solve_modes(s) ? fabs(tr_ratio(s, i) - 1.0) : CLEAR;
  tr_put_modes(s, modes), tr_copy(nz, z, TR_A(s, z));
  tr_solve_modes(s);
  tr_copy(nz, z, TR_A(s, z));
  return margin;
}

/* Friction over what it can hold of each pair that sticks, 0 of others, at the state just evaluated. */
static void tr_shares_held(tr_sim *s, double *was) {
  memset(was, 0, sizeof(double) * s->k->nsliders);
  if (!s->friction.still) return;
  tr_holding(s);
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_stuck(s, i)) was[i] = tr_ratio(s, i);
}

/* Margin of a decision about the pairs `rest` (n), just made and evaluated; was: shares held before it (``tr_shares_held``). */
static double tr_decision_margin(tr_sim *s, const int *rest, int n, int released, const double *was) {
  double least = CLEAR;
  tr_without_loops(s, 1);
  tr_holding(s);
  for (int q = 0; q < n; ++q) {
    const int i = rest[q];
    if (tr_is_stuck(s, i)) least = fmin(least, 1.0 - tr_ratio(s, i));
    else if (i != released && was[i] < 1.0 - LET_GO_WITH) {
      const double estimate = tr_slip_margin(s, i); /* exact where nothing else rests, else too small */
      least = fmin(least, estimate < ENOUGH ? tr_stuck_instead(s, i) : estimate);
    }
  }
  return fmax(least, 0.0);
}

/* What is told next hangs on this as well: on the least of all margins of its instant. */
static void tr_hangs_on(tr_sim *s, double margin) {
  s->events.margin = fmin(s->events.margin, margin), s->events.unsure |= margin < tr_own_error(s);
}

/* How far a ball is from its cone, in model exchange; 1 of other pairs. */
static double tr_cone_left(const tr_sim *s, int i) {
  const double cone = tr_sliding_of(s, i)->cone;
  if (!tr_is_set(s, i) || tr_is_stuck(s, i) || !tr_pair_of(s, i)->cone || !tr_moving_ball(s, i)) return 1.0;
  return SHIFT_CONE + (tr_flag(tr_mode_of(s, i)) == TR_CONE ? -cone : cone);
}
