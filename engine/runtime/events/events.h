/* Stage `events`: where modes end inside a step, and how these events are handled. */
#ifndef TR_EVENTS_H
#define TR_EVENTS_H
#include "modes/modes.h"

/* States at which violations (tr_mode_violation) are stored: the last evaluation, the start and the end of the step. */
enum { TR_NOW, TR_AT_START, TR_AT_END };

enum { TR_NO_EVENT, TR_FOUND, TR_TOO_LARGE };

enum { TR_SAMPLES = 8 }; /* number of points of the dense output at which a suspect step is evaluated */

/* Friction of a ball just before its event. tilt is NaN if the friction is unknown. */
typedef struct tr_branch {
  double tilt;
  int ncontacts;
  tr_contact contacts[TR_EVENT_CONTACTS];
} tr_branch;

/* Error, in tolerances, of a step that changes a position in a curve or field by too much; otherwise 0. Only the part of the step
 * up to the fraction `most` counts. Sets step.passed. */
static double tr_position_error(tr_sim *s, double most);

/* Largest growth factor of the next step after the last call of tr_position_error. */
static double tr_position_growth(const tr_sim *s);

/* Place (0…1) of the first corner before `most`, in the acceptable step that was just made; 1 if there is none inside the step. */
static double tr_find_first_corner(tr_sim *s, double most);

/* Mark in `inside` each stop that may have two events inside the last step: engagement and release, or the reverse. The end state
 * of the step is ynew. Returns 1 if any stop is marked. */
static int tr_mark_stops_with_events_inside(tr_sim *s, char *inside);

/* Whether a quantity may exceed 0 inside a step. g0, g1: its values at both ends; m0, m1: its slopes, per step. Returns 1 if the
 * cubic with these values and slopes has a maximum near 0 or above. */
static int tr_may_pass_zero(double g0, double m0, double g1, double m1);

/* Mark in `inside` (stops) each closed contact of a joint that only pushes whose normal force may pass zero twice inside the last
 * step. Requires the solution at the step's end. Returns 1 if any contact is marked. */
static int tr_mark_pulls_inside(tr_sim *s, char *inside);

/* Move the pending event to the instant at which the gap of contact c is 0. */
static void tr_refine_landing(tr_sim *s, int c);

/* Whether pair i, with several components, slides against its frozen direction. (Its friction jumped at the instant when its
 * velocity was perpendicular to this direction.) Requires maps of the current state. */
static int tr_has_reversed(const tr_sim *s, int i);

/* Speed of pair i along its frozen direction, m/s. Requires maps of the current state. */
static double tr_speed_along(const tr_sim *s, int i);

/* Give pairs that left their line in the last step a direction of norm TR_FROZEN, as in a first step. (In a loop of revolute
 * joints, a pair that leaves its line reverses.) Returns 1 if a pair left its line; the step must then be refused. Requires maps of
 * the step's end. */
static int tr_release_left_lines(tr_sim *s);

/* Add the speed errors of the accepted step to the accumulated speed errors of the pairs, as a root sum of squares. */
static void tr_add_speed_errors(tr_sim *s);

/* Copy the violations and reserves of state `from` to state `when` (TR_NOW, TR_AT_START, TR_AT_END). */
static void tr_copy_violations(tr_sim *s, int from, int when);

/* Set the margin of the next event, at which pair or stop `which` leaves its mode and cuts the step short. A parabola passes
 * through the violations of `which` at the start, at the event (zero) and at the end; its maximum is the margin. If the parabola
 * bends by less than one tolerance, the margin is CLEAR_MARGIN. */
static void tr_set_crossing_margin(tr_sim *s, int which);

static inline void tr_clear_margin(tr_sim *s) { s->events.margin = CLEAR_MARGIN, s->events.unsure = 0; }

/* Distance s²/|ω|² of ball i from its cone, in model exchange. Returns 1 for every pair that is not a moving ball. */
static double tr_distance_to_cone(const tr_sim *s, int i);

/* Largest violation of all pairs and stops at y, minus one, in tolerances. *worst receives the index of that pair or stop. Requires
 * a solution at y. */
static double tr_worst_violation(tr_sim *s, const double *y, int *worst);

/* Whether the stages of the last step suggest an event of pair i inside the step. Requires a solution at the step's end. */
static int tr_is_suspect(const tr_sim *s, int i);

/* Whether pair i, with one component, is at rest under a load that changed in the last step. */
static int tr_has_varying_load(const tr_sim *s, int i);

/* Marks of pairs and stops. SUSPECT: an event may lie between the points of a step. BY_SIDES: a pair at rest has different
 * capacities in its two directions. */
enum { TR_SUSPECT = 1, TR_BY_SIDES = 2 };

/* Mark each pair that may have an event inside the last step. Returns 1 if any pair is marked. Requires the solution and the
 * capacities at the step's end. */
static int tr_mark_suspect_pairs(tr_sim *s, char *suspect);

/* Search the step for its first event on the dense output. suspect: mark of each pair and stop; null pointer: the search covers
 * only the end of the step, whose worst pair or stop is *which. With marks, the search covers all points and the intervals between
 * the points. Returns TR_NO_EVENT, TR_FOUND with *which and *theta, or TR_TOO_LARGE. */
static int tr_search_step(tr_sim *s, const char *suspect, int *which, double *theta);

/* Search the last step for its first event. Requires an evaluated end (ynew, K[end]). Returns the results of tr_search_step. */
static int tr_find_event(tr_sim *s, int *which, double *theta);

/* Refine the time at which pair i stops, with closed loops, from the evaluated state (t, y). At the unrefined time, closure of the
 * loops gives the pair a small speed. Near a dead centre, a friction impulse that removes this speed would stop the whole
 * mechanism. */
static void tr_refine_event_time(tr_sim *s, int i, double *t, double *y);

/* Whether the end of sliding of pair i requires tr_refine_event_time. */
static int tr_is_refinement_needed(const tr_sim *s, int i);

/* Move the event of the pending step to its refined time. All rows before this time then belong to this step. */
static void tr_refine_pending_event(tr_sim *s);

/* Store an event of the pair or stop `index`, with n contacts of the pair. Does nothing if the buffer is full. */
static void tr_log_event(tr_sim *s, double t, int kind, int index, const tr_contact *before, const tr_contact *after, int n);

/* Sliding rate of pair i along its direction at the entry of the proportional zone; negative after a reversal. */
static double tr_speed_along_entry(const tr_sim *s, int i);

/* Friction of ball i at (t, y) in the modes in force. Restores the multipliers. */
static tr_branch tr_evaluate_branch(tr_sim *s, int i, double t, const double *y);

/* Friction of ball `which` just before the event that cuts the step short. If `which` is a stop or a pair without a cone, tilt is
 * NaN. */
static tr_branch tr_evaluate_branch_before(tr_sim *s, int which);

/* Log a fold if the friction of ball i at (t, y), evaluated after its event, is on another branch than `was`. */
static void tr_log_fold(tr_sim *s, int i, double t, const double *y, const tr_branch *was);

/* Engage or release a stop at (t, y). A hook that lifts releases the stop behind it. A ratchet's hook may fall on another tooth at
 * the same time. */
static void tr_switch_stop(tr_sim *s, int stop, double t, const double *y);

/* Switch the mode of pair or stop `which` at the state (t, y), which was evaluated last. */
static void tr_switch_mode(tr_sim *s, int which, double t, const double *y);

/* Log separations of contacts between the start of the step and its fraction `end`. now: contacts at `end`. Returns 1 if the search
 * evaluated other states. */
static int tr_log_separations(tr_sim *s, double end, const tr_contact *now);

/* Log separations in an accepted step without an event. a: accelerations at the step's end, which must be evaluated. */
static void tr_log_step_separations(tr_sim *s, const double *a);

/* Store the first instants in an accepted step, up to its fraction `end`, at which forces of watched followers become pulls. The
 * solution must be that of the step's end. */
static void tr_watch_step_pulls(tr_sim *s, double end);

/* Event kind of the change of pair i from the mode `old` to its present mode; 0 if this change is no event. Directions are compared
 * as surface speeds, because travel and rotation have different units. */
static int tr_mode_change(const tr_sim *s, int i, const tr_mode *old);

/* Handle the event of the moving ball i, evaluated at (t, y). If the ball is at its cone, it changes branch. If the ball turns away
 * before its cone, it takes the other branch if this branch exists at y, and otherwise slides on. Repeated changes at one time mean
 * that both branches end at this time; the function then returns TR_FAIL_MULTIPLIERS. */
static int tr_handle_cone_event(tr_sim *s, double t, const double *y, int i);

/* Handle the event of pair `which` at (t, y), evaluated in the old modes: bring pairs to rest, decide modes, log changes. which
 * = −1: the event is a jump of another quantity. known: contacts before the event; null pointer: the contacts at y. Returns a
 * status. */
static int tr_handle_event(tr_sim *s, double t, double *y, int which, const tr_contact *known);

/* Decide the modes again at the state `y` for pair `which` (−1: no pair). On failure, restores modes and state. others: whether
 * unchanged modes (equal to `modes`) count as failure. Returns 1 if the run can continue. */
static int tr_decide_again(tr_sim *s, int which, const tr_mode *modes, int others);

/* Set all modes at the start of a run. A pair whose law has a kink starts on the saturated branch if its speed may exceed the kink
 * speed of an unloaded pair. The pair changes to the proportional branch if its speed is below the kink speed under the computed
 * loads. Returns a status. */
static int tr_set_initial_modes(tr_sim *s);

/* Choose the modes again at the state `y`, when a solution is rejected and no shorter step is possible. Returns 1 if the modes
 * differ. */
static int tr_reset_modes(tr_sim *s);

/* Repeat the failed decision at the state `y` with all starts of Newton's method, for the pair of the failed event. code: status of
 * the failure. Returns 1 on success. */
static int tr_decide_from_anywhere(tr_sim *s, int code);

/* Time, s, until pair i rests at its last evaluated acceleration. Returns INFINITY if the sliding direction turns or the speed
 * grows. */
static double tr_time_to_rest_by_braking(tr_sim *s, int i);

/* The pair of several components that is about to rest, among pairs whose change of direction shortened steps; −1 if there is none.
 * Both its speed and its time until rest must be negligible. Pairs that stop along a line are excluded. Requires an accepted step,
 * evaluated at its end. */
static int tr_find_pair_to_capture(tr_sim *s);

/* Whether a solution exists with pair i at rest at (t, y), a copy of the state. A driven pair has no such solution. A slow pair
 * near a dead centre of a loop has none either, because its rest would stop the mechanism. Afterwards, the modes are those before
 * the call. */
static int tr_has_answer_at_rest(tr_sim *s, double t, double *y, int i);

/* Mark pairs of one component that stop together with pair i, at the state evaluated last. The stops of these pairs follow within
 * the error of event times. In symmetric mechanisms these stops are simultaneous; only the error of the step separates the stops in
 * time. */
static void tr_mark_pairs_stopping_at_once(tr_sim *s, int i);

static inline void tr_clear_stopping_marks(tr_sim *s) { memset(tr_stopping_marks(s), 0, sizeof(int) * s->k->nsliders); }

/* Make the last stretch of sliding a separate step, with the midpoint rule and linear dense output. Returns 0 if the step would
 * reach `limit`, where a drive may stop. Also returns 0 if no solution exists with the pair at rest at the step's end. */
static int tr_make_capture_step(tr_sim *s, double limit);

/* State at the event that cuts the step short, projected onto the manifold if the loops can be closed. */
static void tr_event_state(tr_sim *s, double t, double *out);

/* If the branch of a ball's friction ended before the event, replace y by the last state found on this branch. Near its end,
 * friction depends on time like a square root, so the computed time of the end is less accurate than the friction. Returns 1 if
 * such a state was found and evaluated. */
static int tr_step_back_to_branch(tr_sim *s, double *y);

/* At an event of a pair with shared loads, continue the multipliers from the beginning of the step to the event. Newton's method
 * may have found other multipliers at the event; if all pairs hold with the continued multipliers, the continued multipliers are
 * used. If the continued root ends before the event, y becomes the last state at which this root exists. */
static void tr_restore_shares_before(tr_sim *s, double t, double *y);

/* Give pairs of several components that rest at the event (t, y) their direction just before the event, because the direction at y
 * is round-off. Returns 1 if any direction was set. */
static int tr_restore_directions_before(tr_sim *s, double t, const double *y);

/* Project the event state y onto the loops and evaluate it in the old modes. If the evaluation fails, repeat it with the directions
 * just before the event. Returns 0 on failure. */
static int tr_evaluate_before_event(tr_sim *s, double t, double *y);

/* Contact forces just before the event at the evaluated state y. Returns 0 if the mechanism has no contacts. */
static int tr_contacts_before_event(tr_sim *s, double t, const double *y, tr_contact *out);
#endif
