/* Stage `checks`: whether solutions and runs obey the laws, and their certificates. */
#ifndef TR_CHECKS_H
#define TR_CHECKS_H
#include "integrators/integrators.h"

/* Largest speed of a held pair after loop closure that counts as rest, m/s. */
static inline double tr_closure_speed(const tr_sim *s);

/* Returns bits TR_BREAKS_… of the laws that the solution at the state y violates. rest (n): pairs of the present decision; 0
 * at the end of a step, where branches and end stops are checked too. Requires maps of y and multipliers in z. */
static int tr_check_solution(tr_sim *s, const double *y, const int *rest, int n);

/* tr_check_solution at the end of a step, without maps if the solution is recursive. *sure: whether maps were used; otherwise
 * tr_confirm_end must confirm a violation, unless the step ends beyond an event, where laws are broken as a rule. */
static int tr_suspect_end(tr_sim *s, const double *y, int *sure);

/* tr_check_solution at the end (t, y) of a step, with maps, after other states were evaluated. */
static int tr_confirm_end(tr_sim *s, double t, const double *y);

/* Find a valid solution at the end (t, y) of a step whose solution violates the laws `broken`. Newton's method starts from the
 * frictions at the start of the step, then from zero. Writes ẏ to `slope`. Returns 1 on success. */
static int tr_find_other_end(tr_sim *s, int broken, double t, const double *y, double *slope);

/* Whether a decision about the pairs `rest` (n) at the current state obeys the laws. Counts refused solutions. */
static int tr_is_valid_decision(tr_sim *s, const int *rest, int n);

/* Relative residual of the complement equations and rest conditions at the solution. */
static double tr_complement_residual(tr_sim *s);

/* Spectral radius of dlaw/dN · dN/dη at the solution, by power iteration: the factor by which the iteration η ← law(N(η))
 * contracts. Held pairs are excluded. */
static double tr_contraction(tr_sim *s);

static void tr_certify(tr_sim *s);

/* Tolerance by which the run is judged. */
static double tr_audit_tolerance(const tr_sim *s);

/* Compute the figures of all laws at the end of the last step. Requires the solution there. */
static void tr_audit_laws(tr_sim *s);

/* Add the figures of the accepted step that ends at (t, y) to the judgement; balance the energy at every EVERY_STEPS-th step. */
static void tr_audit_step(tr_sim *s, double t, const double *y);

/* After an impulse step to (t, y): balance the energy at every EVERY_STEPS-th step. */
static void tr_audit_impulses(tr_sim *s, double t, const double *y);

/* Start the audit at the time and state of the block. */
static void tr_audit_begin(tr_sim *s);

/* Energy minus works at the block's time and state, J; 0 if the audit does not balance energy. */
static double tr_audit_energy(tr_sim *s);

/* Exclude a legitimate change of energy (new parameters, an impact) from the balance. before: tr_audit_energy before the
 * change. */
static inline void tr_audit_allow_change(tr_sim *s, double before) { s->audit.begin += tr_audit_energy(s) - before; }

void tr_judge(const tr_sim *s, tr_judgement *out);
#endif
