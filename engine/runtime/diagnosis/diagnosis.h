/* Stage `diagnosis`: why a run cannot go on, and ways to continue. */
#ifndef TR_DIAGNOSIS_H
#define TR_DIAGNOSIS_H
#include "events/events.h"

/* Let a ball spin at the state `y` if its sliding branch has ended and spinning is an answer. Returns 1 if one does. */
static int tr_let_ball_spin(tr_sim *s);

/* Stop a pair of negligible speed at the state `y`, and decide all pairs at rest, where friction has no answer. The direction
 * of such slow sliding turns faster than any step. Returns 1 if the run can go on. */
static int tr_stop_slow_pair(tr_sim *s);

/* Stop the jamming pair at the state `y` at once. Below the tolerance of velocities this is an ordinary stop, otherwise an
 * impact, which the setting through_jams must allow. Returns 1 if the run can go on. */
static int tr_continue_through_jam(tr_sim *s);

/* Find a root in all combinations of branches of pairs with two branches, starting with those in force. Returns 1 on success. */
static int tr_find_root_on_branches(tr_sim *s);

/* The pair whose friction differs most between two sets η, and its relative change `most` (0…1). */
static int tr_find_most_changed(const tr_sim *s, const double *was, const double *is, double *most);

/* After a failure of friction at the state `y`, continue with another root an instant later. Fails for the event of a pair
 * other than a moving ball. Returns 1 on success. */
static int tr_pass_fold(tr_sim *s);

/* End the run for the reason `code`, and return the final status. Loops at the end of their reach take precedence: near it
 * reactions, friction, steps and errors grow without bound. */
static int tr_end_run(tr_sim *s, int code);
#endif
