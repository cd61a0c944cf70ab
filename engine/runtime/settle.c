/* What happens at an event of a set-valued law, in time: rest, decision, the record of what changed. */
#include "modes.h"

#define TURN_NOTED 0.017453292519943295 /* rad: contacts of other joints that turn by more at an event are recorded too */
#define BALL_TURNS 4                    /* decisions that balls may undo by changing their branch */
#define BRANCH_CHANGES 4                /* events at one time at which a ball changes its branch: once is enough where one of the two leads on */
#define CONE_NEAR 1e-6                  /* of s²/|ω|²: a ball this near to its cone, once the loops are closed, is at it */
#define LINE_LEFT 1e-6                  /* of the speed: what is across a line that has been left (as POWER_GIVEN: by as much friction may drive) */

/* What became of pair i: an event kind, or 0. Directions are those of surface speeds: a shaft's travel and turn have units of their own. */
static int tr_change(const tr_sim *s, int i, const tr_mode *old) {
  const tr_mode *m = tr_mode_of(s, i);
  const double *arm = TR_A(s, arm) + tr_pair_of(s, i)->eta0;
  int was = tr_flag(old) != TR_STUCK, is = tr_flag(m) != TR_STUCK;
  if (!was || !is) return was == is ? 0 : is ? TR_EV_SLIP : TR_EV_STOP;
  double along = 0.0;
  for (int j = 0; j < tr_pair_of(s, i)->neta; ++j) along += m->direction[j] * arm[j] * (old->direction[j] * arm[j]);
  return along < 0.0 ? TR_EV_REVERSAL : 0;
}

/* Record what changed: pairs whose mode did, and contacts elsewhere that turned. */
static void tr_log_changes(tr_sim *s, double t, const tr_mode *modes, const tr_contact *before, const tr_contact *after,
                           int contacts) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    int kind = tr_is_set(s, i) ? tr_change(s, i, modes + i) : 0;
    const tr_contact *p = before + pair->contact0, *q = after + pair->contact0;
    double most = 0.0, margin = s->events.margin;
    const int unsure = s->events.unsure;
    for (int j = 0; contacts && !kind && j < pair->ncontacts; ++j) most = fmax(most, tr_turn_of(p + j, q + j));
    if (most > TURN_NOTED) kind = TR_EV_TURN, tr_hangs_on(s, most - TURN_NOTED);
    if (kind) tr_log(s, t, kind, i, p, q, contacts ? pair->ncontacts : 0);
    s->events.margin = margin, s->events.unsure = unsure;
  }
}

/* Whether the event of pair i, just evaluated, is that of a ball that moves and comes to its cone: not one whose sliding ends, which leaves
 * no more speed than what closes the loops. */
static int tr_at_cone(const tr_sim *s, int i) {
  if (!tr_moving_ball(s, i)) return 0;
  if (tr_pair_speed(s, i) > tr_creep(s)) return 1;
  return tr_flag(tr_mode_of(s, i)) == TR_CONE || tr_sliding_of(s, i)->cone <= CONE_NEAR;
}

/* A ball that slid turns about its contact from now on, or the other way round. */
static void tr_change_branch(tr_sim *s, int i) {
  tr_mode *m = tr_mode_of(s, i);
  m->flag = tr_flag(m) == TR_CONE ? TR_SLIPS : TR_CONE;
  tr_freeze(s, i);
  if (tr_flag(m) == TR_SLIPS) tr_tilt_of(s, TR_A(s, z) + s->k->active, i), tr_forget_tilts(s);
}

/* The event of ball i in motion, located inside a step and evaluated at (t, y): never the end of its motion. It has come to its cone and
 * changes its branch; or its sliding turns back before the cone does, and what was found there is the other branch: then it goes over to
 * that, if that is there at y, and slides on otherwise. Where it goes from one branch to the other and back without end both end there: they
 * have met, and neither leads on. */
static int tr_meets_cone(tr_sim *s, double t, const double *y, int i) {
  const int turns_back = tr_flag(tr_mode_of(s, i)) != TR_CONE && tr_sliding_of(s, i)->cone > CONE_NEAR;
  s->step.margin_end = NAN;
  if (s->events.chatter > BRANCH_CHANGES) return TR_FAIL_MULTIPLIERS;
  tr_change_branch(s, i);
  if (tr_rhs(s, t, y, TR_A(s, dy)) && !(turns_back && tr_sliding_of(s, i)->cone > 0.0)) return TR_OK;
  if (!turns_back) return TR_FAIL_MULTIPLIERS;
  tr_change_branch(s, i);
  return tr_rhs(s, t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* Balls in motion that a jump of the forces has carried across their cones, at the state just evaluated: they change their branch. 1 when
 * one does. */
static int tr_balls_cross(tr_sim *s) {
  int crossed = 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const double cone = tr_sliding_of(s, i)->cone;
    if (!tr_is_set(s, i) || !tr_moving_ball(s, i)) continue;
    if ((tr_flag(tr_mode_of(s, i)) == TR_CONE ? cone : -cone) <= TOL_CONE) continue;
    tr_change_branch(s, i);
    crossed = 1;
  }
  return crossed;
}

/* Decide the modes of the pairs `rest` (n) at (t, y), and evaluate; what balls do follows from the forces that come of it, and these from
 * what balls do. */
static int tr_decide_with_balls(tr_sim *s, double t, const double *y, const int *rest, int n, int released, int *decided) {
  for (int turn = 0; turn < BALL_TURNS; ++turn, released = -1) {
    if (n) {
      tr_maps_of(s, y);
      if (!(*decided = tr_decide(s, rest, n, released))) return TR_FAIL_MODES;
      tr_note_answers(s, t, rest, n, ANSWERS_LATER);
    }
    if (!tr_rhs(s, t, y, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
    if (!tr_balls_cross(s)) return TR_OK;
  }
  return tr_rhs(s, t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* Pairs that began to slide along a line in the step just made, and have left it since, have the direction that they have by now, unless they
 * are slow still. Maps in place. */
static void tr_turn_from_lines(tr_sim *s, const int *rest, int n) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (tr_pair_of(s, i)->nrates == 1 || !(tr_frozen_length(s, i) > TR_LINE) || tr_is_one_of(rest, n, i)) continue;
    if (tr_pair_speed(s, i) > NEAR_MISS * tr_speed_unit(s) && !tr_is_on_line(s, i, tr_slider_rates(s, i), LINE_LEFT)) tr_freeze(s, i);
  }
}

/* Pair i, said to stop at (t, y), has no speed any more but what drives give it, and is not at rest with that: it goes on as they move it. */
static int tr_goes_on_driven(tr_sim *s, double t, const double *y, int i, const tr_mode *modes) {
  tr_put_modes(s, modes);
  tr_maps_at(s, t, y);
  const double speed = tr_pair_speed(s, i);
  if (tr_pair_of(s, i)->nrates == 1 || tr_flag(modes + i) == TR_STUCK || !(speed > 2.0 * TOL_SPEED * tr_speed_unit(s))) return 0;
  if (!tr_drives_move(s, i, t, y)) return 0;
  tr_freeze_along(s, i, ON_LINE, tr_slider_rates(s, i), speed);
  return tr_rhs(s, t, y, TR_A(s, dy));
}

/* At the event of ``which`` (a pair, or −1: something else has jumped) at (t, y), evaluated in the old modes: decide anew. known: contact
 * forces up to there (0: those at y). */
static int tr_settle(tr_sim *s, double t, double *y, int which, const tr_contact *known) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], nc = s->o ? s->o->ncontacts : 0, own = which >= 0 && which < k->nsliders && tr_is_set(s, which);
  tr_mode modes[k->nsliders + 1];
  tr_contact before[nc + 1], after[nc + 1];
  tr_keep_modes(s, modes);
  double shares[k->nsliders + 1];
  tr_shares_held(s, shares);
  const int contacts = known || tr_all_contacts(s, y, before);
  if (known) memcpy(before, known, sizeof(tr_contact) * nc);
  s->step.margin_end = NAN;
  if (own && tr_at_cone(s, which)) {
    tr_change_branch(s, which); /* a ball between sliding and spinning: its law is continuous there */
    return tr_rhs(s, t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
  }
  int released = own && tr_is_stuck(s, which) ? which : -1, n = tr_at_rest(s, own ? which : -1, rest), decided = 1;
  if (released >= 0) tr_let_slip(s, released);
  if (n) n = tr_all_to_rest(s, y, own ? which : -1, rest, n);
  tr_turn_from_lines(s, rest, n);
  int code = tr_decide_with_balls(s, t, y, rest, n, released, &decided);
  if (code != TR_OK && own && tr_goes_on_driven(s, t, y, which, modes)) return TR_OK;
  if (code != TR_OK) return code;
  tr_hangs_on(s, tr_decision_margin(s, rest, n, released, shares));
  s->step.margin_end = tr_beyond(s, y, &n);
  tr_certify(s);
  if (contacts) tr_all_contacts(s, y, after), memcpy(TR_A(s, con), after, sizeof(tr_contact) * nc);
  if (decided == 1) tr_log_changes(s, t, modes, before, after, contacts); /* else only friction that is not unique is split anew */
  return TR_OK;
}

/* Decide anew at the block's state, for the sake of pair `which` (-1: of none); what changed is undone where that fails, or leaves the modes
 * as they were in `modes` though others are wanted. 1 when the run goes on from there. */
static int tr_settles_anew(tr_sim *s, int which, const tr_mode *modes, int others) {
  double *y = TR_A(s, y), old[tr_width(s)];
  memcpy(old, y, sizeof old);
  int ok = tr_settle(s, s->clock.t, y, which, 0) == TR_OK;
  if (!ok || (others && memcmp(modes, tr_mode_of(s, 0), sizeof(tr_mode) * s->k->nsliders) == 0)) {
    tr_put_modes(s, modes), memcpy(y, old, sizeof old);
    return 0;
  }
  memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s)); /* decided again it might not be found again */
  s->step.have_k1 = 1, s->step.have_jac = 0, s->step.margin = s->step.margin_end;
  s->step.h = s->set.hfixed;
  return 1;
}
