/* The stepping loop: trial steps with error control until one is accepted and waits, then its completion, up to the target. */
#include "modes.h"

#define ANOTHER_ROOT 0.1     /* of the friction: by less it changes over a first step, by more where roots are many */
#define RESUMED_MOST 2       /* of the pairs: so many failures are passed at one time, the last half of them by impacts alone */
#define STALL_TIME 1e-9         /* of 1/rate: what so many trial steps must get on by; steps at round-off of the time end sooner */
#define STALL_TRIALS 20000      /* a second of work at most; onsets and captures take a hundred */

/* The time up to which the next step may reach: the target, or a break of the signals in front of it. */
static double tr_limit_time(const tr_sim *s, double target) {
  if (s->clock.next_break < s->clock.nbreaks) {
    double b = TR_A(s, breaks)[s->clock.next_break];
    if (b < target) return b;
  }
  return target;
}

/* Whether friction `is` (n) is another root than `was`, to which the look ahead for a first step's length has come. */
static int tr_is_another(int n, const double *was, const double *is) {
  double changed = 0.0, size = 0.0;
  for (int i = 0; i < n; ++i) changed += fabs(is[i] - was[i]), size += fabs(was[i]);
  return changed > ANOTHER_ROOT * size;
}

/* Whether a pair that slides is at rest at a break: its drive has come to rest there, which is no event of its own. Maps in place. */
static int tr_rests_now(const tr_sim *s) {
  if (!s->clock.next_break || TR_A(s, breaks)[s->clock.next_break - 1] < s->clock.t - tr_same_time(s->clock.t)) return 0;
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set(s, i) && tr_slides(s, i) && tr_pair_speed(s, i) <= REST_SPEED * tr_speed_unit(s)) return 1;
  return 0;
}

/* Derivative and first step size at the start of a step; directions of sliding are frozen here. */
static int tr_begin_step(tr_sim *s, double limit, int order) {
  const tr_kernel *k = s->k;
  if (!s->step.have_k1) {
    s->step.margin = NAN;
    const double left = limit - s->clock.t;
    tr_moment_of(s)->inside = s->clock.t + 0.5 * fmin(left, s->step.h > 0.0 ? s->step.h : left);
    s->step.watch = 0;
    if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
    if (s->friction.still || tr_rests_now(s)) { /* loads may have jumped here, or a drive has come to rest */
      int code = tr_settle(s, s->clock.t, TR_A(s, y), -1, 0);
      if (code != TR_OK) return code;
    }
    memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s));
    s->step.have_k1 = 1;
  }
  if (s->step.h <= 0.0) {
    double z[k->active + k->neta + 1];
    tr_copy(k->active + k->neta, TR_A(s, z), z);
    s->step.h = tr_first_step(s, limit - s->clock.t, order);
    if (tr_is_another(k->neta, z + k->active, TR_A(s, z) + k->active)) tr_copy(k->active + k->neta, z, TR_A(s, z));
  }
  if (!s->set.locate || s->events.chatter > CHATTER_MAX) tr_turn_directions(s);
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_slides(s, i) || tr_pair_of(s, i)->nrates == 1) continue;
    s->step.margin = NAN;
    if (!tr_is_set(s, i)) tr_freeze_at_start(s, i);
    else if (!tr_keeps_direction(s, i, tr_speed_of_state(s, i)) && !tr_stays_on_line(s, i)) tr_rates_of_state(s, i, tr_mode_of(s, i)->direction);
  }
  if (k->sets && s->set.hfixed <= 0.0) s->step.h = fmin(s->step.h, fmin(tr_onset_step(s, TR_A(s, K) + k->nq), tr_held_step(s)));
  s->step.h = fmin(s->step.h, tr_singular_step(s));
  tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zold));
  tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zstart));
  return TR_OK;
}

/* The stiff method's Jacobian is of no use where friction of several components starts from rest (its direction turns infinitely fast)
 * or groups share their load: such steps are made explicitly. So are those where all motion is given: nothing is stiff then, and nothing but what
 * explicit steps take for works would keep a step from going past all that begins to slide and rests again in it. */
static void tr_step_aside(tr_sim *s) {
  const tr_kernel *k = s->k;
  if ((!k->sets && s->ny) || (tr_method_of(s)->kind != TR_IMPLICIT && !s->step.aside)) return;
  int slow = s->friction.shares || !s->ny;
  for (int i = 0; i < k->nsliders && !slow; ++i)
    slow = tr_is_set(s, i) && tr_slides(s, i) && tr_pair_of(s, i)->nrates > 1 && tr_keeps_direction(s, i, tr_speed_of_state(s, i));
  if (slow != s->step.aside) s->step.have_jac = 0;
  s->step.aside = slow;
  s->step.method = slow ? TR_AUTO_TIGHT : tr_chooses(s) ? TR_AUTO_STIFF : s->set.method;
}

/* Make one acceptable trial step towards `limit`; the result waits as `pending`. */
static int tr_attempt(tr_sim *s, double limit) {
  if (tr_method_of(s)->kind == TR_IMPULSES) return tr_attempt_moreau(s, limit);
  tr_step_aside(s);
  const tr_method *m = tr_method_of(s);
  int code = tr_begin_step(s, limit, m->order);
  if (code != TR_OK) return code;
  if (s->friction.capture >= 0 && s->clock.t + s->friction.capture_h < limit && tr_step_capture(s)) {
    s->stats.steps++;
    s->pending.kind = TR_STEP_TO_EVENT;
    return TR_OK;
  }
  tr_trial trial = tr_trial_towards(s, limit);
  for (double most = GROW_MOST;; most = 1.0) { /* a step after a refused one does not grow */
    code = tr_try(s, m, &trial);
    if (code != TR_OK) return code;
    if (trial.err <= 1.0 && tr_ends_at_corner(s, &trial)) continue;
    if (trial.err <= 1.0 && !tr_is_cut(s, &trial)) {
      tr_accept(s, m, &trial, most);
      return TR_OK;
    }
    if (trial.err <= 1.0) {
      tr_step_to_event(s, &trial);
      continue;
    }
    code = tr_refuse(s, m, &trial);
    if (code != TR_OK) return code;
    trial = tr_trial_towards(s, limit);
  }
}

/* How often failures have been passed at the state in place, no time having gone by since. */
static int tr_resumed_here(tr_sim *s) {
  if (s->friction.resumed_t != s->clock.t) s->friction.resumed = 0;
  s->friction.resumed_t = s->clock.t;
  return s->friction.resumed;
}

/* After a failure of friction: whether the run goes on from the state in place, with other modes, a ball spinning or a jammed pair
 * stopped. Each pair may be what a failure is passed by, once at one time: what has led nowhere leads nowhere again. */
static int tr_goes_on(tr_sim *s, int code) {
  if (code != TR_FAIL_MULTIPLIERS && code != TR_FAIL_MODES) return 0;
  if (tr_method_of(s)->kind == TR_IMPULSES) { /* which then fails soon again does not go on for ever */
    if (s->clock.t - s->moreau.failed_t <= STALL_TIME / s->set.rate) return 0;
    s->moreau.failed_t = s->clock.t;
  }
  const int more = tr_resumed_here(s) < s->k->nsliders;
  if (!(more && (tr_decides_anew(s) || tr_lets_spin(s) || tr_slow_pair_stops(s))) && !tr_searches_on(s, code) && !tr_holds_otherwise(s) &&
      !tr_passes_fold(s) && !(s->friction.resumed < RESUMED_MOST * s->k->nsliders && tr_through_jam(s)))
    return 0;
  s->friction.resumed++, s->friction.failed = -1;
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  return 1;
}

/* Whether the run neither gets on nor ends: so many trial steps, accepted or not, in next to no time. Steps that are asked to be shorter
 * get on by themselves. */
static int tr_stalls(tr_sim *s) {
  const double asked = s->set.hfixed > 0.0 ? s->set.hfixed : s->set.hmax;
  const long tried = s->stats.steps + s->stats.rejected;
  if (s->clock.t - s->step.moved_t > fmin(STALL_TIME / s->set.rate, 0.5 * asked)) s->step.moved_t = s->clock.t, s->step.moved = tried;
  return tried - s->step.moved > STALL_TRIALS;
}

static int tr_advance_bounded(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count);

/* Go on to `target`, at most max_steps steps. Rows are appended to rows[capacity][want]. What is given up while a failure is being
 * passed is no failure. */
int tr_advance(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count) {
  *count = 0;
  if (s->clock.status > TR_DONE) return s->clock.status;
  s->clock.status = TR_OK;
  if (s->set.evaluations > 0) return tr_advance_bounded(s, target, max_steps, rows, capacity, count);
  for (long step = 0;;) {
    int code = TR_OK;
    if (s->ask.stop) return s->clock.status = TR_STOPPED;
    if (s->pending.kind != TR_NOTHING) {
      code = tr_finish(s, rows, capacity, count);
      if (s->ask.stop || tr_goes_on(s, code) || s->ask.stop) continue;
      if (code != TR_OK) return tr_end(s, code);
      if (s->events.count > s->events.capacity - 2 * tr_watched(s) - 2) return TR_EVENTS_FULL;
    }
    if (s->clock.t >= target - tr_same_time(target)) return s->clock.status = TR_DONE;
    if (step++ >= max_steps) return TR_MORE;
    if (tr_stalls(s)) return tr_end(s, TR_FAIL_STALLED);
    if (s->set.max_steps > 0 && s->stats.steps >= s->set.max_steps) return s->clock.status = TR_FAIL_MAX_STEPS;
    code = tr_attempt(s, tr_limit_time(s, target));
    if (code == TR_NEED_JACOBIAN) {
      s->clock.status = TR_OK;
      return code;
    }
    if (s->ask.stop || tr_goes_on(s, code) || s->ask.stop) continue;
    if (code != TR_OK) return tr_end(s, code);
  }
}
