/* Stage `diagnosis`: why a run cannot continue, and ways to continue nevertheless. */
#ifndef TR_DIAGNOSIS_H
#define TR_DIAGNOSIS_H
#include "events/events.h"

/* Let a ball spin at the state `y` if its sliding branch has ended, and if spinning satisfies the laws. Returns 1 if a ball now
 * spins. */
static int tr_let_ball_spin(tr_sim *s);

/* If friction has no solution, stop a sliding pair of negligible speed at the state `y`, and decide the modes of all pairs at rest.
 * (At a negligible speed, the sliding direction turns faster than steps can follow.) Returns 1 if the run can continue. */
static int tr_stop_slow_pair(tr_sim *s);

/* Stop the jamming pair at the state `y` at once. At a speed below the tolerance, this is an ordinary stop. At a higher speed it is
 * an impact, which requires the setting through_jams. Returns 1 if the run can continue. */
static int tr_continue_through_jam(tr_sim *s);

/* Search for a root in all combinations of branches, for the pairs that have two branches. The modes in force come first. Returns 1
 * on success. */
static int tr_find_root_on_branches(tr_sim *s);

/* The pair with the largest relative difference between the frictions `was` and `is`. *most receives this difference, 0 to 1. */
static int tr_find_most_changed(const tr_sim *s, const double *was, const double *is, double *most);

/* If the root of friction ends at the state `y` (a fold), search for another root a very short time later. Continue with the root
 * found. The run continues only past folds of sliding balls. Returns 1 on success. */
static int tr_pass_fold(tr_sim *s);

/* End the run for the reason `code`, and return the final status. If loops are at the end of their reach, the status names this
 * reason instead of `code`. (Near this position, reactions, friction and errors grow without bound.) */
static int tr_end_run(tr_sim *s, int code);
#endif
