/* Stage `output`: rows of output columns, contact forces, wear. */
#ifndef TR_OUTPUT_H
#define TR_OUTPUT_H
#include "checks/checks.h"

/* Directions of λ (rows × count) that the motion leaves open at the solution, their scaled reactions N (nkappa × count), and
 * those of z (base). Returns the count. */
static int tr_open_reactions(tr_sim *s, const double *y, const double *z, double *dir, double *N, double *base);

/* full ← [λ | η] over all rows from [λ active | η]. resolve: choose open reactions smallest. Requires a solution. */
static void tr_expand_multipliers(tr_sim *s, const double *y, double *full, int resolve);

/* Contact forces of all pairs at the solution; a: accelerations of the rates. Returns 0 if there are none. */
static int tr_evaluate_contacts(tr_sim *s, const double *y, const double *a, tr_contact *out);

/* tr_evaluate_contacts with the accelerations just evaluated. */
static inline int tr_current_contacts(tr_sim *s, const double *y, tr_contact *out) { return tr_evaluate_contacts(s, y, TR_A(s, dy) + s->k->nq, out); }

/* Contact forces of pair i at the solution. Returns their number. */
static int tr_pair_contacts(tr_sim *s, int i, const double *y, tr_contact *out);

/* Fill in values that only the runtime knows, and behind them the state of each pair. */
static void tr_fill_extra(tr_sim *s, const double *y, tr_extra *extra);

/* Post-process columns of a row (tr_post), in order of time. */
static void tr_finish_columns(tr_sim *s, double *row);

/* Evaluate the columns at (t, y); row[0] = t. Projects y and solves for multipliers if a column needs them (always for the
 * first row, from which the first step starts). there: both are done. Returns TR_OK, TR_FAIL_MULTIPLIERS, or TR_FAIL_NOT_FINITE
 * for a column that overflows. */
static int tr_output_row_of(tr_sim *s, double t, double *y, double *row, int there);

/* tr_output_row_of without a solution at (t, y). */
static inline int tr_output_row(tr_sim *s, double t, double *y, double *row) { return tr_output_row_of(s, t, y, row, 0); }
#endif
