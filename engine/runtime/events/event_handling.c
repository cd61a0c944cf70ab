/* Handling of events of set-valued laws: bring pairs to rest, decide modes, log the changes. */
#include "events/events.h"

#define TURN_NOTED 0.017453292519943295 /* rad: at an event, contacts of other pairs that turn by more are logged, too */
#define BALL_TURNS 4                    /* largest number of decisions at one event; decisions repeat while balls change branch */
/* largest number of branch changes of balls at one time; a single change suffices if the new branch exists */
#define BRANCH_CHANGES 4
#define CONE_NEAR 1e-6 /* distance s²/|ω|²: with loops closed, a ball closer to its cone counts as a ball at its cone */
#define ANSWERS_LATER 2    /* after the start: largest number of pairs at rest for which a decision searches for other solutions */

static int tr_mode_change(const tr_sim *s, int i, const tr_mode *old) {
  const tr_mode *m = tr_mode_of(s, i);
  const double *lever = TR_A(s, lever) + tr_pair_of(s, i)->eta0;
  int was = tr_mode_flag(old) != TR_STUCK, is = tr_mode_flag(m) != TR_STUCK;
  if (!was || !is) return was == is ? 0 : is ? TR_EV_SLIP : TR_EV_STICK;
  double along = 0.0;
  for (int j = 0; j < tr_pair_of(s, i)->neta; ++j) along += m->direction[j] * lever[j] * (old->direction[j] * lever[j]);
  return along < 0.0 ? TR_EV_REVERSAL : 0;
}

/* Log the pairs whose mode differs from `modes`, and the contacts of other pairs that turned. contacts: whether `before` and
 * `after` are valid. */
static void tr_log_changes(tr_sim *s, double t, const tr_mode *modes, const tr_contact *before, const tr_contact *after,
                           int contacts) {
  const double floor = contacts ? tr_faint_contact_force(s, before, after, s->o->ncontacts) : 0.0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    int kind = tr_is_set_valued(s, i) ? tr_mode_change(s, i, modes + i) : 0;
    const tr_contact *p = before + pair->contact0, *q = after + pair->contact0;
    double most = 0.0, margin = s->events.margin;
    const int unsure = s->events.unsure;
    for (int j = 0; contacts && !kind && j < pair->ncontacts; ++j) most = fmax(most, tr_contact_turn(p + j, q + j, floor));
    if (most > TURN_NOTED) kind = TR_EV_CONTACT_JUMP, tr_record_margin(s, most - TURN_NOTED);
    if (kind) tr_log_event(s, t, kind, i, p, q, contacts ? pair->ncontacts : 0);
    s->events.margin = margin, s->events.unsure = unsure;
  }
}

/* Whether pair i, evaluated last, is a moving ball that reaches its cone. If the ball stops instead, its remaining speed is at most
 * the closure error of the loops. */
static int tr_is_at_cone(const tr_sim *s, int i) {
  if (!tr_is_moving_ball(s, i)) return 0;
  if (tr_pair_speed(s, i) > tr_closure_speed(s)) return 1;
  return tr_mode_flag(tr_mode_of(s, i)) == TR_CONE || tr_sliding_of(s, i)->cone <= CONE_NEAR;
}

static void tr_change_branch(tr_sim *s, int i) {
  tr_mode *m = tr_mode_of(s, i);
  m->flag = tr_mode_flag(m) == TR_CONE ? TR_SLIPS : TR_CONE;
  tr_freeze_direction(s, i);
  if (tr_mode_flag(m) == TR_SLIPS) tr_find_tilt(s, TR_A(s, z) + s->k->active, i), tr_clear_tilts(s);
}

static int tr_handle_cone_event(tr_sim *s, double t, const double *y, int i) {
  const int turns_back = tr_mode_flag(tr_mode_of(s, i)) != TR_CONE && tr_sliding_of(s, i)->cone > CONE_NEAR;
  s->step.margin_end = NAN;
  if (s->events.chatter > BRANCH_CHANGES) return TR_FAIL_MULTIPLIERS;
  tr_change_branch(s, i);
  if (tr_rhs(s, t, y, TR_A(s, dy)) && !(turns_back && tr_sliding_of(s, i)->cone > 0.0)) return TR_OK;
  if (!turns_back) return TR_FAIL_MULTIPLIERS;
  tr_change_branch(s, i);
  return tr_rhs(s, t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* Switch the branch of each ball that a jump of forces carried across its cone, in the state evaluated last. Returns 1 if any
 * branch changed. */
static int tr_switch_crossed_balls(tr_sim *s) {
  int crossed = 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const double cone = tr_sliding_of(s, i)->cone;
    if (!tr_is_set_valued(s, i) || !tr_is_moving_ball(s, i)) continue;
    if ((tr_mode_flag(tr_mode_of(s, i)) == TR_CONE ? cone : -cone) <= TOL_CONE) continue;
    tr_change_branch(s, i);
    crossed = 1;
  }
  return crossed;
}

/* Decide the modes of the n pairs `rest` at the current state (t, y), and evaluate the solution. Repeats while balls change branch,
 * because forces and branches depend on each other. *decided receives the result of tr_decide_modes. Returns a status. */
static int tr_decide_with_balls(tr_sim *s, double t, const double *y, const int *rest, int n, int released, int *decided) {
  for (int turn = 0; turn < BALL_TURNS; ++turn, released = -1) {
    if (n) {
      if (turn) tr_evaluate_maps(s, y);
      if (!(*decided = tr_decide_modes(s, rest, n, released))) return TR_FAIL_MODES;
      tr_prefer_sticking(s, t, rest, n, released, ANSWERS_LATER);
    }
    if (!tr_rhs(s, t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
    if (!tr_switch_crossed_balls(s)) return TR_OK;
  }
  return tr_rhs(s, t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* Freeze the present direction of each pair that moved along a line and has left this line. Slow pairs and the n pairs `rest` are
 * excluded. Requires maps of the current state. */
static void tr_freeze_left_lines(tr_sim *s, const int *rest, int n) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (tr_pair_of(s, i)->nrates == 1 || !(tr_frozen_length(s, i) > TR_LINE) || tr_contains(rest, n, i)) continue;
    if (tr_pair_speed(s, i) > tr_crawl_speed(tr_speed_unit(s)) && !tr_is_on_line(s, i, tr_pair_rates(s, i), LINE_LEFT)) tr_freeze_direction(s, i);
  }
}

/* Pair i stops at (t, y), where no solution at rest exists. If drives move the pair, let it slide on. Returns 0 if no drive moves
 * it. */
static int tr_continue_driven(tr_sim *s, double t, const double *y, int i, const tr_mode *modes) {
  tr_restore_modes(s, modes);
  tr_evaluate_maps_at(s, t, y);
  const double speed = tr_pair_speed(s, i);
  if (tr_pair_of(s, i)->nrates == 1 || tr_mode_flag(modes + i) == TR_STUCK || !(speed > 2.0 * tr_stick_tolerance(tr_speed_unit(s)))) return 0;
  if (!tr_is_moved_by_drives(s, i, t, y)) return 0;
  tr_freeze_line_direction(s, i, tr_pair_rates(s, i), speed);
  return tr_rhs(s, t, y, TR_A(s, dy));
}

/* Whether a pair of `rest` (n) starts to slide while it moves backwards. This happens if a drive has begun to move and the rates of
 * the loop do not follow the drive yet. */
static int tr_is_starting_backwards(const tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n && s->k->active; ++q) {
    if (tr_pair_of(s, rest[q])->nrates > 1 || !tr_is_sliding(s, rest[q])) continue;
    if (tr_stick_overshoot(tr_sliding_of(s, rest[q])->speed, tr_speed_unit(s)) > 1.0) return 1;
  }
  return 0;
}

static int tr_handle_event(tr_sim *s, double t, double *y, int which, const tr_contact *known) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], nc = s->o ? s->o->ncontacts : 0, own = which >= 0 && which < k->nsliders && tr_is_set_valued(s, which);
  tr_mode modes[k->nsliders + 1];
  tr_contact before[nc + 1], after[nc + 1];
  tr_save_modes(s, modes);
  double shares[k->nsliders + 1];
  tr_save_held_shares(s, shares);
  const int contacts = known || tr_current_contacts(s, y, before);
  if (known) memcpy(before, known, sizeof(tr_contact) * nc);
  s->step.margin_end = NAN;
  if (own && tr_is_at_cone(s, which)) {
    tr_change_branch(s, which); /* a ball's friction is continuous at its cone, so the event only changes the branch */
    return tr_rhs(s, t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
  }
  int released = own && tr_is_stuck(s, which) ? which : -1, n = tr_collect_pairs_at_rest(s, own ? which : -1, rest), decided = 1;
  if (released >= 0) tr_let_slip(s, released);
  if (n) n = tr_bring_all_to_rest(s, y, own ? which : -1, rest, n);
  tr_freeze_left_lines(s, rest, n);
  int code = tr_decide_with_balls(s, t, y, rest, n, released, &decided);
  if (code != TR_OK && own && tr_continue_driven(s, t, y, which, modes)) return TR_OK;
  if (code != TR_OK) return code;
  if (tr_is_starting_backwards(s, rest, n) && (!tr_project(s, t, y) || !tr_rhs(s, t, y, TR_A(s, dy)))) return TR_FAIL_MULTIPLIERS;
  tr_record_margin(s, tr_decision_margin(s, rest, n, released, shares));
  s->step.margin_end = tr_worst_violation(s, y, &n);
  tr_certify(s);
  if (contacts) tr_current_contacts(s, y, after), memcpy(TR_A(s, contacts), after, sizeof(tr_contact) * nc);
  /* decided = 2: only the shares of loads changed. Shares are not unique, so no change is logged. */
  if (decided == 1) tr_log_changes(s, t, modes, before, after, contacts);
  return TR_OK;
}

static int tr_decide_again(tr_sim *s, int which, const tr_mode *modes, int others) {
  double *y = TR_A(s, y), old[tr_state_width(s)];
  memcpy(old, y, sizeof old);
  int ok = tr_handle_event(s, s->clock.t, y, which, 0) == TR_OK;
  if (!ok || (others && memcmp(modes, tr_mode_of(s, 0), sizeof(tr_mode) * s->k->nsliders) == 0)) {
    tr_restore_modes(s, modes), memcpy(y, old, sizeof old);
    return 0;
  }
  /* ẏ is copied, because a second evaluation might find another solution */
  memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_state_width(s));
  s->step.have_k1 = 1, s->step.have_jac = 0, s->step.margin = s->step.margin_end;
  s->step.h = s->set.hfixed;
  return 1;
}
