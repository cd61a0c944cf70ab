/* Trial steps: make a step, project and evaluate its end, search for events. Then accept the step, refuse it, or remake it so that
 * it ends at its event. In a batch with SIMD lanes, a case waits before the stages and before the end of a trial step. The function
 * of the case then returns, and continues in the same phase at the next call. */
#include "stepping/stepping.h"

#define CHATTER_MAX 12          /* number of consecutive events at one time after which steps ignore events */
#define GROW_FIXED 2.0       /* growth factor of the parts of a fixed step */
/* relative to a fixed step: smallest part into which the step is divided where friction requires shorter steps, for example where
 * sliding of several components ends */
#define LEAST_PART 1e-4
/* relative to the distance to the limit: if less would remain after a step, the step is extended to the limit */
#define LEFT_OVER 1e-10
/* in tolerances: if the error of a step is larger, states inside the step are less accurate than its end. The step is then remade
 * up to its event. */
#define CUT_ERROR 1e-2
#define CUT_EARLY 0.9           /* relative to the step: a step is not remade if its event is later */
#define CUT_BEYOND 1.02         /* relative to the time to the event: size of the remade step */
#define CUTS_MOST 2             /* largest number of remakes for one event */
#define CORNER_CUTS 3 /* largest number of remakes for one corner; the error of the dense output limits the gain of each remake */
#define PROBED 1e-6          /* in units of 1 / rate scale: length of the Euler step that finds the reason of a failure */
#define ROOT_LOST 1e-5       /* largest |1 − contraction| at which a root of friction counts as lost */
#define ANOTHER_ROOT 0.1 /* relative to the friction: a larger change over the first Euler step means that another root was found */

static double tr_step_limit(const tr_sim *s, double target) {
  return fmin(target, s->clock.next_break);
}

/* Whether the n frictions `is`, found for the estimate of the first step size, belong to another root than the frictions `was`. */
static int tr_is_other_root(int n, const double *was, const double *is) {
  double changed = 0.0, size = 0.0;
  for (int i = 0; i < n; ++i) changed += fabs(is[i] - was[i]), size += fabs(was[i]);
  return changed > ANOTHER_ROOT * size;
}

static int tr_has_stopped_with_drive(const tr_sim *s) {
  if (s->clock.last_break < s->clock.t - tr_time_tolerance(s->clock.t)) return 0;
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set_valued(s, i) && tr_is_sliding(s, i) && tr_is_at_rest(s, i)) return 1;
  return 0;
}

/* Prepare a step: evaluate ẏ at its start, choose a first step size, freeze sliding directions. Returns a status. */
static int tr_begin_step(tr_sim *s, double limit, int order) {
  const tr_kernel *k = s->k;
  double gap[k->nunilateral + 1], rate[k->nunilateral + 1];
  const int missed = tr_check_missed_contacts(s, gap, rate);
  if (missed != TR_OK) return missed;
  if (!s->step.have_k1) {
    s->step.margin = NAN;
    const double left = limit - s->clock.t;
    tr_moment_of(s)->inside = s->clock.t + 0.5 * fmin(left, s->step.h > 0.0 ? s->step.h : left);
    s->step.watch = 0;
    if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
    if (s->friction.held || tr_has_stopped_with_drive(s)) { /* loads may have jumped, or a drive may have come to rest */
      int code = tr_handle_event(s, s->clock.t, TR_A(s, y), -1, 0);
      if (code != TR_OK) return code;
      if (s->step.margin_end == s->step.margin_end) tr_copy_violations(s, TR_NOW, TR_AT_START);
    }
    memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_state_width(s));
    s->step.have_k1 = 1;
  }
  if (tr_has_contact_to_decide(s, gap, rate)) {
    const int code = tr_decide_contacts(s);
    if (code != TR_OK) return code;
    memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_state_width(s)), s->step.have_k1 = 1;
  }
  if (s->step.h <= 0.0) {
    double z[k->active + k->neta + 1];
    tr_copy(k->active + k->neta, TR_A(s, z), z);
    s->step.h = tr_first_step(s, limit - s->clock.t, order);
    if (tr_is_other_root(k->neta, z + k->active, TR_A(s, z) + k->active)) tr_copy(k->active + k->neta, z, TR_A(s, z));
  }
  if (!s->set.locate || s->events.chatter > CHATTER_MAX) tr_reverse_kink_directions(s);
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_is_sliding(s, i) || tr_pair_of(s, i)->nrates == 1) continue;
    s->step.margin = NAN;
    if (!tr_is_set_valued(s, i)) tr_freeze_direction_at_start(s, i);
    else if (!tr_is_direction_frozen(s, i, tr_speed_of_state(s, i)) && !tr_is_still_on_line(s, i)) tr_rates_of_state(s, i, tr_mode_of(s, i)->direction);
  }
  if (k->sets && s->set.hfixed <= 0.0) s->step.h = fmin(s->step.h, fmin(tr_longest_onset_step(s, TR_A(s, K) + k->nq), tr_longest_held_step(s)));
  s->step.h = fmin(s->step.h, tr_longest_singular_step(s));
  if (k->nunilateral && s->set.hfixed <= 0.0) s->step.h = fmin(s->step.h, tr_longest_open_step(s));
  tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zold));
  tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zstart));
  if (s->step.begin_x) memcpy(s->step.begin_x, TR_A(s, x), sizeof(double) * k->nx);
  return TR_OK;
}

/* Use explicit steps while the Jacobian of the stiff method is invalid. It is invalid while a pair of several components starts
 * from rest, or while groups share their load. Also use explicit steps if drives prescribe all motion. Such mechanisms are not
 * stiff, and only the work errors of explicit steps show a start and a stop inside one step. */
static void tr_use_explicit_for_now(tr_sim *s) {
  const tr_kernel *k = s->k;
  if ((!k->sets && s->ny) || (tr_method_of(s)->kind != TR_IMPLICIT && !s->step.explicit_for_now)) return;
  int slow = s->friction.shared || !s->ny;
  for (int i = 0; i < k->nsliders && !slow; ++i)
    slow = tr_is_set_valued(s, i) && tr_is_sliding(s, i) && tr_pair_of(s, i)->nrates > 1 && tr_is_direction_frozen(s, i, tr_speed_of_state(s, i));
  if (slow != s->step.explicit_for_now) s->step.have_jac = 0;
  s->step.explicit_for_now = slow;
  s->step.method = slow ? TR_AUTO_TIGHT : tr_is_auto(s) ? TR_AUTO_STIFF : s->set.method;
}

/* The next trial step. Shortly before the limit, the remaining time is divided into two equal steps, instead of a long step and a
 * very short step. */
TR_INLINE tr_trial tr_trial_towards(const tr_sim *s, double limit) {
  const double fixed = s->set.hfixed, left = limit - s->clock.t;
  tr_trial trial = {.theta = 1.0, .which = -1, .found = TR_NO_EVENT};
  trial.h = fixed > 0.0 && !s->k->sets ? fixed : fmin(s->step.h, fixed > 0.0 ? fixed : s->set.hmax);
  trial.last = trial.h >= left * (1.0 - LEFT_OVER);
  if (trial.last) trial.h = left;
  else if (trial.h > 0.5 * left && fixed <= 0.0) trial.h = 0.5 * left;
  trial.end = trial.last ? limit : s->clock.t + trial.h;
  return trial;
}

/* Project y at time t and evaluate ẏ. Returns 0 if the projection or the evaluation fails. */
static inline int tr_project_and_evaluate(tr_sim *s, double t, double *y, double *dy) {
  return tr_take_from_lane(s, TR_ASK_END, 1) || (tr_project(s, t, y) && tr_rhs(s, t, y, dy));
}

/* Examine a trial step within the tolerance: project and evaluate its end, check the laws, search for events. Sets err to NaN if
 * the step must be refused. A step without a solution in its middle is also refused, because a root of friction may end there. */
TR_INLINE void tr_examine_trial(tr_sim *s, const tr_method *m, tr_trial *trial) {
  const int n = tr_state_width(s), live = s->ny;
  double *ynew = TR_A(s, ynew), *slope = TR_A(s, K) + m->end * n;
  s->step.t0 = s->clock.t, s->step.size = trial->end - s->clock.t, s->step.have_dense = 0;
  tr_copy(n, TR_A(s, y), TR_A(s, yold));
  const int solved = m->kind != TR_IMPLICIT || tr_evaluate_middle_powers(s, m->rosenbrock) || s->set.hfixed > 0.0;
  if (!solved || !tr_is_finite(live, ynew) || !tr_project_and_evaluate(s, trial->end, ynew, slope) || !tr_is_finite(live, slope))
    trial->err = NAN;
  else if ((trial->err = fmax(trial->err, fmax(tr_error_of_slopes(s, m, trial->h), tr_singular_error(s, m, trial->h)))) <= 1.0) {
    s->step.margin_end = NAN;
    if (s->k->sets && tr_release_left_lines(s)) {
      trial->err = NAN;
      return;
    }
    tr_store_end_multipliers(s);
    int sure, broken = tr_suspect_end(s, ynew, &sure);
    tr_audit_laws(s, 1);
    if (s->events.chatter <= CHATTER_MAX) trial->found = tr_find_event(s, &trial->which, &trial->theta);
    if (broken && !sure && trial->found == TR_NO_EVENT) broken = tr_confirm_end(s, trial->end, ynew);
    if (broken && trial->found == TR_NO_EVENT) {
      if (tr_find_other_end(s, broken, trial->end, ynew, slope)) tr_audit_laws(s, 0);
      else trial->err = NAN;
    }
  }
  if (trial->found == TR_TOO_LARGE || (s->k->sets && s->set.hfixed <= 0.0 && tr_is_onset_too_fast(s, ynew, trial->h))) trial->err = NAN;
}

/* Make the trial step. Returns TR_OK, TR_NEED_JACOBIAN or TR_WAITS. */
TR_INLINE int tr_make_trial(tr_sim *s, const tr_method *m, tr_trial *trial) {
  const int explicit = m->kind != TR_IMPLICIT;
  if (s->step.phase == TR_PHASE_STAGES) {
    TR_SPOILT(s, TR_HAS_DENSE);
    tr_moment_of(s)->inside = s->clock.t + 0.5 * trial->h;
    s->step.watch = s->set.locate && s->k->nsliders > 0;
    s->step.failure = TR_OK;
    if (s->lane && explicit && tr_wait_for_step(s, trial->h)) return TR_WAITS;
    trial->err = explicit ? tr_step_explicit(s, m->explicit, trial->h) : tr_step_rosenbrock(s, m->rosenbrock, trial->h);
    if (s->clock.status == TR_NEED_JACOBIAN) return TR_NEED_JACOBIAN;
    s->step.phase = TR_PHASE_END;
  }
  if (s->lane && explicit && trial->err <= 1.0 && tr_wait_for_end(s, trial->end, TR_A(s, K) + m->end * tr_state_width(s))) return TR_WAITS;
  if (trial->err <= 1.0) tr_examine_trial(s, m, trial);
  s->step.watch = 0, s->step.phase = TR_PHASE_STAGES;
  return TR_OK;
}

/* Whether an acceptable step must be remade up to a corner inside it. If so, `trial` becomes the step to the corner. */
TR_INLINE int tr_remake_to_corner(tr_sim *s, tr_trial *trial) {
  if (!s->k->nstops || trial->corners >= CORNER_CUTS) return 0;
  const double theta = tr_find_first_corner(s, trial->found == TR_FOUND ? trial->theta : 1.0);
  if (theta >= 1.0) return 0;
  const double whole = fmax(trial->whole, trial->h);
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  tr_clear_extremes(s);
  const int corners = trial->corners + 1;
  *trial = (tr_trial){.h = theta * trial->h, .theta = 1.0, .which = -1, .found = TR_NO_EVENT, .cuts = trial->cuts, .whole = whole, .corners = corners};
  trial->end = s->clock.t + trial->h;
  return 1;
}

/* Whether a trial step must be remade up to its event. */
TR_INLINE int tr_is_remade_to_event(const tr_sim *s, const tr_trial *trial) {
  const int which = trial->which, pair = which >= 0 && which < s->k->nsliders;
  if (which < 0 || (pair && !tr_is_set_valued(s, which))) return 0;
  if (trial->theta * trial->h <= TIME_ROUND_OFF * fabs(s->clock.t)) return 0; /* the event is at the start of the step */
  if (pair && tr_is_stuck(s, which) && s->friction.shared) return 0; /* in a remade step, Newton's method might find other shares */
  return trial->found == TR_FOUND && trial->err > CUT_ERROR && trial->theta < CUT_EARLY && trial->cuts < CUTS_MOST && s->set.hfixed <= 0.0;
}

/* Accept a trial step, which is then pending. */
TR_INLINE void tr_accept_trial(tr_sim *s, const tr_method *m, const tr_trial *trial) {
  const tr_kernel *k = s->k;
  const int event = trial->found == TR_FOUND;
  tr_waiting *wait = &s->pending;
  s->step.judged = 0;
  s->stats.steps++;
  tr_add_speed_errors(s);
  wait->kind = event ? TR_STEP_TO_EVENT : TR_WHOLE_STEP;
  wait->captured = 0;
  wait->theta = trial->theta, wait->which = trial->which, wait->h = fmax(trial->h, trial->whole), wait->cut = trial->last;
  /* the event is later than estimated; if two successive steps miss their events, steps may grow */
  const int missed = trial->cuts && !event;
  if (missed && s->step.missed) wait->h = trial->h;
  s->step.missed = missed;
  wait->t = event ? s->step.t0 + trial->theta * s->step.size : trial->end;
  wait->grow = s->set.hfixed > 0.0 ? GROW_FIXED : tr_next_step_factor(s, trial->err, m->order, trial->most);
  if (trial->corners) wait->grow = fmin(wait->grow, 1.0);
  wait->grow = fmin(wait->grow, tr_position_growth(s));
  if (event) {
    if (s->pulls.count) tr_watch_step_pulls(s, trial->theta);
    tr_refine_pending_event(s), tr_integrate_works(s, m);
    return;
  }
  tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zold));
  if (k->sets) s->friction.capture = tr_find_pair_to_capture(s);
  if (s->pulls.count) tr_watch_step_pulls(s, 1.0);
  if (k->nsliders) tr_log_step_separations(s, TR_A(s, K) + m->end * tr_state_width(s) + k->nq);
  tr_integrate_works(s, m);
  tr_audit_step(s, trial->end, TR_A(s, ynew));
}

/* Remake the step so that it ends slightly after its event. The dense output has a lower order than the step's end. In the original
 * step, the error of the dense output would shift event times by hundreds of tolerances. */
TR_INLINE void tr_remake_to_event(tr_sim *s, tr_trial *trial) {
  const double h = CUT_BEYOND * trial->theta * trial->h, whole = fmax(trial->whole, trial->h);
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  tr_clear_extremes(s);
  *trial = (tr_trial){.h = h, .end = s->clock.t + h, .theta = 1.0, .which = -1, .found = TR_NO_EVENT, .cuts = trial->cuts + 1, .whole = whole};
}

/* Evaluate the end of a short Euler step; its failure shows why the run cannot continue. (A stiff step would not show the reason at
 * a dead centre, where the Jacobian is infinite.) */
static void tr_probe_failure(tr_sim *s) {
  const double h = PROBED / s->set.rate;
  double *y = TR_A(s, ytmp);
  for (int i = 0; i < tr_state_width(s); ++i) y[i] = TR_A(s, y)[i] + h * TR_A(s, K)[i];
  if (tr_project_and_evaluate(s, s->clock.t + h, y, TR_A(s, dy)) && (tr_check_solution(s, y, 0, 0) & TR_BREAKS_LOOP)) s->step.failure = TR_FAIL_MODES;
}

/* Whether friction loses its root at the start of the step. Friction then grows without bound and stops a light body within a tiny
 * distance, so that steps shrink to round-off before the equations fail. */
static int tr_is_root_lost(tr_sim *s) {
  if (!s->k->sets || !s->k->neta) return 0;
  s->step.watch = 0;
  return tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) && fabs(1.0 - tr_contraction(s)) <= ROOT_LOST;
}

/* Status of a run whose last trial step, to ynew, was refused. */
static int tr_trial_fault(tr_sim *s, double err) {
  if (err == err) return tr_is_root_lost(s) ? TR_FAIL_MULTIPLIERS : TR_FAIL_STEP;
  if ((s->step.failure == TR_OK || s->step.failure == TR_FAIL_NOT_FINITE) && s->k->active && !s->k->neta) tr_probe_failure(s);
  if (s->step.failure != TR_OK) return s->step.failure;
  return s->k->neta && tr_is_finite(s->ny, TR_A(s, ynew)) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
}

/* Return to the start of the step after a refused trial, and reduce the step size. Returns TR_OK, or the reason why a smaller step
 * is impossible. */
TR_INLINE int tr_refuse_trial(tr_sim *s, const tr_method *m, const tr_trial *trial) {
  const double err = trial->err;
  s->stats.rejected++;
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  tr_clear_extremes(s);
  s->step.h = err == err ? trial->h * tr_retry_factor(err, m->order) : SHRINK_MOST * trial->h;
  if (s->k->sets && s->set.hfixed <= 0.0) s->step.h = fmin(s->step.h, tr_longest_onset_step(s, TR_A(s, K) + s->k->nq));
  const int parts = s->set.hfixed > 0.0 && (!s->k->sets || s->step.h < LEAST_PART * s->set.hfixed);
  const int lost = s->step.h <= s->set.hmin + TIME_ROUND_OFF * fabs(s->clock.t);
  return parts || lost ? tr_trial_fault(s, err) : TR_OK;
}

/* Make trial steps until one is accepted. */
TR_INLINE int tr_make_trials(tr_sim *s, double limit) {
  const tr_method *m = tr_method_of(s);
  tr_trial trial = s->trial;
  for (;; trial.most = 1.0) { /* no growth after a refused step */
    int code = tr_make_trial(s, m, &trial);
    s->trial = trial;
    if (code != TR_OK) return code;
    if (trial.err <= 1.0) trial.err = fmax(trial.err, tr_position_error(s, trial.found == TR_FOUND ? trial.theta : 1.0));
    if (trial.err <= 1.0 && tr_remake_to_corner(s, &trial)) continue;
    if (trial.err <= 1.0 && !tr_is_remade_to_event(s, &trial)) {
      tr_accept_trial(s, m, &trial);
      return TR_OK;
    }
    if (trial.err <= 1.0) {
      tr_remake_to_event(s, &trial);
      continue;
    }
    code = tr_refuse_trial(s, m, &trial);
    if (code != TR_OK) return code;
    trial = tr_trial_towards(s, limit);
  }
}

static int tr_make_step(tr_sim *s, double limit) {
  if (tr_method_of(s)->kind == TR_IMPULSES) return tr_make_moreau_step(s, limit);
  if (s->step.phase == TR_PHASE_BEGIN) {
    tr_use_explicit_for_now(s);
    const int code = tr_begin_step(s, limit, tr_method_of(s)->order);
    if (code != TR_OK) return code;
    if (s->friction.capture >= 0 && s->clock.t + s->friction.capture_h < limit - tr_time_tolerance(limit) && tr_make_capture_step(s, limit)) {
      s->stats.steps++;
      s->pending.kind = TR_STEP_TO_EVENT;
      return TR_OK;
    }
    s->trial = tr_trial_towards(s, limit);
    s->step.phase = TR_PHASE_STAGES, s->trial.most = GROW_MOST;
  }
  const int code = tr_make_trials(s, limit);
  if (code != TR_WAITS) s->step.phase = TR_PHASE_BEGIN;
  return code;
}
