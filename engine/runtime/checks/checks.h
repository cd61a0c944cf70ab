/* Stage `checks`: whether solutions and runs obey the laws, and their certificates. */
#ifndef TR_CHECKS_H
#define TR_CHECKS_H
#include "integrators/integrators.h"

/* Speed of a pair at rest that counts as zero after closing the loops, m/s. */
static inline double tr_closure_speed(const tr_sim *s);

/* Laws that the solution violates (bits TR_BREAKS_…), at the state y. rest (n): pairs just being decided; 0: the end of a step,
 * for which branches and end stops are checked too. Requires maps of y and multipliers in z. */
static int tr_check_solution(tr_sim *s, const double *y, const int *rest, int n);

/* Find a valid solution at the end (t, y) of a step that violates the laws `broken`. Newton's method starts at the step's
 * start, then at zero. Leaves ẏ in `slope`. Returns 1 on success. */
static int tr_find_other_end(tr_sim *s, int broken, double t, const double *y, double *slope);

/* Whether a decision about the pairs `rest` at the current state obeys the laws. Counts refusals. */
static int tr_is_valid_decision(tr_sim *s, const int *rest, int n);

/* Relative residual of the complement equations and rest conditions at the solution. */
static double tr_complement_residual(tr_sim *s);

/* Spectral radius of dlaw/dN · dN/dη at the solution, by power iteration: the factor by which the iteration η ← law(N(η))
 * contracts. Held pairs are excluded. */
static double tr_contraction(tr_sim *s);

/* Update the certificate with the solution. */
static void tr_certify(tr_sim *s);

/* Tolerance by which the run is judged. */
static double tr_audit_tolerance(const tr_sim *s);

/* Note the figures of all laws at the end of the last step. Requires its solution. */
static void tr_audit_laws(tr_sim *s);

/* Record the figures of the accepted step to (t, y). */
static void tr_audit_step(tr_sim *s, double t, const double *y);

/* Balance the energy of an impulse step to (t, y), at every EVERY_STEPS-th step. */
static void tr_audit_impulses(tr_sim *s, double t, const double *y);

/* Start the audit at the block's (t, y). */
static void tr_audit_begin(tr_sim *s);

/* Energy of the block's (t, y), J, for tr_audit_allow_change. */
static double tr_audit_energy(tr_sim *s);

/* Exclude a change of energy since `before` that is no error (parameters, an impact). */
static inline void tr_audit_allow_change(tr_sim *s, double before) { s->audit.begin += tr_audit_energy(s) - before; }

/* Verdict of the audit so far. */
void tr_judge(const tr_sim *s, tr_judgement *out);
#endif
