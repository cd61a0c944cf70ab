/* Stage `checks`: verification of solutions and runs against the laws, and certificates. */
#ifndef TR_CHECKS_H
#define TR_CHECKS_H
#include "integrators/integrators.h"

/* relative to the speed unit: round-off of rates set to zero. Divided by the length of a short impulse step, this round-off looks
 * like an acceleration. */
#define NO_SPEED 1e-15

/* Largest acceleration that counts as zero, in units of length · rate². In an impulse step, this acceleration includes round-off of
 * speeds. */
static inline double tr_acceleration_tolerance(const tr_sim *s) {
  return s->moreau.h > 0.0 ? fmax(TOL_RESOLVE, NO_SPEED / (s->moreau.h * s->set.rate)) : TOL_RESOLVE;
}

/* Largest speed, m/s, at which a held pair counts as at rest after loop closure. */
static inline double tr_closure_speed(const tr_sim *s);

/* Returns bits TR_BREAKS_… of the laws that the solution at the state y violates. rest (n): pairs of the present decision; null
 * pointer: the solution is the end of a step, where branches and end stops are checked, too. Requires maps of y and multipliers in
 * z. */
static int tr_check_solution(tr_sim *s, const double *y, const int *rest, int n);

/* Call tr_check_solution at the end of a step, without maps if the solution is recursive. *sure receives whether maps were used.
 * Without maps, tr_confirm_end must confirm each violation that no event inside the step explains. */
static int tr_suspect_end(tr_sim *s, const double *y, int *sure);

/* Evaluate the end (t, y) of a step again, with maps, and return tr_check_solution. Required if other states were evaluated after
 * this end. */
static int tr_confirm_end(tr_sim *s, double t, const double *y);

/* Find a valid solution at the end (t, y) of a step, where the present solution violates the laws `broken`. Newton's method starts
 * from the frictions at the start of the step, then from zero. Writes ẏ to `slope`. Returns 1 on success. */
static int tr_find_other_end(tr_sim *s, int broken, double t, const double *y, double *slope);

/* Whether a decision about the pairs `rest` (n) at the current state satisfies the laws. Counts refused decisions. */
static int tr_is_valid_decision(tr_sim *s, const int *rest, int n);

/* Relative residual of the complement equations and rest conditions at the solution. */
static double tr_complement_residual(tr_sim *s);

/* Spectral radius of ∂law/∂N · ∂N/∂η at the solution. The fixed-point iteration η ← law(N(η)) contracts by this factor. Held pairs
 * are excluded. */
static double tr_contraction(tr_sim *s);

static void tr_certify(tr_sim *s);

/* Tolerance used in the judgement of the run. */
static double tr_audit_tolerance(const tr_sim *s);

/* Compute the figures of all laws at the end of the last step. Requires the solution at this end. checked: whether the last check
 * was tr_suspect_end; its accelerations are then reused. */
static void tr_audit_laws(tr_sim *s, int checked);

/* Add the figures of the accepted step that ends at (t, y) to the judgement. Every EVERY_STEPS-th step also balances the energy. */
static void tr_audit_step(tr_sim *s, double t, const double *y);

/* After an impulse step to (t, y): balance the energy if this is an EVERY_STEPS-th step. */
static void tr_audit_impulses(tr_sim *s, double t, const double *y);

/* Start the audit at the block's time and state. */
static void tr_audit_begin(tr_sim *s);

/* Energy minus works at the block's time and state, J; 0 if the audit does not balance energy. */
static double tr_audit_energy(tr_sim *s);

/* Exclude a legitimate change of energy (new parameters, an impact) from the balance. before: value of tr_audit_energy before the
 * change. */
static inline void tr_audit_allow_change(tr_sim *s, double before) { s->audit.begin += tr_audit_energy(s) - before; }

void tr_judge(const tr_sim *s, tr_judgement *out);
#endif
