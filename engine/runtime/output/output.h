/* Stage `output`: rows of output columns, contact forces, wear. */
#ifndef TR_OUTPUT_H
#define TR_OUTPUT_H
#include "checks/checks.h"

/* share (nkappa) ← largest component of each scaled reaction in the open directions at the solution; each direction has norm 1.
 * Returns the number of directions. Directions of loops without a common joint are evaluated together. evaluations ← the number of
 * evaluations. columns ((evaluations + 1) × nout, or null pointer) ← the columns at z, then those of each evaluation. */
static int tr_open_shares(tr_sim *s, const double *y, const double *z, double *share, double *columns, int *evaluations);

/* full ← [λ | η] with λ of all rows, from [λ active | η] of the solution. resolve: whether to choose the undetermined reactions
 * with minimum norm. Requires a solution. */
static void tr_expand_multipliers(tr_sim *s, const double *y, double *full, int resolve);

/* Contact forces of all pairs at the solution. a: time derivatives of the rates. Returns 0 if the mechanism has no contacts. */
static int tr_evaluate_contacts(tr_sim *s, const double *y, const double *a, tr_contact *out);

/* Like tr_evaluate_contacts, with the accelerations evaluated last. */
static inline int tr_current_contacts(tr_sim *s, const double *y, tr_contact *out) { return tr_evaluate_contacts(s, y, TR_A(s, dy) + s->k->nq, out); }

/* Contact forces of pair i at the solution. Returns their number. */
static int tr_pair_contacts(tr_sim *s, int i, const double *y, tr_contact *out);

/* Write the values that only the runtime can compute, then the state of each pair. */
static void tr_fill_extra(tr_sim *s, const double *y, tr_extra *extra);

/* Unwrap the angles of cut joints at the end (t, y) of a step. Angles of successive rows may therefore differ by several turns. */
static void tr_follow_angles(tr_sim *s, double t, const double *y);

/* Post-process the columns of a row (tr_post), whose time is row[-1]. Rows must be passed in order of time. */
static void tr_finish_columns(tr_sim *s, double *row);

/* Post-process derivatives of the columns at the current state y with the multipliers z of all rows. A value that the runtime holds
 * between events has the derivative 0. */
static void tr_finish_derivatives(tr_sim *s, const double *y, const double *z, double *derivatives);

/* Evaluate the columns at (t, y), with row[0] = t. `there`: whether y is already projected and its multipliers are known. If not, y
 * is projected, and the multipliers are solved for if a column needs them. For the first row, the multipliers are always solved
 * for, because the first step starts from this solution. Returns TR_OK, TR_FAIL_MULTIPLIERS, or TR_FAIL_NOT_FINITE if a column
 * overflows. */
static int tr_output_row_of(tr_sim *s, double t, double *y, double *row, int there);

/* Like tr_output_row_of, for a state that is not projected yet and whose multipliers are unknown. */
static inline int tr_output_row(tr_sim *s, double t, double *y, double *row) { return tr_output_row_of(s, t, y, row, 0); }
#endif
