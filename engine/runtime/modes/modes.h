/* Stage `modes`: which pairs at rest stick, which slip, and in which direction. */
#ifndef TR_MODES_H
#define TR_MODES_H
#include "output/output.h"

/* The multiplier of pair m with the largest response, if the loops leave the pair a single line of motion. Returns −1 for several
 * directions, or for no motion. */
static int tr_line_multiplier(const tr_sim *s, int m);

/* Find the classes of coupled pairs. Requires maps of the current state. */
static void tr_find_coupled_pairs(tr_sim *s);

/* Whether drives move pair i at (t, y). Drives move the pair if all rates of the state are zero, but the pair has a speed, or the
 * loops have residual rates. Leaves maps of (t, y). */
static int tr_is_moved_by_drives(tr_sim *s, int i, double t, const double *y);

/* Whether pair i is about to stop at (t, y). The pair has several components, but loops let it slide along one line only, so its
 * speed passes through zero. Speed perpendicular to this line does not count, because it is an error of slightly open loops.
 * Requires maps of (t, y), and leaves these maps valid. */
static int tr_is_stopping_on_line(tr_sim *s, int i, double t, const double *y);

/* Collect the set-valued pairs at rest in `rest`. These are stuck pairs, pairs slower than tr_rest_speed, marked pairs, `also` (−1:
 * no pair), and other pairs of their classes. Requires maps of the current state. Returns their number. */
static int tr_collect_pairs_at_rest(tr_sim *s, int also, int *rest);

/* Set the speeds of the n pairs `rest` in y to zero. In loops, other pairs may come to rest at the same time; they are appended to
 * `rest`. also: see tr_collect_pairs_at_rest. Requires maps of y; leaves maps of the new y. Returns the final number of pairs. */
static int tr_bring_all_to_rest(tr_sim *s, double *y, int also, int *rest, int n);

/* Longest step, s, while pairs may stick: a quarter of the period of the fastest load. While pairs are stuck, a quarter of the
 * period of the fastest rotation is a limit, too, because no error estimate includes the load of stuck pairs. */
static double tr_longest_held_step(const tr_sim *s);

/* Freeze the sliding direction of pair i at its rates r. */
static void tr_set_sliding_direction(tr_sim *s, int i, const double *r);

/* Freeze the sliding direction of pair i at its present rates. Requires maps of the current state. */
static void tr_freeze_direction(tr_sim *s, int i);

/* Freeze the sliding direction of pair i at the rates of the state `y`, where a step starts. */
static void tr_freeze_direction_at_start(tr_sim *s, int i);

/* For laws with a kink at rest, reverse the direction of each pair that has already reversed at the start of a step. Required only
 * without event location. */
static void tr_reverse_kink_directions(tr_sim *s);

/* Maximum norm of the frozen direction of pair i; 0 if the pair does not slide. */
static double tr_frozen_length(const tr_sim *s, int i);

/* Replace the norm ON_LINE of directions by an ordinary norm. Called before impulse steps, because impulse steps freeze no line
 * direction. */
static void tr_clear_line_directions(tr_sim *s);

/* Whether pair i, which started to slide along a line, still slides along this line at the given rates. width: accepted speed
 * perpendicular to the line, as a fraction of the speed. (A frozen direction is used, because at low speed friction perpendicular
 * to the line is so stiff that explicit stages amplify round-off.) */
static int tr_is_on_line(const tr_sim *s, int i, const double *rate, double width);

/* Call tr_is_on_line at the state `y` with LINE_WIDTH. Returns 0 if pair i does not slide along a line. */
static int tr_is_still_on_line(tr_sim *s, int i);

/* Freeze the direction of pair i, which has the rates r and the speed v, as that of a line (norm ON_LINE). The pair's friction then
 * does not reverse when the rates reverse. */
static void tr_freeze_line_direction(tr_sim *s, int i, const double *r, double v);

/* Whether pair i is in its first step from rest. */
static int tr_is_starting_to_slide(const tr_sim *s, int i);

/* Speed, m/s, below which the direction stays frozen during a first step from rest. */
static double tr_onset_speed(const tr_sim *s);

/* Whether the direction of pair i stays frozen at this surface speed. */
static int tr_is_direction_frozen(const tr_sim *s, int i, double speed);

/* Let the stuck pair i and its class slip. The direction is the one that the pair's friction opposes; for prescribed motion, it is
 * the direction of the acceleration. Requires a solution in the modes in force. */
static void tr_let_slip(tr_sim *s, int i);

/* Misfit of pair i, which is at rest: by how much the pair violates the law in its mode. If the misfit is negative, the mode fits.
 * Requires tr_solve_in_modes. */
static double tr_mode_misfit(tr_sim *s, int i);

/* Longest step, s, while pairs start to slide: the least onset step (ONSET_STEP), or a longer step over which their speed stays
 * below tr_onset_speed. dv: time derivatives of the rates. */
static double tr_longest_onset_step(tr_sim *s, const double *dv);

/* Whether a pair that starts to slide is too fast at y for the step h. Returns 0 for the least onset step. */
static int tr_is_onset_too_fast(const tr_sim *s, const double *y, double h);

/* Find modes and frictions of the n pairs `rest` by the cone equations. Requires maps of the current state. Returns 1 on
 * success; the modes are then in force. */
static int tr_decide_by_cones(tr_sim *s, const int *rest, int n);

/* Predict the modes of many pairs at once, then change modes that violate the exact equations, one by one. Returns 1 on success. */
static int tr_decide_by_prediction(tr_sim *s, const int *rest, int n);

/* Largest ratio of friction to capacity among the n pairs `rest`. Requires tr_evaluate_capacities. */
static double tr_largest_share(const tr_sim *s, const int *rest, int n);

/* Whether all n pairs `rest` stick after they share their load again. Returns 0 unless their reserve grows by a minimal amount;
 * this condition prevents endless resharing. */
static int tr_hold_by_resharing(tr_sim *s, const int *rest, int n);

/* Whether the stuck pairs among the n pairs `rest` hold with stored loads, where the sharing rule fails. On success, the loads stay
 * stored. */
static int tr_stick_by_stored_loads(tr_sim *s, const int *rest, int n);

/* Continue with stored loads where the root of the sharing rule ends, but other loads hold all pairs. Because the sharing rule is a
 * choice, not a law, the end of its root is no reason to release a pair. Returns 1 if the run can continue. */
static int tr_continue_by_stored_loads(tr_sim *s);

/* Starting from the modes in force, repeatedly change the mode with the largest misfit. Returns 1 when all modes fit. In an impulse
 * step, a sliding pair keeps its direction or sticks; only a pair that cannot stick gets another direction. */
static int tr_resolve_misfits(tr_sim *s, const int *rest, int n);

/* Whether there are too many pairs at rest for a search over all combinations of modes. */
static int tr_are_many_pairs(const tr_sim *s, const int *rest, int n);

/* Decide the modes of the n pairs `rest`. Requires maps of the current state. released: pair just released, with its direction in
 * its mode; −1: no pair. Returns 0: no solution; 1: the modes are in force; 2: all pairs stick and share their load again. */
static int tr_decide_modes(tr_sim *s, const int *rest, int n, int released);

/* Search for other modes of the n pairs `rest` that also satisfy the laws. If such modes exist, the motion is not unique, and the
 * audit records this fact. The modes with the most pairs that stick are then in force, unless the pair `released` (−1: none) has
 * just reached its capacity. Does nothing if n > most. */
static void tr_prefer_sticking(tr_sim *s, double t, const int *rest, int n, int released, int most);
#endif
