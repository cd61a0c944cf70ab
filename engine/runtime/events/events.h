/* Stage `events`: where modes end inside a step, and what happens there. */
#ifndef TR_EVENTS_H
#define TR_EVENTS_H
#include "modes/modes.h"

/* States at which violations (tr_mode_violation) are stored: last evaluation, start and end of the step. */
enum { TR_NOW, TR_AT_START, TR_AT_END };

/* Result of a search for events in a step. */
enum { TR_NO_EVENT, TR_FOUND, TR_TOO_LARGE };

/* A ball's friction just before its event; tilt NaN: unknown. */
typedef struct tr_branch {
  double tilt;
  int ncontacts;
  tr_contact contacts[TR_EVENT_CONTACTS];
} tr_branch;

/* Event kind of a stop or latch hook that is engaged (`pressed`) or released. */
static int tr_stop_event_kind(const tr_sim *s, int stop, int pressed);

/* Place (0…1) of the first corner in the acceptable step just made, before `most`; 1: none, or at its ends. */
static double tr_find_first_corner(tr_sim *s, double most);

/* Whether a stop may be engaged and released inside the last step (end state in ynew), or the reverse. */
static int tr_has_stop_event_inside(tr_sim *s);

/* Flag of a stop that engages; for a hook, the tooth it falls on. depth: depths with this stop open. */
static double tr_pressed_flag(const tr_sim *s, int stop, const double *depth);

/* Whether pair i, of several components, slides against its frozen direction. Its friction jumped where the two were
 * perpendicular. Requires maps of the current state. */
static int tr_has_reversed(const tr_sim *s, int i);

/* Speed of pair i along its frozen direction, m/s. Requires maps of the current state. */
static double tr_speed_along(const tr_sim *s, int i);

/* Give pairs that left their line in the last step (a reversal in a loop of revolute joints) the direction of a first step.
 * Returns 1 if there are any; the step is then to be refused. Requires maps of its end. */
static int tr_release_left_lines(tr_sim *s);

/* Add the errors of the accepted step to those of the pairs' speeds; errors have either sign. */
static void tr_add_speed_errors(tr_sim *s);

/* Copy violations between two of TR_NOW, TR_AT_START, TR_AT_END. */
static void tr_copy_violations(tr_sim *s, int from, int when);

/* Set the margin of the next event from the crossing of `which` that cuts the step short. A parabola passes through its
 * violations at the start, at the event (zero) and at the end; the margin is its maximum. A parabola bent by less than one
 * tolerance has the largest margin. */
static void tr_set_crossing_margin(tr_sim *s, int which);

/* Reset the margin of the next event to the largest. */
static inline void tr_clear_margin(tr_sim *s) { s->events.margin = CLEAR_MARGIN, s->events.unsure = 0; }

/* Distance of ball i from its cone in model exchange, × s²/|ω|²; 1 for other pairs. */
static double tr_distance_to_cone(const tr_sim *s, int i);

/* Largest violation among pairs and stops at y, in tolerances less one; *worst: its index. Requires a solution at y. */
static double tr_worst_violation(tr_sim *s, const double *y, int *worst);

/* Whether the stages of the last step suggest an event of pair i inside it. Requires a solution at its end. */
static int tr_is_suspect(const tr_sim *s, int i);

enum { TR_BY_STOP = 2 }; /* value of `closely`: a stop may be reached inside the step */

/* Search the step for its first event on the dense output. closely: at and between all points (TR_BY_STOP: because of stops);
 * 0: only at its end, where *which is the worst. Returns TR_NO_EVENT, TR_FOUND with *which and *theta, or TR_TOO_LARGE. */
static int tr_search_step(tr_sim *s, int closely, int *which, double *theta);

/* Search the last step, evaluated at its end (ynew, K[end]), for its first event. Results as of tr_search_step. */
static int tr_find_event(tr_sim *s, int *which, double *theta);

/* Refine the end of sliding of pair i from (t, y), evaluated, with closed loops. Closing the loops leaves a speed there. Near a
 * dead centre, removing this speed by friction impulses would stop the whole mechanism, and coupled pairs are not yet at rest. */
static void tr_refine_event_time(tr_sim *s, int i, double *t, double *y);

/* Whether the end of sliding of pair i requires tr_refine_event_time. */
static int tr_is_refinement_needed(const tr_sim *s, int i);

/* Move the pending step's event to its refined time, so that rows before it belong to the step. */
static void tr_refine_pending_event(tr_sim *s);

/* Store an event of pair or stop `index` with n of its contacts. Does nothing if the buffer is full. */
static void tr_log_event(tr_sim *s, double t, int kind, int index, const tr_contact *before, const tr_contact *after, int n);

/* Sliding rate along the rates at the entry of the zone; negative after a reversal. */
static double tr_speed_along_entry(const tr_sim *s, int i);

/* Friction of ball i at (t, y) in the modes in force. Multipliers are restored. */
static tr_branch tr_evaluate_branch(tr_sim *s, int i, double t, const double *y);

/* Friction of ball `which` just before its event that cuts the step short; tilt NaN for pairs without cone and for stops. */
static tr_branch tr_evaluate_branch_before(tr_sim *s, int which);

/* Log a fold if the friction of ball i at (t, y), evaluated after its event, jumped from `was` to another branch. */
static void tr_log_fold(tr_sim *s, int i, double t, const double *y, const tr_branch *was);

/* Engage or release a stop at (t, y). A hook that lifts takes the stop behind it along; a ratchet's hook may fall on another tooth
 * at once. */
static void tr_switch_stop(tr_sim *s, int stop, double t, const double *y);

/* Switch the mode of pair or stop `which` at the state (t, y), just evaluated. */
static void tr_switch_mode(tr_sim *s, int which, double t, const double *y);

/* Log separations of contacts between the step's start and its fraction `end`, where the contacts are `now`. Returns 1 if other
 * states were evaluated for that. */
static int tr_log_separations(tr_sim *s, double end, const tr_contact *now);

/* Log separations in an accepted step without event. a: accelerations at its end, which was evaluated. */
static void tr_log_step_separations(tr_sim *s, const double *a);

/* Event kind of the change of pair i from the mode `old`, 0: none. Directions are compared as surface speeds, because travel
 * and rotation differ in units. */
static int tr_mode_change(const tr_sim *s, int i, const tr_mode *old);

/* Handle the event of the moving ball i, evaluated at (t, y): at its cone the ball changes branch. Where sliding turns back
 * before the cone, the ball takes the other branch if that exists at y, else slides on. Repeated changes mean that both
 * branches end there: TR_FAIL_MULTIPLIERS. */
static int tr_handle_cone_event(tr_sim *s, double t, const double *y, int i);

/* Handle the event of pair `which` (-1: a jump of something else) at (t, y), evaluated in the old modes: bring to rest, decide,
 * log. known: contacts before the event (0: those at y). Returns a status. */
static int tr_handle_event(tr_sim *s, double t, double *y, int which, const tr_contact *known);

/* Decide again at the state `y` for pair `which` (-1: none). Restores modes and state if that fails, or (others) if the modes
 * equal `modes`. Returns 1 if the run can go on. */
static int tr_decide_again(tr_sim *s, int which, const tr_mode *modes, int others);

/* Set all modes at the start of a run. Laws with a kink are saturated if the speed may exceed the kink without load, then
 * proportional if it does not with the loads found. Returns a status. */
static int tr_set_initial_modes(tr_sim *s);

/* Choose the modes again at the state `y` after a refused answer without a shorter step. Returns 1 if they differ. */
static int tr_reset_modes(tr_sim *s);

/* Repeat the failed decision at the state `y` with all starts of Newton's method, for the pair of the failed event. code:
 * status of the failure. Returns 1 on success. */
static int tr_decide_from_anywhere(tr_sim *s, int code);

/* Time until pair i rests at the acceleration just evaluated, s; INFINITY if it turns or accelerates. */
static double tr_time_to_rest_by_braking(tr_sim *s, int i);

/* The pair of several components that is about to rest, among pairs whose turning cut the steps; -1: none. Its speed and the
 * time left must be negligible and known. Requires an accepted step, evaluated at its end. A pair that stops along a line is
 * located like any other. */
static int tr_find_pair_to_capture(tr_sim *s);

/* Whether rest of pair i at (t, y), a copy of the state, has an answer. A slow pair in a loop may be at a dead centre, where
 * stopping it would stop the mechanism. A driven pair does not rest either. The decision is undone. */
static int tr_has_answer_at_rest(tr_sim *s, double t, double *y, int i);

/* Mark pairs of one component that stop with pair i, at the state just evaluated: their own stops follow within the error of
 * times. In symmetric mechanisms they are simultaneous, and only the step's error separates them. */
static void tr_mark_pairs_stopping_at_once(tr_sim *s, int i);

static inline void tr_clear_stopping_marks(tr_sim *s) { memset(tr_stopping_marks(s), 0, sizeof(int) * s->k->nsliders); }

/* Make the last stretch of sliding a step of its own: midpoint rule, linear dense output. Returns 0 if rest has no answer
 * there. */
static int tr_make_capture_step(tr_sim *s);

/* State at the event that cuts the step short, on the manifold; unprojected if the loops cannot be closed. */
static void tr_event_state(tr_sim *s, double t, double *out);

/* Replace y at the event by the last state found on the ball's branch of friction, if the branch ended earlier. A branch ends
 * like a square root, so its end time is known less well than its friction. Returns whether such a state was found, evaluated. */
static int tr_step_back_to_branch(tr_sim *s, double *y);

/* At the event of a pair with shared loads, restore the loads followed up to the state y, if all pairs hold with them. Newton's
 * method may have found others. If their root ends before the event, y becomes the last state where it exists. */
static void tr_restore_shares_before(tr_sim *s, double t, double *y);

/* Give pairs of several components that rest at the event (t, y) the direction they had just before; at y round-off decides it.
 * Returns 1 if there are any. */
static int tr_restore_directions_before(tr_sim *s, double t, const double *y);

/* Project y at the event onto the loops and evaluate it in the old modes, with the directions just before if needed. Returns 0
 * on failure. */
static int tr_evaluate_before_event(tr_sim *s, double t, double *y);

/* Contact forces just before the event at the state y, which was evaluated. Returns 0 if there are none. */
static int tr_contacts_before_event(tr_sim *s, double t, const double *y, tr_contact *out);
#endif
