/* Stage `modes`: which pairs at rest stick, which slip, and in which direction. */
#ifndef TR_MODES_H
#define TR_MODES_H
#include "output/output.h"

/* The multiplier of pair m with the largest response, if the loops leave the pair a single line of motion. -1: several
 * directions, or no motion. */
static int tr_line_multiplier(const tr_sim *s, int m);

/* Find the classes of coupled pairs. Requires maps of the current state. */
static void tr_find_coupled_pairs(tr_sim *s);

/* Whether drives move pair i at (t, y): with zero rates in the state, the pair has a speed or the residual rates of the loops
 * are not zero. Leaves maps of (t, y). */
static int tr_is_moved_by_drives(tr_sim *s, int i, double t, const double *y);

/* Whether pair i, of several components, is about to stop at (t, y) on the single line that its loops leave. Its speed then
 * passes through zero. Any speed across the line comes from loops that the step leaves open. Requires maps of (t, y), and
 * leaves them. */
static int tr_is_stopping_on_line(tr_sim *s, int i, double t, const double *y);

/* Collect the set-valued pairs at rest: stuck, slower than tr_rest_speed, marked, `also` (-1: no pair), and pairs of their
 * classes. Requires maps of the current state. Returns their number. */
static int tr_collect_pairs_at_rest(tr_sim *s, int also, int *rest);

/* Set the speeds of the n pairs `rest` in y to zero. In loops, other pairs may come to rest with them; these are appended to
 * `rest`. also: see tr_collect_pairs_at_rest. Requires maps of y, and leaves them. Returns the final number of pairs. */
static int tr_bring_all_to_rest(tr_sim *s, double *y, int also, int *rest, int n);

/* Longest step, s, while pairs may stick: a quarter of the period of the fastest load. While pairs are stuck, also a quarter of
 * the fastest rotation, because no error estimate includes their load. */
static double tr_longest_held_step(const tr_sim *s);

/* Freeze the sliding direction of pair i at its present rates. Requires maps of the current state. */
static void tr_freeze_direction(tr_sim *s, int i);

/* Freeze the sliding direction of pair i at the rates of the state `y`, the start of a step. */
static void tr_freeze_direction_at_start(tr_sim *s, int i);

/* Reverse directions of laws with a kink at rest, where a step starts beyond the reversal. Required only without event
 * location. */
static void tr_reverse_kink_directions(tr_sim *s);

/* Maximum norm of the frozen direction of pair i; 0 if the pair does not slide. */
static double tr_frozen_length(const tr_sim *s, int i);

/* Give pairs that moved along a line a direction of ordinary norm. Required before impulse steps, which freeze no direction. */
static void tr_clear_line_directions(tr_sim *s);

/* Whether pair i, which started to slide along a line, still slides along this line at the given rates. width: accepted speed
 * across the line, relative to the speed. At low speed, friction across the line is so stiff that explicit stages amplify
 * round-off. A frozen direction avoids this. */
static int tr_is_on_line(const tr_sim *s, int i, const double *rate, double width);

/* tr_is_on_line at the state `y` with LINE_WIDTH; 0 if pair i does not slide along a line. */
static int tr_is_still_on_line(tr_sim *s, int i);

/* Freeze the direction of pair i, with rates r and speed v, as a line direction. Its friction does not reverse with the rates. */
static void tr_freeze_line_direction(tr_sim *s, int i, const double *r, double v);

/* Whether pair i is in its first step from rest. */
static int tr_is_starting_to_slide(const tr_sim *s, int i);

/* Speed, m/s, below which the direction stays frozen in a first step from rest. */
static double tr_onset_speed(const tr_sim *s);

/* Whether the direction of pair i stays frozen at this surface speed. */
static int tr_is_direction_frozen(const tr_sim *s, int i, double speed);

/* Let the stuck pair i and its class slip in the direction that its friction opposes, or with prescribed motion along its
 * acceleration. Requires a solution in the modes in force. */
static void tr_let_slip(tr_sim *s, int i);

/* Misfit of pair i (at rest) in its mode. A positive misfit means that the mode violates the law. Requires tr_solve_in_modes. */
static double tr_mode_misfit(tr_sim *s, int i);

/* Longest step, s, of pairs that start to slide: the least onset step, or longer while their speed stays below tr_onset_speed.
 * dv: time derivatives of the rates. */
static double tr_longest_onset_step(tr_sim *s, const double *dv);

/* Whether a pair that starts to slide is too fast at y for the step h. Always 0 for the least onset step. */
static int tr_is_onset_too_fast(const tr_sim *s, const double *y, double h);

/* Find modes and frictions of the n pairs `rest` by the cone equations. Requires maps of the current state. Returns 1 on
 * success; the modes are then in force. */
static int tr_decide_by_cones(tr_sim *s, const int *rest, int n);

/* Predict the modes of many pairs at once. Then change, one by one, the few modes that violate the exact equations. Returns 1
 * on success. */
static int tr_decide_by_prediction(tr_sim *s, const int *rest, int n);

/* Largest ratio of friction to capacity among the n pairs `rest`. Requires tr_evaluate_capacities. */
static double tr_largest_share(const tr_sim *s, const int *rest, int n);

/* Whether all n pairs `rest` stick after they share their load again. Their reserve must increase by a margin, so that
 * resharing cannot repeat without end. */
static int tr_hold_by_resharing(tr_sim *s, const int *rest, int n);

/* Whether the stuck pairs among the n pairs `rest` hold with stored loads, where the sharing rule fails. On success, the loads
 * stay stored. */
static int tr_stick_by_stored_loads(tr_sim *s, const int *rest, int n);

/* Continue with stored loads where the root of the sharing rule ends but other loads hold all pairs. Shares are an arbitrary
 * choice, so this is no reason to release a pair. Returns 1 if the run can continue. */
static int tr_continue_by_stored_loads(tr_sim *s);

/* Starting with the modes in force, change the mode with the largest misfit until all modes fit. Returns 1 if they fit. In an
 * impulse step, a sliding pair keeps its direction or sticks. It gets another direction only if it cannot stick. */
static int tr_resolve_misfits(tr_sim *s, const int *rest, int n);

/* Whether there are too many pairs at rest for a search of all combinations. */
static int tr_are_many_pairs(const tr_sim *s, const int *rest, int n);

/* Decide the modes of the n pairs `rest`. Requires maps of the current state. released: pair just released, whose mode holds
 * its direction; -1: no pair. Returns 0: no solution; 1: modes in force; 2: all pairs stick and share their load again. */
static int tr_decide_modes(tr_sim *s, const int *rest, int n, int released);

/* Record in the audit if other modes of the n pairs `rest` also satisfy the laws: the motion is then not unique. Does nothing
 * if n > most. */
static void tr_record_other_answers(tr_sim *s, double t, const int *rest, int n, int most);
#endif
