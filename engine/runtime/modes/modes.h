/* Stage `modes`: which pairs at rest stick, which slip, and in which direction. */
#ifndef TR_MODES_H
#define TR_MODES_H
#include "output/output.h"

/* The multiplier that moves pair m most, if the loops leave it one line of motion; -1: several directions, or none. */
static int tr_line_multiplier(const tr_sim *s, int m);

/* Find the classes of coupled pairs. Requires maps of the current state. */
static void tr_find_coupled_pairs(tr_sim *s);

/* Whether drives move pair i at (t, y): with zero rates in the state it has a speed, or its loops impose one. Leaves maps of
 * (t, y). */
static int tr_is_moved_by_drives(tr_sim *s, int i, double t, const double *y);

/* Whether pair i, of several components, is about to stop at (t, y) on the one line that its loops leave. Its speed then passes
 * through zero, except for a part across the line by which a step leaves the loops open. Requires maps of (t, y), and leaves
 * them. */
static int tr_is_stopping_on_line(tr_sim *s, int i, double t, const double *y);

/* Collect the set-valued pairs at rest: stuck, slower than tr_rest_speed, `also` (-1: none), and pairs of their classes.
 * Requires maps of the current state. Returns their number. */
static int tr_collect_pairs_at_rest(tr_sim *s, int also, int *rest);

/* Set the speeds of the pairs `rest` (n) in y to zero. In loops other pairs may come to rest with them; they join `rest`. also:
 * see tr_collect_pairs_at_rest. Requires maps of y. Returns the final number, and leaves maps of y. */
static int tr_bring_all_to_rest(tr_sim *s, double *y, int also, int *rest, int n);

/* Longest step, s, while pairs may stick: a quarter of the fastest load's period. While pairs are held, also of the fastest
 * rotation, because no error estimate shows their load. */
static double tr_longest_held_step(const tr_sim *s);

/* Freeze the sliding direction of pair i at its present rates. Requires maps of the current state. */
static void tr_freeze_direction(tr_sim *s, int i);

/* Freeze the sliding direction of pair i at the rates of the state `y`, the start of a step. */
static void tr_freeze_direction_at_start(tr_sim *s, int i);

/* Reverse directions of laws with a kink at rest, where a step starts past the reversal. Needed only without event location. */
static void tr_reverse_kink_directions(tr_sim *s);

/* Largest component of the frozen direction of pair i; 0: it does not slide. */
static double tr_frozen_length(const tr_sim *s, int i);

/* Give pairs that moved along a line an ordinary direction. Required before impulse steps, which freeze no direction. */
static void tr_clear_line_directions(tr_sim *s);

/* Whether pair i, which began to slide along a line, still moves along it with these rates. width: accepted speed across,
 * relative to the speed. Across the line friction at low speed is so stiff that explicit stages amplify round-off; a frozen
 * direction has no such part. */
static int tr_is_on_line(const tr_sim *s, int i, const double *rate, double width);

/* tr_is_on_line at the state `y` with LINE_WIDTH; 0 if pair i moves along no line. */
static int tr_is_still_on_line(tr_sim *s, int i);

/* Freeze the direction of pair i, with rates r and speed v, as that of a line: friction does not reverse with the rates. */
static void tr_freeze_line_direction(tr_sim *s, int i, const double *r, double v);

/* Whether pair i is in its first step from rest. */
static int tr_is_starting_to_slide(const tr_sim *s, int i);

/* Speed, m/s, up to which the direction stays frozen in a first step from rest. */
static double tr_onset_speed(const tr_sim *s);

/* Whether the direction of pair i, at this surface speed, stays frozen. */
static int tr_is_direction_frozen(const tr_sim *s, int i, double speed);

/* Let the stuck pair i and its class slip in the direction that its friction opposes; with prescribed motion, along its acceleration.
 * Requires a solution in the modes in force. */
static void tr_let_slip(tr_sim *s, int i);

/* Misfit of pair i (at rest) in its mode; > 0: the mode violates the law. Requires tr_solve_in_modes. */
static double tr_mode_misfit(tr_sim *s, int i);

/* Longest step, s, of pairs that start to slide: short, or as long as their speed stays below tr_onset_speed. dv: acceleration
 * of the rates. */
static double tr_longest_onset_step(tr_sim *s, const double *dv);

/* Whether a pair that starts to slide is too fast at y for the step h. Always 0 for steps of the least onset length. */
static int tr_is_onset_too_fast(const tr_sim *s, const double *y, double h);

/* Find modes and frictions of the pairs `rest` (n) by the cone equations. Requires maps of the current state. Returns 1 on
 * success, modes in force. */
static int tr_decide_by_cones(tr_sim *s, const int *rest, int n);

/* Predict the modes of many pairs at once, then change the few that violate the exact equations one by one. Returns 1 on
 * success. */
static int tr_decide_by_prediction(tr_sim *s, const int *rest, int n);

/* Largest share of capacity among the pairs `rest` (n). Requires tr_evaluate_capacities. */
static double tr_largest_share(const tr_sim *s, const int *rest, int n);

/* Whether the pairs at rest all stick after they share their load again. The reserve must grow by a margin, otherwise this
 * would repeat without end. */
static int tr_hold_by_resharing(tr_sim *s, const int *rest, int n);

/* Whether the pairs of `rest` (n) that stick in the modes in force hold with stored loads, where the rule fails. On success the
 * loads stay stored. */
static int tr_stick_by_stored_loads(tr_sim *s, const int *rest, int n);

/* Continue with stored loads where the root of the sharing rule ends but other loads hold all pairs. The choice of shares is
 * arbitrary and no reason to release a pair. Returns 1 if the run can go on. */
static int tr_continue_by_stored_loads(tr_sim *s);

/* From the modes in force, change the mode with the largest misfit until all fit; returns 1 then. In an impulse step, sliding
 * pairs keep their direction or stick; only pairs that cannot stick get another direction. */
static int tr_resolve_misfits(tr_sim *s, const int *rest, int n);

/* Whether the pairs at rest exceed the search through all combinations. */
static int tr_are_many_pairs(const tr_sim *s, const int *rest, int n);

/* Decide the modes of the pairs `rest` (n). Requires maps of the current state. released: pair just let go, whose mode holds
 * its direction (-1: none). Returns 0: no answer, 1: modes in force, 2: all stick and share their load again. */
static int tr_decide_modes(tr_sim *s, const int *rest, int n, int released);

/* Record in the audit if other modes of at most `most` pairs satisfy the laws as well: the motion is then not unique. */
static void tr_record_other_answers(tr_sim *s, double t, const int *rest, int n, int most);
#endif
