/* Stage `hosts`: the functions that Python and FMU binaries call by name. */
#ifndef TR_HOSTS_H
#define TR_HOSTS_H
#include "base/simulation.h"

/* Bytes of a block. ntable: number of doubles in the tables of signals. ev_capacity: number of events stored until they are
 * read. */
size_t tr_size(const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity);

/* Initialise a zeroed block of tr_size bytes. Returns 0 if the versions of the interface differ. */
int tr_init(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity);

/* Restore the addresses and offsets of a block that was copied or read from a file. The sizes must be equal. Returns 1 if the
 * contents can belong to a run. */
int tr_refit(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity);

/* Array `which` (TR_ARRAY_…) of the block; a null pointer for an unknown value. */
double *tr_array(tr_sim *s, int which);

/* Move a running simulation into a larger block with room for the Jacobian unit j. Returns 0 if the versions of the interface
 * differ. */
int tr_attach_jacobian(tr_sim *to, const tr_sim *from, const tr_jacobian *j, int ntable);

/* Write time t and `count` signals to x. tables: begins with the offset of each signal's record. */
void tr_signals(const double *tables, int count, double t, double *x);

/* Time of the next break of the signals, s; INFINITY if there is none. */
double tr_next_break(const tr_sim *s);

double tr_break_after(const tr_sim *s, double t);

void tr_certify_run(tr_sim *s, tr_certificate *out);

/* Number of roots of the complement equations at the state `y`, in the modes in force, found from many starts. Returns −1 if the
 * state cannot be evaluated. */
int tr_roots(tr_sim *s);

/* Audit the final state of the run. Replaces the solution. */
void tr_audit_end(tr_sim *s);

void tr_judge(const tr_sim *s, tr_judgement *out);

/* Integrate values over time up to each row. values, out: columns × rows; total: `columns` zeros. `ends` (count) divides the time
 * from the first row to the last into spans. In each span, polynomials through neighbouring rows are integrated from end to end. A
 * span without rows uses the row before it. */
void tr_integrate_rows(int rows, const double *time, int columns, const double *values, int count, const double *ends, double *total, double *out);

/* Distribute wear over the bins of a circle, which start at −π. volume: wear up to each row. In each row, the contact is at angle +
 * sense × turned, rad; between rows it moves along the shorter arc. stride: number of doubles between rows of angle and turned. */
void tr_bin_around(int rows, long stride, const double *angle, const double *turned, double sense, const double *volume, int bins, double *on);

/* Reason TR_WHY_… of a friction failure; *pair receives the pair that causes the failure. Returns TR_WHY_UNKNOWN if no law is
 * set-valued. */
int tr_diagnose_friction(tr_sim *s, int *pair);

/* Constraint row of a loop failure; −1 if it is unknown. *number receives the independence of the rows, from 1 (independent) to 0
 * (dependent); −1 if the failure has another reason. */
int tr_fail_row(const tr_sim *s, double *number);

/* Run to time t by bounded steps of equal size, which is at most the fixed step. Write the row at t. Returns TR_DONE or a
 * failure. */
int tr_reach_bounded(tr_sim *s, double t, double *row);

/* Advance to `target` with at most max_steps steps. Appends rows to rows[capacity][width], and counts these rows in *count. Returns
 * TR_DONE, TR_MORE, TR_ROWS_FULL, TR_EVENTS_FULL, TR_NEED_JACOBIAN, TR_CANCELLED or a failure. If the host cancels, the result is
 * TR_CANCELLED even after a failure. */
int tr_advance(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count);

/* Check the state, modes and multipliers of the block against the laws. deciding: 1 applies the checks that follow a decision about
 * pairs at rest, 0 those at the end of a step. Returns bits of the violated laws; 0 if all laws hold. */
int tr_verify(tr_sim *s, int deciding);

/* Compute all constants from the parameters in the block. */
void tr_set_parameters(tr_sim *s);

/* Close the loops at time t from the state in the block; see tr_assemble_state. */
int tr_assemble(tr_sim *s, double t, const double *qgiven, const double *vgiven);

/* Residuals of the loops at the state `y`, by row (m, or the sine of an angle), then residuals of their rates. */
void tr_gap(tr_sim *s, double *h);

/* Start a run at the assembled state (t, y): set scales, rank of the loops and modes, and write the first row. every: spacing of
 * rows, s; 0: a row for each step; −n: n rows for each step. With a null pointer `row`, no row is written. Returns a status. */
int tr_start(tr_sim *s, double t, double t_stop, double every, double *row);

/* Write the row at the block's state. Returns a status. */
int tr_row(tr_sim *s, double *row);

/* Evaluate ẏ and the multipliers z at the block's (t, y) in the modes in force. Returns 0 on failure. */
int tr_evaluate(tr_sim *s, double *dy, double *z);

/* dẏ/d[y, t] at the block's (t, y), ny × (ny + 1), column-major. Requires the Jacobian unit. Returns 0 on failure. */
int tr_derivatives(tr_sim *s, double *out);

/* Evaluate the state for tr_redundancy. Returns 1 on success, 0 if no reactions can be open, −1 if there is no solution. */
int tr_evaluate_for_redundancy(tr_sim *s);

/* Number of reaction directions that the motion does not determine at the block's state; −1 if there is no solution. share
 * (nkappa): as in tr_open_shares. */
int tr_redundancy(tr_sim *s, double *share);

/* Columns at the solution, then after a change of the reactions along directions that the motion does not determine. columns: as in
 * tr_open_shares. Returns the number of evaluations of tr_open_shares; 0 without a solution. */
int tr_open_columns(tr_sim *s, double *columns);

/* Watch the forces of followers until the next call. values (3 × count): last, peak and time of tr_pulls. count 0: none. */
void tr_watch_pulls(tr_sim *s, int count, const int *slot, const double *sense, double *values);

const tr_stats *tr_statistics(const tr_sim *s);

double tr_time(const tr_sim *s);

/* Return the number of stored events, and empty the buffer. The records stay readable until the run continues. */
int tr_events_take(tr_sim *s);

/* Set the host function that the runtime calls every few milliseconds; null pointer: no function. The function returns 1 to cancel.
 * A cancelled run or start ends with TR_CANCELLED. */
void tr_ask(tr_sim *s, tr_asked_host *host);

/* Replace the settings. The new settings apply from the next step. */
void tr_configure(tr_sim *s, const tr_settings *set);

/* Solve with all pairs stuck at the state `y`. out receives the result of each pair. Requires tr_start. Leaves the pairs stuck. A
 * following tr_evaluate returns the motion that remains possible. Returns 0 if the statics have no solution. */
int tr_hold_all(tr_sim *s, tr_held *out);

/* Directional derivatives at the block's (t, y): rates (ny) = ∂ẏ·direction, and columns (nout) = ∂columns·direction. The direction
 * consists of inputs (one signal per input) and dy (ny). Requires the Jacobian unit's arrays. Returns 0 on failure. */
int tr_directional(tr_sim *s, const tr_linear *l, const tr_signal *inputs, const double *dy, double *rates, double *columns);

/* Number of doubles of the record of an impact: [number of parts, state before it, parts (the first TR_IMPACT_PARTS)]. A part
 * is [external values, impulses of all multipliers, for each contact its kind and its restitution]. Kinds: 0 no impulse, 1 given
 * rate, 2 given impulse, 3 the part ends where a pair stops sliding (with this pair's index in place of the restitution). */
size_t tr_impact_length(const tr_sim *s);

/* Advance to `target` by at most `most` steps. After each step, record time, state (with works), and external values at the start
 * (begin) and end (x) of the step. The array `stages` (TR_STAGES × nz per step) receives the multipliers at each row of K. solved:
 * for each step, 1 if these multipliers belong to the step, 0 if an event has cut the step. made: number of recorded steps. rows:
 * room for `capacity` rows, of which *written are filled. impacts: record of the impact at the end of each step (tr_impact_length);
 * 0 parts: no impact. Discards events. Returns a status, as tr_advance does. */
int tr_record_steps(tr_sim *s, double target, int most, double *rows, long capacity, long *written, double *t, double *y, double *begin, double *x,
                    double *stages, int *solved, double *impacts, int *made);

/* Number of doubles of the work space of tr_march_tangents. */
size_t tr_tangents_work(const tr_tangents *g);

/* Compute f, its tangents df (m × nf) and the multipliers g->z at time t and state y. g->S: tangents of y. x: external values. In
 * df, the tangents of the multipliers replace those of the residuals. Returns 0 if no solution is found, and 2 if the host found
 * the solution. */
int tr_evaluate_tangents(tr_sim *s, const tr_tangents *g, double t, const double *y, const double *x, double *f, double *df);

/* Evaluate both sides of an event at time t and state y. `after` receives the rates after the event, with external values x1. f and
 * df (as in tr_evaluate_tangents) belong to the motion before the event, with external values x. `flow` (nf) contains the time
 * derivatives of f before the event. z1: multipliers after the event; null pointer: unknown. Sets g->z to these multipliers.
 * Returns 2 if the host found the solution before the event; `flow` is then unknown. */
int tr_cross_event(tr_sim *s, const tr_tangents *g, double t, const double *y, const double *x, const double *x1, const double *z1, double *f,
                   double *df, double *flow, double *after);

/* Integrate the tangents g->S along recorded steps by the run's explicit method. t, y (stride next), after: values before the first
 * step, then at the end of each of the `count` steps. x, stages: external values and multipliers within each step
 * (tr_record_steps). marks: four numbers for each step. These are: whether the host must complete the step's end, number of samples
 * inside the step, whether the step's end is a sample, whether `stages` belongs to the step. times: times of the samples. For each
 * sample, appends a row of columns to `values` and their derivatives (m × columns) to `derivatives`. Ends after the first step
 * whose end the host must complete. Returns the number of integrated steps, or −1 if the multipliers of a state have no
 * solution. */
int tr_march_tangents(tr_sim *s, const tr_tangents *g, int count, const double *t, const double *y, size_t next, const double *x, const double *after,
                      const double *stages, const int *marks, const double *times, double *values, double *derivatives);

/* Number of states that an importer integrates: y, and the works that columns need. */
int tr_states(const tr_sim *s);

/* Set time and state from the importer. y: tr_states values; null pointer: the state is unchanged. */
void tr_set_state(tr_sim *s, double t, const double *y);

/* ẏ of the last evaluation. tr_indicators returns the event indicators of this evaluation. */
const double *tr_rates_known(const tr_sim *s);

const double *tr_indicators(const tr_sim *s);

/* Evaluate ẏ and the indicators at the block's (t, y) in the modes in force. If an event before t is not located yet, there may be
 * no solution. ẏ then uses the last multipliers found, and the last indicator is negative. Returns 0 if even this ẏ cannot be
 * evaluated. */
const double *tr_rates_in_modes(tr_sim *s);

/* If all indicators are positive, store the state evaluated last; later evaluations follow the branch of friction from this state.
 * The host calls this function when an importer requests indicators; importers request indicators at accepted steps. */
void tr_follow(tr_sim *s);

/* Complete a step of the importer. Returns 1 if the importer must handle an event. */
int tr_completed(tr_sim *s);

/* Begin model exchange at the block's (t, y) with the modes and multipliers in force. Returns ẏ; 0 on failure. */
const double *tr_begin_exchange(tr_sim *s);

/* Write the row at the block's (t, y) in the modes in force. Returns a status. */
int tr_row_in_modes(tr_sim *s, double *row);

/* Nominal value of state i for the importer (``NOMINAL`` of fmu/variables/model_exchange_states.py). */
double tr_nominal(const tr_sim *s, int i);

/* Like tr_directional, at the block's (t, y) in the modes in force; projects y. rates, dy: tr_states values. integral: 1 for each
 * column that contains works, otherwise 0. If `integral` is a null pointer, columns are not computed. */
int tr_directional_in_modes(tr_sim *s, const tr_linear *l, const int *integral, const tr_signal *inputs, const double *dy, double *rates,
                            double *columns);

/* Handle an event at the block's (t, y): breaks, open loops, ends of modes. `jumped`: whether loads have jumped. *changed receives
 * whether y changed. Returns a status. */
int tr_update(tr_sim *s, int jumped, int *changed);

/* Continue the batch for about `budget` steps and rows. TR_DONE: all cases are done. TR_MORE: call again. TR_CASE_FAILED: a case
 * ended early; `now` is its block until the next call. TR_NEED_JACOBIAN, TR_NEED_REDUNDANT: the host provides the unit in
 * variant[which] and calls again. TR_CANCELLED: the host cancelled during a case. TR_WAITS: the case waits for the lanes of its
 * batch. */
int tr_batch_run(tr_batch *b, long budget);

/* End the present case with this status, because the host cancelled it, or an ensemble dropped it. The next tr_batch_run continues
 * as after TR_CASE_FAILED. */
void tr_batch_end(tr_batch *b, int status);

/* Bytes of tr_batch. The host compares this number with its own declaration. */
size_t tr_batch_size(void);

void tr_ensemble_begin(tr_ensemble *e);

/* Remove the present case of strand `which` from the ensemble. The host then runs this case alone. */
void tr_ensemble_drop(tr_ensemble *e, int which);

/* Continue for about `budget` calls of the SIMD lanes. TR_DONE: all cases ended. TR_MORE: call again. TR_NEED_JACOBIAN: some cases
 * wait for the Jacobian unit. */
int tr_ensemble_run(tr_ensemble *e, long budget);

/* Continue the cases that waited for the Jacobian unit. */
void tr_ensemble_resume(tr_ensemble *e);

/* Run until t and write the row at t; row may be a null pointer. Steps may extend up to `limit` ≥ t. Returns TR_DONE, TR_MORE after
 * max_steps steps, or a lasting failure. A later call for the same t writes the row that this call has left out. */
int tr_reach(tr_sim *s, double t, double limit, long max_steps, double *row);

/* Like tr_reach, but also ends at the next logged event, with TR_EVENT and the row just after this event. before receives the row
 * just before the event; null pointer: not requested. */
int tr_reach_event(tr_sim *s, double t, double limit, long max_steps, double *row, double *before);

/* End of the next internal step, s. The step is computed, and waits for the next call that advances the run. Returns `limit` if no
 * step can be made; the next call then reports the failure. */
double tr_next_end(tr_sim *s, double limit);

/* Whether pair i is in the proportional zone of its law. *turned receives the time of a reversal inside the zone; NaN: no reversal
 * yet, or a reversal inside the waiting step. The reversal is logged when the pair leaves the zone. */
int tr_within_zone(const tr_sim *s, int i, double *turned);

/* Cut the waiting step at a time t inside the step. Returns TR_OK or a failure. */
int tr_cut(tr_sim *s, double t);

/* Continue at the block's (t, y) after an external change. anew: whether parameters changed; the modes are then decided again.
 * Returns TR_OK or a failure. */
int tr_resume(tr_sim *s, int anew);

/* tr_input_record: record of an external input. tr_input_value evaluates this record and its derivatives at time t. */
tr_input *tr_input_record(tr_sim *s, int input);

void tr_input_value(const tr_input *record, double t, tr_signal *value);
#endif
