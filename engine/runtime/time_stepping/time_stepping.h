/* Stage `time_stepping`: Moreau's impulse steps. */
#ifndef TR_TIME_STEPPING_H
#define TR_TIME_STEPPING_H
#include "diagnosis/diagnosis.h"

/* Move the positions of y along the rates v for a time h. */
static void tr_advance_positions(const tr_sim *s, double *y, const double *v, double h);

/* Set the end stops engaged during a step from the state y: its middle, or under error control its start, because steps end at
 * stop events. Logs changes at time t. */
static void tr_moreau_update_stops(tr_sim *s, double t, const double *y);

/* Correct the pairs that came to rest in an impulse step to (t, y); `then`: modes before. A pair whose sliding reversed inside
 * the step may be held by an impulse no force at rest provides: it slips. On loops, a pair may rest because others stick: it
 * sticks. ẏ of the step is restored. */
static void tr_moreau_update_rest(tr_sim *s, double t, const double *y, const tr_mode *then);

/* One impulse step h from (t, y): ynew, and modes at its end. Returns TR_OK, TR_MORE if a frozen direction turned too far, or a
 * status of failure. */
static int tr_moreau_substep(tr_sim *s, double t, const double *y, double h, double *ynew);

/* Log at time t the mode changes of pairs since `then`. jolt: stops are impacts. Returns whether there are any. */
static int tr_log_mode_changes(tr_sim *s, double t, const tr_mode *then, int jolt);

/* Make one acceptable step to at most `limit`, which waits as pending. Returns a status. */
static int tr_make_moreau_step(tr_sim *s, double limit);

/* Under method auto, switch to impulse steps when events accumulate, and back after a calm period. */
static void tr_choose_moreau(tr_sim *s);
#endif
