/* Stage `time_stepping`: Moreau's impulse steps. */
#ifndef TR_TIME_STEPPING_H
#define TR_TIME_STEPPING_H
#include "diagnosis/diagnosis.h"

static void tr_advance_positions(const tr_sim *s, double *y, const double *v, double h);

/* Set which end stops are engaged during a step, from the state y. y is the middle of the step or, under error control, its start,
 * because steps under error control end at events of stops. Logs changes at time t. */
static void tr_moreau_update_stops(tr_sim *s, double t, const double *y);

/* Correct the pairs that came to rest in an impulse step to (t, y). `then`: modes before the step. A pair that stopped in the step,
 * and that its friction cannot hold, slips: its sliding reversed inside the step. In loops, a pair that rests only because other
 * pairs stick also gets the mode stuck. Restores the step's ẏ. */
static void tr_moreau_update_rest(tr_sim *s, double t, const double *y, const tr_mode *then);

/* Find modes and multipliers of a step h from (t, y). mid: the middle position, with the rates of y. Leaves the maps of `mid`.
 * Returns 0 on failure. */
static int tr_moreau_solve(tr_sim *s, double t, const double *y, double *mid, double h);

/* One impulse step h from (t, y). Results: ynew, and the modes at the step's end. Returns TR_OK, TR_MORE if a frozen direction
 * turned too far, or a failure status. */
static int tr_moreau_substep(tr_sim *s, double t, const double *y, double h, double *ynew);

/* Log the changes of pair modes since `then`, at time t. jolt: whether to log pairs that came to rest as impacts. Returns 1 if any
 * mode changed. */
static int tr_log_mode_changes(tr_sim *s, double t, const tr_mode *then, int jolt);

/* Make one acceptable step that ends at most at `limit`; the step is then pending. Returns a status. */
static int tr_make_moreau_step(tr_sim *s, double limit);

/* Method auto: switch to impulse steps when events accumulate, and back after a calm period. */
static void tr_choose_moreau(tr_sim *s);
/* Speed below which a pair is at rest in an impact, m/s. */
static double tr_rest_speed_in_impact(const tr_sim *s);

/* Whether sliding pair i keeps its direction in the impulse problem of `s->impact`. Requires maps of the current state. */
static int tr_slides_in_impact(const tr_sim *s, int i);

/* Whether pair i keeps its direction in an impulse problem if it slides. slides: TR_SLIDES_NONE … TR_SLIDES_ALL. */
static int tr_slides_on(const tr_sim *s, int i, int slides);
#endif
