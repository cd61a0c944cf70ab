/* The stepping loop, up to the target: make trial steps until one is accepted, then complete this step. */
#include "stepping/stepping.h"

/* per pair: largest number of failures that a run overcomes at one time; the second half is overcome only by impacts */
#define RESUMED_MOST 2
#define STALL_TIME 1e-9         /* in units of 1 / rate scale: least progress of STALL_TRIALS steps */
/* relative to a fixed step: least progress of STALL_TRIALS trial steps; events may cut these steps short */
#define STALL_SHARE 1e-3
#define STALL_TRIALS 20000      /* number of trial steps, at most one second of work; an onset or a capture needs about a hundred */

/* Number of failures that the run has overcome at the present time. */
static int tr_count_resumptions(tr_sim *s) {
  if (s->friction.resumed_t != s->clock.t) s->friction.resumed = 0;
  s->friction.resumed_t = s->clock.t;
  return s->friction.resumed;
}

/* Remove the cause of the friction failure `code` by the first remedy that applies. Returns whether a remedy applied. */
static int tr_remedy_failure(tr_sim *s, int code) {
  const int more = tr_count_resumptions(s) < s->k->nsliders;
  return (more && (tr_reset_modes(s) || tr_let_ball_spin(s) || tr_stop_slow_pair(s))) || tr_decide_from_anywhere(s, code) ||
         tr_continue_by_stored_loads(s) || tr_pass_fold(s) ||
         (s->friction.resumed < RESUMED_MOST * s->k->nsliders && tr_continue_through_jam(s));
}

static int tr_continue_after_failure(tr_sim *s, int code) {
  if (code != TR_FAIL_MULTIPLIERS && code != TR_FAIL_MODES) return 0;
  if (tr_method_of(s)->kind == TR_IMPULSES) { /* a run by impulse steps ends at a second failure soon after the first */
    if (s->clock.t - s->moreau.failed_t <= STALL_TIME / s->set.rate) return 0;
    s->moreau.failed_t = s->clock.t;
  }
  do {
    if (!tr_remedy_failure(s, code)) return 0;
    s->friction.resumed++, s->friction.failed = -1;
  } while (s->friction.redecide && tr_decide_contacts(s) != TR_OK); /* remedies change friction, not contacts */
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  return 1;
}

/* Whether the last STALL_TRIALS trial steps, accepted or refused, made no progress in time. Steps that are short because of the
 * host do not count. */
static int tr_is_stalled(tr_sim *s) {
  const double least = s->set.hfixed > 0.0 ? STALL_SHARE * s->set.hfixed : fmin(STALL_TIME / s->set.rate, 0.5 * s->set.hmax);
  const long tried = s->stats.steps + s->stats.rejected;
  if (s->clock.t - s->step.moved_t > least) s->step.moved_t = s->clock.t, s->step.moved = tried;
  return tried - s->step.moved > STALL_TRIALS;
}

int tr_advance(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count) {
  *count = 0;
  if (s->clock.status > TR_DONE) return s->clock.status;
  s->clock.status = TR_OK;
  if (s->set.evaluations > 0) return tr_advance_bounded(s, target, max_steps, rows, capacity, count);
  for (long step = 0;;) {
    int code = TR_OK;
    if (s->ask.cancelled) return s->clock.status = TR_CANCELLED;
    if (s->pending.kind != TR_NOTHING) {
      code = tr_complete_step(s, rows, capacity, count);
      if (code == TR_WAITS) return code;
      if (s->ask.cancelled || tr_continue_after_failure(s, code) || s->ask.cancelled) continue;
      if (code != TR_OK) return tr_end_run(s, code);
      if (s->events.count > s->events.capacity - 2 * tr_watched_count(s) - 2) return TR_EVENTS_FULL;
    }
    if (s->clock.t >= target - tr_time_tolerance(target)) return s->clock.status = TR_DONE;
    if (step++ >= max_steps) return TR_MORE;
    if (tr_is_stalled(s)) return tr_end_run(s, TR_FAIL_STALLED);
    if (s->set.max_steps > 0 && s->stats.steps >= s->set.max_steps) return s->clock.status = TR_FAIL_MAX_STEPS;
    code = tr_make_step(s, tr_step_limit(s, target));
    if (code == TR_NEED_JACOBIAN || code == TR_WAITS) {
      s->clock.status = TR_OK;
      return code;
    }
    if (s->ask.cancelled || tr_continue_after_failure(s, code) || s->ask.cancelled) continue;
    if (code != TR_OK) return tr_end_run(s, code);
  }
}
